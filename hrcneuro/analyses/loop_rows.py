"""The tables of closed blocks, from the two logs that a session leaves: what was done, and what was decided."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import pandas as pd

from hrcneuro.learning.online import SUBTASKS
from hrcneuro.paradigm.markers import move_in
from hrcneuro.tables.loop import LOOP_EPISODES, LOOP_STEPS

Line = Mapping[str, Any]
_Step = tuple[int, int, int]  # block, episode, trial
_NOTHING: Line = {}


def loop_tables(
    experiment: Iterable[Line], decisions: Iterable[Line], *, subject: str, session: str
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the steps and the episodes of a session's closed blocks, as ``tables.loop`` declares them.

    A step that was begun again after a break counts as it was the last time; one that was never made does not count.

    Args:
        experiment: Lines of its ``experiment.jsonl``, in order; those that tell of nothing here may be among them.
        decisions: Lines of the closed loop's ``decisions.jsonl``, in order; of several logs one after the other.
        subject, session: Whose, and by which name the session is known.

    Raises:
        KeyError: A line lacks what its kind always has.
    """
    done = _Done(experiment)
    decided = _Decided(decisions)
    named = {"subject": subject, "session": session}
    steps = [
        named | _step(done, decided, place, line) for place, line in sorted(done.choices.items()) if place in done.moves
    ]
    episodes = [named | one for one in _episodes(done, decided)]
    return (
        pd.DataFrame(steps, columns=list(LOOP_STEPS.columns)),
        pd.DataFrame(episodes, columns=list(LOOP_EPISODES.columns)),
    )


class _Done:
    """What an experiment's log tells of closed blocks.

    Attributes:
        choices: Step -> its line.
        moves: Step -> the line of its move; absent where it was broken off.
        taken_up: Step -> when the decision at its onset was taken up, seconds of the session.
        owners: Block -> the person's directions.
    """

    def __init__(self, lines: Iterable[Line]) -> None:
        self.choices: dict[_Step, Line] = {}
        self.moves: dict[_Step, Line] = {}
        self.taken_up: dict[_Step, float] = {}
        self.owners: dict[int, frozenset[str]] = {}
        for line in lines:
            kind = line.get("kind")
            if kind == "choice":
                self.choices[_place(line)] = line
            elif kind == "move" and not line["practice"]:
                self.moves[_place(line)] = line
            elif kind == "block" and not line["practice"]:
                self.owners[int(line["block"])] = frozenset(line["human_directions"])
            elif kind == "policy" and (tags := move_in(str(line["marker"]))) is not None:
                self.taken_up[_place(tags)] = float(line["s"])


class _Decided:
    """What a closed loop's log tells.

    Attributes:
        moves: Step -> the line of the decision at its onset.
        known: What was learned when an episode ended: (block, episode) -> updates so far, and the policy.
    """

    def __init__(self, lines: Iterable[Line]) -> None:
        self.moves: dict[_Step, Line] = {}
        self.known: dict[tuple[int, int], tuple[int, Line]] = {}
        updates = 0
        for line in lines:
            if line.get("kind") != "move" or line["practice"]:
                continue
            updates += bool(line["update"])
            place = _place(line)
            self.moves[place] = line
            self.known[place[:2]] = updates, line["policy_after"]


def _step(done: _Done, decided: _Decided, place: _Step, line: Line) -> dict[str, Any]:
    block, episode, trial = place
    before = (block, episode, trial - 1)
    acted = str(done.choices[before]["actor"]) if before in done.choices else None
    owner, drawn = str(line["owner"]), str(line["drawn"])
    straight = line["step"] in SUBTASKS
    row = {name: line[name] for name in ("block", "episode", "trial", "step", "owner", "actor", "human")}
    row |= {"drawn": drawn or None, "before": acted, "in_time_for_tr": line["in_time"]}
    row |= {"taken": drawn == "robot" and owner == "human", "left": drawn == "human" and owner == "robot"}
    row["expected_case"] = _letter(acted) + _letter(owner) if acted and straight else None
    return row | _decision(decided.moves.get(before, _NOTHING), done, before)


def _decision(line: Line, done: _Done, place: _Step) -> dict[str, Any]:
    """Return what is told of the decision at the onset of a move; nothing where none is told of."""
    if not line:
        return {}
    told = {name: line[name] for name in ("score", "probability", "update", "deadline_met")}
    told |= {name: line[name] or None for name in ("predicted", "cause")}
    for name in ("pulled", "decided", "sent"):
        when = line[f"{name}_s"]
        there = when is not None and (line["score"] is not None or name == "sent")
        stage = "received" if name == "pulled" else name
        told[f"onset_to_{stage}_ms"] = 1e3 * (when - line["marker_s"]) if there else None
    if place in done.taken_up and place in done.moves:
        told["onset_to_taken_up_ms"] = 1e3 * (done.taken_up[place] - done.moves[place]["onset_s"])
    return told


def _episodes(done: _Done, decided: _Decided) -> Iterator[dict[str, Any]]:
    known: tuple[int, Line] = 0, dict.fromkeys(SUBTASKS, 0.5)
    arrived = {place[:2] for place, move in done.moves.items() if move["last"]}
    for number, (block, episode) in enumerate(sorted({place[:2] for place in done.choices}), start=1):
        known = decided.known.get((block, episode), known)
        updates, policy = known
        row = {"block": block, "episode": episode, "number": number, "updates": updates}
        row["arrived"] = (block, episode) in arrived
        row |= {f"human_{one}": policy[one] for one in SUBTASKS}
        yield row | {f"owner_{one}": "human" if one in done.owners[block] else "robot" for one in SUBTASKS}


def _place(line: Line) -> _Step:
    return int(line["block"]), int(line["episode"]), int(line["trial"])


def _letter(who: str | None) -> str:
    return {"human": "H", "robot": "R"}[str(who)]
