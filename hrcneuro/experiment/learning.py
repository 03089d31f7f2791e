"""The closed loop beside a session at virtual pace: what decides and learns, in the same process, on the same clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hrcneuro.decoding.frozen import FrozenDecoder
from hrcneuro.learning.online import OnlineLearner
from hrcneuro.live import online_streams
from hrcneuro.live.online import Online
from hrcneuro.live.parameters import OnlineOptions
from hrcneuro.live.policies import Policies, source_of
from hrcneuro.live.transport import DECISIONS
from hrcneuro.live.virtual import VirtualNetwork, VirtualOutlet

_SOON_S = 0.01


@dataclass(frozen=True)
class Loop:
    """What decides and learns.

    Attributes:
        decoder, learner, options: As :class:`~hrcneuro.live.online.Online` takes them.
        log: Takes its lines.
        rail_uv: A channel that reaches this is railed, µV.
    """

    decoder: FrozenDecoder
    learner: OnlineLearner
    options: OnlineOptions
    log: Callable[[Mapping[str, Any]], None]
    rail_uv: float = 0.0


class Learning:
    """A loop over the streams of a virtual network.

    Attributes:
        online: The loop.
        policies: What the experiment hears of it.
    """

    def __init__(self, network: VirtualNetwork, subject: str, loop: Loop) -> None:
        """Find the EEG, which is there.

        Raises:
            HardwareError: The decoder does not serve it.
        """
        outlet = VirtualOutlet(DECISIONS, "Markers", ["decision"], sfreq=0, source_id=source_of(subject, 0))
        network.outlets.append(outlet)
        eeg = online_streams.find_eeg(network, network.clock, network.wait, loop.decoder, loop.options)
        self.online = Online(
            network, network.clock, eeg, loop.decoder, loop.learner, loop.options, subject=subject,
            publish=lambda text, stamp: outlet.send(text, stamp), log=loop.log, rail_uv=loop.rail_uv,
        )  # fmt: skip
        self.policies = Policies(network, network.clock, subject)
        self.policies.find(network.wait, patience_s=1.0)

    def soon(self, passed: float) -> bool:
        """Return whether a decision is due ``passed`` seconds from the last step: then samples are to come at once."""
        return self.online.deciding.due_s() - passed < _SOON_S

    def step(self) -> None:
        """Decide what is due, and let the experiment hear of it."""
        self.online.step()
        self.policies.pull()
