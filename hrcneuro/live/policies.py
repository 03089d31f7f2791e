"""What the closed loop of a subject says, as whoever drives the robot hears it: the policy, and whether it is there."""

from __future__ import annotations

import contextlib
import json
import re
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from hrcneuro.errors import HardwareError
from hrcneuro.learning.online import SUBTASKS, Policy
from hrcneuro.live.decisions import policy_in
from hrcneuro.live.transport import DECISIONS, Clock, Description, Inlet, Lost, Network, abandon

_LOOK_AGAIN_S, _GONE_S = 0.2, 3.0
_MOST_TOLD = 20

Note = Callable[[str, Mapping[str, Any]], None]
"""Writes down what was taken up, or was not: what happened, and what is worth knowing of it."""


def source_of(subject: str, number: int) -> str:
    """Return by what a subject's loop is known; ``number`` is that of its process."""
    return f"hrcneuro-online-{subject}-{number}"


def running(network: Network, subject: str) -> list[Description]:
    """Return the streams of the closed loops of a subject that are there."""
    ours = re.compile(re.escape(source_of(subject, 0)[:-1]) + r"\d+")
    return [one for one in network.visible() if one.name == DECISIONS and ours.fullmatch(one.source_id)]


@dataclass(frozen=True)
class _Opening:
    """A connection that comes about: to which run, since when (s), and what it brings."""

    uid: str
    since: float
    inlet: Future[Inlet]


class Policies:
    """The policy of a running loop.

    Attributes:
        policy: Direction -> probability that the robot leaves it to the person: 1/2 each until something was said; None
            in ``shadow``, where the robot is not to act by it.
        mode: ``shadow``, ``semi`` or ``closed``; empty until something was said.
        decided: The text of the marker of the last move whose decision has come.
        refused: Why a text was not taken up -> how often.
    """

    def __init__(self, network: Network, clock: Clock, subject: str) -> None:
        """Hear nothing yet; ``clock`` is the receiver's."""
        self._network, self._clock, self._subject = network, clock, subject
        self._inlet: Inlet | None = None
        self._opening: _Opening | None = None
        self._seen = float("-inf")  # when it was there, seconds of the clock
        self.policy: Policy | None = dict.fromkeys(SUBTASKS, 0.5)
        self.mode = self.decided = ""
        self.refused: Counter[str] = Counter()
        self.note: Note = lambda kind, about: None

    def find(self, wait: Callable[[float], None], *, patience_s: float) -> None:
        """Wait until the loop is there.

        Raises:
            HardwareError: It is not there in time, or there are several.
        """
        end = self._clock() + patience_s
        while self._inlet is None:
            there = running(self._network, self._subject)
            if len(there) > 1:
                raise HardwareError(
                    f"{len(there)} closed loops of {self._subject} are running; one is needed",
                    cure=f"end all but one 'hrcneuro online {self._subject}'",
                )
            self._open(there)
            if self._inlet is None and self._opening is None and self._clock() >= end:
                raise HardwareError(
                    f"no closed loop of {self._subject} is there: nothing was heard of the stream {DECISIONS!r} for "
                    f"{patience_s:g} s",
                    cure=f"start it first, in another terminal: hrcneuro online {self._subject} --mode closed",
                )
            if self._inlet is None:
                wait(_LOOK_AGAIN_S)

    def look(self) -> str:
        """Return what is wrong with the loop, or an empty text; one that was started anew is heard from now on.

        Of several none is heard: nobody knows which one the experimenter means.
        """
        there, now = running(self._network, self._subject), self._clock()
        if self._inlet is not None:
            if any(one.uid == self._inlet.description.uid for one in there):
                self._seen = now
            elif now - self._seen >= _GONE_S:
                # One look may miss a stream that is there.
                self.close()
        if self._inlet is None:
            self._open(there)
        connecting = self._opening is not None and now - self._opening.since < _GONE_S
        if self._inlet is not None or connecting:
            return ""
        return (
            f"{len(there)} closed loops are running: end all but one" if len(there) > 1 else "the closed loop is gone"
        )

    def pull(self) -> None:
        """Take up what was said."""
        if self._inlet is None:
            return
        try:
            samples = self._inlet.pull()
        except Lost:
            self.close()
            return
        for row in samples.values:
            self._take(str(row[0]))

    def close(self) -> None:
        """Hear no more."""
        if self._opening is not None:
            abandon(self._opening.inlet)
            self._opening = None
        if self._inlet is not None:
            self._inlet.close()
            self._inlet = None

    def _open(self, there: list[Description]) -> None:
        """Begin to connect to the only one, or take up what has come of that; never waits."""
        if self._opening is not None and [one.uid for one in there] != [self._opening.uid]:
            abandon(self._opening.inlet)
            self._opening = None
        if len(there) != 1:
            return
        if self._opening is None:
            self._opening = _Opening(there[0].uid, self._clock(), self._network.opening(there[0]))
        if not self._opening.inlet.done():
            return
        opening, self._opening = self._opening, None
        with contextlib.suppress(Lost):
            self._inlet, self._seen = opening.inlet.result(), self._clock()

    def _take(self, text: str) -> None:
        try:
            said = json.loads(text)
            mode, marker, sent = said["mode"], said.get("marker", ""), said["sent_s"]
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            self._refuse("it is no message of the loop's", text)
            return
        policy = policy_in(text)
        if mode not in ("shadow", "semi", "closed"):
            self._refuse(f"mode {mode!r}", text)
        elif (policy is None) != (mode == "shadow"):
            self._refuse("its policy is no probability for each of the four directions", text)
        else:
            self.policy, self.mode = policy, mode
            self.decided = str(marker) or self.decided
            about = {"marker": str(marker), "mode": mode, "sent_s": sent, "taken_up_s": self._clock(), "policy": policy}
            self.note("policy", about)

    def _refuse(self, why: str, text: str) -> None:
        self.refused[why] += 1
        if self.refused[why] <= _MOST_TOLD:
            self.note("policy refused", {"why": why, "text": text[:300]})
