"""What the closed loop says of each move: a line in its log, and a text on its stream."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.errors import StageError
from hrcneuro.learning.online import SUBTASKS, Policy, Values
from hrcneuro.live.parameters import OnlineOptions
from hrcneuro.live.transport import Description

FILE = "decisions.jsonl"
BEGIN, BREAK, BLOCK, MOVE, STRANGE, GOES_ON = "begin", "break", "block", "move", "marker", "goes on"
"""Kinds of lines."""
CAUSES = {
    "gap": "samples are missing in the epoch, or no sample was taken at its zero",
    "missing": "its last sample did not come",
    "gone": "its marker or its samples came so late that they were no longer kept",
    "not finite": "a sample is no number",
    "clock": "how far the two clocks differ was not known: not measured yet, or not since one of them was set",
    "artefact": "it deviates by more than the decoder accepts (calibrate.reject_uv)",
    "railed": "a channel reached the end of its range (record.rail_uv)",
    "late": "it was decided after the deadline (online.deadline_s)",
    "practice": "practice teaches nothing",
    "scenario": "a scenario that does not teach (online.scenarios)",
    "untagged": "the marker does not say who moves, or what comes next",
    "no problem": "the decoder has no problem, or several, for this actor",
    "last": "the path is done: no next step",
    "diagonal": "the next tile lies off the straight directions",
}
"""Why a move teaches nothing, and what each word means."""


@dataclass
class Trial:
    """A move at whose onset it was to be decided who acts next; times in seconds of the receiver's clock.

    Attributes:
        marker: Text of the move's marker.
        marker_stamp: As it came, seconds of its sender's clock.
        marker_s: The same moment on the receiver's clock.
        block, episode, trial, practice, scenario: Which move it is.
        actor, next: Who makes it, and the direction of the next step, empty at a path's end; empty and None where the
            marker does not say.
        zero_from: ``trigger``, ``marker``, ``log`` (of a replay), or empty where there is none.
        zero_stamp: Stamp of the epoch's first sample, seconds of the EEG sender's clock.
        zero_shift_ms: How much later than the marker says the zero is.
        last_stamp: Stamp of the last sample that the decision needs.
        pulled_s, decided_s, sent_s: When that sample was received, when it was decided, when that was sent.
        problem, score, probability, takeover, predicted, peak_uv: What was decided; ``predicted`` is who is expected
            to act next.
        update: Whether the learner took it.
        cause: Why not; one of ``CAUSES``, or empty.
        deadline_met: Whether it was decided in time.
        q_before, q_after, policy_before, policy_after: What the learner held of each subtask.
        stages_ms: How long each step took.
    """

    marker: str
    marker_stamp: float
    marker_s: float
    block: int
    episode: int
    trial: int
    practice: bool
    scenario: str
    actor: str = ""
    next: str | None = None
    zero_from: str = ""
    zero_stamp: float | None = None
    zero_shift_ms: float | None = None
    last_stamp: float | None = None
    pulled_s: float | None = None
    decided_s: float | None = None
    sent_s: float | None = None
    problem: str = ""
    score: float | None = None
    probability: float | None = None
    takeover: bool | None = None
    predicted: str = ""
    peak_uv: float | None = None
    update: bool = False
    cause: str = ""
    deadline_met: bool = False
    q_before: Values = field(default_factory=dict)
    q_after: Values = field(default_factory=dict)
    policy_before: Policy = field(default_factory=dict)
    policy_after: Policy = field(default_factory=dict)
    stages_ms: dict[str, float] = field(default_factory=dict)

    @property
    def line(self) -> dict[str, Any]:
        """The line of the log."""
        return {"kind": MOVE, **asdict(self)}


def begin_line(subject: str, stamp: float, stream: Description, options: OnlineOptions) -> dict[str, Any]:
    """Return the line of the log with which a stream's first sample is told.

    Args:
        subject: Whose session.
        stamp: Of that sample, seconds of its sender's clock.
        stream: The EEG.
        options: Of the loop.
    """
    return {
        "kind": BEGIN,
        "subject": subject,
        "stamp": stamp,
        "stream": stream.name,
        "sfreq": stream.sfreq,
        "mode": options.mode,
        "learner": options.learner,
    }


def trial_of(tags: Mapping[str, Any], text: str, stamp: float, when: float) -> Trial:
    """Return a move that is still to be decided, from its marker.

    Args:
        tags: As :func:`hrcneuro.paradigm.markers.move_in` returns them.
        text, stamp: The marker, and its stamp, seconds of its sender's clock.
        when: The same moment on the receiver's clock.
    """
    return Trial(
        marker=text,
        marker_stamp=stamp,
        marker_s=when,
        block=int(tags["block"]),
        episode=int(tags["episode"]),
        trial=int(tags["trial"]),
        practice=bool(tags["practice"]),
        scenario=str(tags["scenario"]),
        actor=str(tags.get("actor", "")),
        next=str(tags["next"]) if "next" in tags else None,
    )


def message(mode: str, policy: Policy | None, sent_s: float, trial: Trial | None = None) -> str:
    """Return a text for the stream: the policy in force, and the decision that led to it, where one did.

    Args:
        mode: ``shadow``, ``semi`` or ``closed``.
        policy: Subtask -> probability that the robot leaves it to the human; None in ``shadow``: nothing to take up.
        sent_s: When it is sent, seconds of the receiver's clock.
        trial: The move.
    """
    about: dict[str, Any] = {"mode": mode, "policy": policy, "sent_s": sent_s}
    if trial is not None:
        names = ("marker", "next", "score", "probability", "predicted", "update", "cause", "deadline_met")
        about |= {name: getattr(trial, name) for name in names}
    return json.dumps(about)


def policy_in(text: str) -> Policy | None:
    """Return the policy that a text of the stream lets the robot take up; None for none, or one that is not sound.

    Sound is a probability for each of the four directions, and nothing else.
    """
    try:
        policy = json.loads(text)["policy"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    if not isinstance(policy, dict) or set(policy) != set(SUBTASKS):
        return None
    sound = all(isinstance(p, int | float) and not isinstance(p, bool) and 0 <= p <= 1 for p in policy.values())
    return {name: float(policy[name]) for name in SUBTASKS} if sound else None


class DecisionLog:
    """The file ``decisions.jsonl``: a line is in the system's hands before the next move begins."""

    def __init__(self, folder: Path) -> None:
        """Begin a new file in a folder.

        Raises:
            OSError: It exists, or cannot be written.
        """
        self.path = folder / FILE
        # Without a buffer: what a full disk did not take would be tried, and fail, once more as the file is closed.
        self._file = self.path.open("xb", buffering=0)

    def __call__(self, line: Mapping[str, Any]) -> None:
        """Write a line.

        Raises:
            StageError: The disk takes no more.
        """
        left = (json.dumps(line, ensure_ascii=False, allow_nan=False) + "\n").encode()
        with self._told():
            while left:
                left = left[self._file.write(left) :]

    def close(self) -> None:
        """Bring all to the disk and close the file.

        Raises:
            StageError: The disk does not take it.
        """
        with self._file, self._told():
            os.fsync(self._file.fileno())

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise StageError(
                f"{self.path} takes no more: {error.strerror or error}",
                cure="free space on its disk, then begin again with --go-on: what was decided before stands there",
            ) from error


def lines(path: Path) -> Iterator[dict[str, Any]]:
    """Yield the lines of a log; one that a crash has cut in two is left out.

    Raises:
        OSError: It cannot be read.
    """
    with path.open(encoding="utf-8", errors="replace") as file:
        for text in file:
            try:
                line = json.loads(text)
            except ValueError:
                continue
            if isinstance(line, dict):
                yield line


@dataclass
class Known:
    """What the log of a live session tells a replay of its recording.

    Attributes:
        zeros: (marker's text, its stamp) -> stamp of the epoch's first sample.
        late: Those that were decided too late, or not at all, and taught nothing for that.
        scores: The same -> the score; None where none was decided.
        states: Where the filter began, and began anew: (stamp of that sample, None); and between, (stamp of a sample,
            what it kept after it), see :class:`hrcneuro.eeg.causal.CausalChain`. In the log's order.
    """

    zeros: dict[tuple[str, float], float] = field(default_factory=dict)
    late: dict[tuple[str, float], str] = field(default_factory=dict)
    scores: dict[tuple[str, float], float | None] = field(default_factory=dict)
    states: list[tuple[float, np.ndarray | None]] = field(default_factory=list)

    @property
    def starts(self) -> list[float]:
        """Stamps of the first samples of stretches."""
        return [stamp for stamp, memory in self.states if memory is None]

    def state(self, first: float) -> tuple[float, np.ndarray | None]:
        """Return the first state that a recording holds; minus infinity and None where it holds none.

        Args:
            first: Stamp of the recording's first sample.
        """
        return next((one for one in self.states if one[0] >= first), (-math.inf, None))


def known(*paths: Path) -> Known:
    """Return what the logs of a session tell, in their order: several where its loop was begun again.

    Raises:
        OSError: One cannot be read.
    """
    found = Known()
    for line in chain.from_iterable(map(lines, paths)):
        if line.get("kind") in (BEGIN, BREAK) and _is_time(line.get("stamp")):
            found.states.append((float(line["stamp"]), None))
        elif line.get("kind") == BLOCK and isinstance(kept := line.get("filter"), dict):
            found.states.append((float(kept["stamp"]), np.asarray(kept["memory"], float)))
        elif line.get("kind") == MOVE and _is_time(line.get("marker_stamp")):
            key = str(line.get("marker")), float(line["marker_stamp"])
            found.scores[key] = line.get("score")
            if _is_time(line.get("zero_stamp")):
                found.zeros[key] = float(line["zero_stamp"])
            if line.get("cause") in ("late", "missing", "gone", "clock"):
                found.late[key] = str(line["cause"])
    return found


def _is_time(value: Any) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)
