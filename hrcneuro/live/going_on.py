"""A closed loop that goes on where another was broken off: what that had learned is learned again from its log."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcneuro.decoding.frozen import FrozenDecoder
from hrcneuro.errors import DataError
from hrcneuro.learning.online import SUBTASKS, OnlineLearner, Policy
from hrcneuro.live import decisions
from hrcneuro.live.decisions import BLOCK, FILE, GOES_ON, MOVE


@dataclass(frozen=True)
class Before:
    """Where a loop was when it was broken off.

    Attributes:
        policy: What it had learned up to its last block's beginning, by which the robot acts in ``semi``.
        episode: The episode of its last move: practice, block and episode; None before the first move.
    """

    policy: Policy
    episode: tuple[bool, int, int] | None


def newest(parent: Path) -> Path:
    """Return the log of the last closed loop of a subject that heard of a session.

    One that was ended before it heard of a block or a move is passed over: another start was meant.

    Args:
        parent: The folder of the subject's recordings.

    Raises:
        DataError: There is none.
    """
    found = sorted(parent.glob(f"*-online*/{FILE}"), key=lambda path: (path.stat().st_mtime, path), reverse=True)
    for path in found:
        if any(line.get("kind") in (BLOCK, MOVE, GOES_ON) for line in decisions.lines(path)):
            return path
    raise DataError(
        f"there is no closed loop to go on with in {parent}", cure="begin one: the same command without --go-on"
    )


def goes_on(path: Path) -> dict[str, Any]:
    """Return the first line of a log that goes on with another one."""
    return {"kind": GOES_ON, "log": path.parent.name}


def history(path: Path) -> Iterator[Mapping[str, Any]]:
    """Yield the lines of a log behind those of the one that it goes on with, and of all before that.

    Raises:
        DataError: One of them is not there.
    """
    logs = [path]
    while (name := _before(logs[-1])) is not None:
        before = path.parent.parent / name / FILE
        if before in logs or not before.is_file():
            raise DataError(
                f"{logs[-1]} goes on with {before}, which is not there",
                cure="bring it back to its place, or begin anew, without --go-on",
            )
        logs.append(before)
    for one in reversed(logs):
        yield from decisions.lines(one)


def _before(path: Path) -> str | None:
    first = next(decisions.lines(path), {})
    return str(first["log"]) if first.get("kind") == GOES_ON else None


def relearned(
    lines: Iterable[Mapping[str, Any]], learner: OnlineLearner, decoder: FrozenDecoder, *, afresh: bool
) -> Before:
    """Teach a fresh learner what another one had been taught; return where that was.

    Args:
        lines: Of the other one's log, as :func:`history` yields them.
        learner: Fresh, and of the same kind.
        decoder: The same one.
        afresh: It forgets all at a block's beginning.

    Raises:
        DataError: It comes out with other values than the log has: learner or decoder are others.
    """
    policy = learner.policy()
    episode: tuple[bool, int, int] | None = None
    last: Mapping[str, Any] | None = None
    for line in lines:
        if line.get("kind") == BLOCK:
            if afresh:
                learner.afresh()
                episode, last = None, None
            policy = learner.policy()
        elif line.get("kind") == MOVE:
            here = line["practice"], line["block"], line["episode"]
            if episode not in (None, here):
                learner.end_episode()
            episode, last = here, line
            if line["update"]:
                odds = decoder.problems[line["problem"]].log_odds(line["score"])
                learner.update(line["next"], before=line["actor"], takeover=line["takeover"], log_odds=odds)
    if last is not None and not _alike(learner, last["q_after"]):
        raise DataError(
            "what was learned does not follow from the log: it was written with another decoder or learner",
            cure="go on with the decoder and the [online] settings of that log, or begin anew, without --go-on",
        )
    return Before(policy, episode)


def _alike(learner: OnlineLearner, values: Mapping[str, Any]) -> bool:
    mine = learner.values()
    return all(
        math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-12)
        for step in SUBTASKS
        for one, other in zip(mine[step], values[step], strict=True)
    )
