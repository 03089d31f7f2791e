"""A closed loop that goes on where another was broken off: what that had learned is learned again from its log."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from hrcneuro.decoding.frozen import FrozenDecoder
from hrcneuro.errors import DataError
from hrcneuro.learning.online import SUBTASKS, OnlineLearner, Policy
from hrcneuro.live.decisions import BLOCK, FILE, MOVE


def newest(parent: Path) -> Path:
    """Return the log of a subject's last closed loop; ``parent`` is the folder of the subject's recordings.

    Raises:
        DataError: There is none.
    """
    found = sorted(parent.glob(f"*-online*/{FILE}"), key=lambda path: (path.stat().st_mtime, path))
    if not found:
        raise DataError(
            f"there is no closed loop to go on with in {parent}", cure="begin one: the same command without --go-on"
        )
    return found[-1]


def relearned(
    lines: Iterable[Mapping[str, Any]], learner: OnlineLearner, decoder: FrozenDecoder, *, afresh: bool
) -> Policy | None:
    """Teach a fresh learner what another one had been taught; return the policy of the last block's beginning.

    Args:
        lines: Of the other one's log.
        learner: Fresh, and of the same kind.
        decoder: The same one.
        afresh: It forgets all at a block's beginning.

    Raises:
        DataError: It comes out with other values than the log has: learner or decoder are others.
    """
    begun: Policy | None = None
    episode: tuple[Any, ...] | None = None
    last: Mapping[str, Any] | None = None
    for line in lines:
        if line.get("kind") == BLOCK:
            begun = line.get("policy") or begun
            if afresh:
                learner.afresh()
                episode, last = None, None
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
    return begun


def _alike(learner: OnlineLearner, values: Mapping[str, Any]) -> bool:
    mine = learner.values()
    return all(
        math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-12)
        for step in SUBTASKS
        for one, other in zip(mine[step], values[step], strict=True)
    )
