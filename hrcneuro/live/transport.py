"""What streams are, and how they come and go, whatever carries them: LSL (:mod:`hrcneuro.live.lsl`), or a test.

A sender pushes samples with stamps of its own clock; a receiver has its clock, too, and measures how far the two are
apart. Who records or sends is handed a :class:`Network` and a clock, and reads no other.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import numpy as np

Clock = Callable[[], float]
"""Returns seconds of the receiver's clock."""

RECORDER = "hrcneuro-recorder"
"""The stream in a recording in which the recorder marks gaps and interruptions, stamped with its own clock."""

MOVES = "hrcneuro-moves"
"""The stream of markers of a session, unless it is given another name."""

MARKER_TYPES = frozenset({"marker", "markers", "event", "events", "trigger", "triggers", "stim", "stimulus"})
"""What the type of a stream may be that carries markers, in small letters."""

TRIGGER_TYPES = ("stim", "trigger", "triggers", "marker")
"""What the type of a channel may be that shows triggers, in small letters."""

TRUTH = "hrcneuro-truth"
"""The stream on which a simulated person says what it will do: for the simulated amplifier, and for nobody else."""

N_PORTS = 128
"""So many UDP ports, from 16572 on, are asked where a machine is asked by its address (liblsl by itself: 32).

Each outlet, each look at what is there and each search for a stream that has gone takes one of them: an amplifier, a
recorder, a loop and an experiment on one machine take more than 32. Who gets none of these answers to none who asks by
address, which on a machine without multicast is everybody.
"""

PORTS = f"16571 to {16571 + N_PORTS}, TCP and UDP"
"""The ports through which LSL's streams find and reach each other."""

_REMEMBERED = 20

UNMEASURED_S = 2.5
"""So long what has come waits for the first measurement of the clocks' difference: before it, no stamp tells a time."""

DECISIONS = "hrcneuro-decisions"
"""The stream on which the closed loop tells its decisions and its policy, a text each, JSON."""


@dataclass(frozen=True)
class Description:
    """What a stream says of itself.

    Attributes:
        name, type: As its sender chose them.
        channel_format: ``float32``, ``double64``, ``int8`` … ``int64`` or ``string``.
        sfreq: Nominal sampling rate, Hz; 0 for a stream of irregular times.
        labels, units: One a channel; empty where it does not say.
        n_channels: How many channels.
        source_id: By which a stream is known again after an interruption; may be empty.
        uid: Of this one run of the stream.
        xml: The whole description.
        bare_xml: The same without the name and the addresses of the machine it comes from.
        handle: What the network needs to open it.
    """

    name: str
    type: str
    channel_format: str
    sfreq: float
    n_channels: int
    labels: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    source_id: str = ""
    uid: str = ""
    xml: str = ""
    bare_xml: str = ""
    handle: Any = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Samples:
    """Samples of a stream.

    Attributes:
        stamps: ndarray, shape (n_samples,), seconds of the sender's clock.
        values: ndarray, shape (n_samples, n_channels), of the stream's unit; lists of texts from a stream of texts.
    """

    stamps: np.ndarray
    values: np.ndarray | Sequence[Sequence[str]]

    def __len__(self) -> int:
        return len(self.stamps)


class Lost(Exception):
    """A stream has ended and will not come back by itself; the message says why."""


class Inlet(Protocol):
    """A stream that is received."""

    description: Description

    def pull(self) -> Samples:
        """Return all samples that have come and were not pulled yet; never waits. Raises :class:`Lost`."""

    def offsets(self) -> list[tuple[float, float]]:
        """Return new measurements (when, what to add to the sender's stamps), seconds of the receiver's clock."""

    def reconnected(self) -> bool:
        """Return whether it has been connected to another run of its stream since the last call.

        What is pulled from then on comes from that run, which may have other units; ``description`` is still the old
        run's. Nothing of the new run is pulled before this is true.
        """

    def garbled(self) -> int:
        """Return how many samples could not be understood since the last call: texts that are not in UTF-8."""

    def close(self) -> None:
        """Receive no more; returns at once."""


class Network(Protocol):
    """Where streams are found."""

    def visible(self) -> list[Description]:
        """Return the streams that are there, as far as is known at this moment; never waits."""

    def open(self, description: Description) -> Inlet:
        """Return a stream that is received from now on. Raises :class:`Lost` where it does not answer."""

    def opening(self, description: Description) -> Future[Inlet]:
        """Return what :meth:`open` will; never waits, though to connect may take seconds."""


class Repeats:
    """What was said last on a stream: where two inlets of one run were open for a moment, each has it."""

    def __init__(self) -> None:
        """Begin where nothing was said."""
        self._said: deque[tuple[float, str]] = deque(maxlen=_REMEMBERED)

    def again(self, stamp: float, text: str) -> bool:
        """Return whether a text with this stamp has come before; it has from now on."""
        if (stamp, text) in self._said:
            return True
        self._said.append((stamp, text))
        return False


def connect(future: Future[Inlet], opens: Callable[[], Inlet]) -> Future[Inlet]:
    """Open a stream for who waits for it, and return that; :class:`Lost`, for whatever cause, is theirs to see."""
    try:
        future.set_result(opens())
    except Lost as error:
        future.set_exception(error)
    except Exception as error:
        # Else whoever asks whether it is done would ask for ever.
        future.set_exception(Lost(f"it cannot be received ({type(error).__name__}: {error})"))
    return future


def abandon(future: Future[Inlet]) -> None:
    """Close what a connection that nobody waits for any more may still bring."""
    future.add_done_callback(lambda done: None if done.exception() else done.result().close())
