"""What the closed loop of a subject says, as whoever drives the robot hears it: the policy, and whether it is there."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

from hrcneuro.errors import HardwareError
from hrcneuro.learning.online import SUBTASKS, Policy
from hrcneuro.live.decisions import policy_in
from hrcneuro.live.text_stream import TextStream
from hrcneuro.live.transport import DECISIONS, Clock, Description, Lost, Network

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
        self._stream = TextStream(network, timed=False)
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
        while not self._stream.uid:
            there = running(self._network, self._subject)
            if len(there) > 1:
                raise HardwareError(
                    f"{len(there)} closed loops of {self._subject} are running; one is needed",
                    cure=f"end all but one 'hrcneuro online {self._subject}'",
                )
            self._connect(there)
            if not (self._stream.uid or self._stream.connecting) and self._clock() >= end:
                raise HardwareError(
                    f"no closed loop of {self._subject} is there: nothing was heard of the stream {DECISIONS!r} for "
                    f"{patience_s:g} s",
                    cure=f"start it first, in another terminal: hrcneuro online {self._subject} --mode closed",
                )
            if not self._stream.uid:
                wait(_LOOK_AGAIN_S)

    def look(self) -> str:
        """Return what is wrong with the loop, or an empty text; one that was started anew is heard from now on.

        Of several none is heard: nobody knows which one the experimenter means.
        """
        there, now = running(self._network, self._subject), self._clock()
        if any(one.uid == self._stream.uid for one in there):
            self._seen = now
        elif now - self._seen >= _GONE_S:
            # One look may miss a stream that is there.
            self._stream.leave()
        if not self._stream.uid:
            self._connect(there)
        if self._stream.uid or self._stream.connecting_for(now) < _GONE_S:
            return ""
        return (
            f"{len(there)} closed loops are running: end all but one" if len(there) > 1 else "the closed loop is gone"
        )

    def pull(self) -> None:
        """Take up what was said."""
        try:
            texts = self._stream.texts(self._clock())
        except Lost:
            return
        for _, text, _ in texts:
            self._take(text)

    def close(self) -> None:
        """Hear no more."""
        self._stream.close()

    def _connect(self, there: list[Description]) -> None:
        """Begin to connect to the only one, or take up what has come of that; never waits."""
        now = self._clock()
        if [one.uid for one in there] != [self._stream.connecting]:
            self._stream.abandon()
        if len(there) != 1:
            return
        self._stream.connect(there[0], now)
        if self._stream.connected(now):
            self._seen = now

    def _take(self, text: str) -> None:
        try:
            said = json.loads(text)
            mode, marker, sent = said["mode"], said.get("marker", ""), float(said["sent_s"])
            marker.encode()
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            self._refuse("it is no message of the loop's", text)
            return
        policy = policy_in(text)
        if mode not in ("shadow", "semi", "closed"):
            self._refuse("its mode is none of shadow, semi and closed", text)
        elif (policy is None) != (mode == "shadow"):
            self._refuse("its policy is no probability for each of the four directions", text)
        else:
            self.policy, self.mode = policy, mode
            self.decided = marker or self.decided
            about = {"marker": marker, "mode": mode, "sent_s": sent, "taken_up_s": self._clock(), "policy": policy}
            self.note("policy", about)

    def _refuse(self, why: str, text: str) -> None:
        self.refused[why] += 1
        if self.refused[why] <= _MOST_TOLD:
            self.note("policy refused", {"why": why, "text": text[:300]})
