"""Closed blocks that were played, as arrays beside those of the null model, and what their deadlines came to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from hrcneuro.learning.loop import CASES, STEPS, LoopModel, LoopSessions
from hrcneuro.tables.loop import DIRECTIONS

_SESSION = ["subject", "session"]
STAGES = {
    "received": "last sample received",
    "decided": "decided",
    "sent": "decision sent",
    "taken_up": "taken up",
}
"""What a decision passes after its onset: the column's name, and in words."""


def loop_sessions(steps: pd.DataFrame, episodes: pd.DataFrame) -> LoopSessions:
    """Return what was played, in the form of the null model: sessions in the order in which they appear.

    Args:
        steps, episodes: As ``tables.loop`` declares them, of one session or of several.
    """
    keys = list(dict.fromkeys(episodes[_SESSION].itertuples(index=False, name=None)))
    longest = int(episodes["number"].max()) if len(episodes) else 0
    shape = (len(keys), longest)
    policies, owners = np.full((*shape, 4), np.nan), np.zeros((*shape, 4), bool)
    updates, kinds = np.zeros(shape, int), np.zeros((*shape, len(STEPS)), int)
    decisions = np.zeros((len(keys), len(CASES), 2), int)
    session, number = _index(episodes, keys), episodes["number"].to_numpy(int) - 1
    policies[session, number] = episodes[[f"human_{one}" for one in DIRECTIONS]].to_numpy(float)
    owners[session, number] = episodes[[f"owner_{one}" for one in DIRECTIONS]].to_numpy(object) == "human"
    updates[session, number] = episodes["updates"].to_numpy(int)
    # After its last episode a session learns no more.
    updates = np.maximum.accumulate(updates, axis=1)

    where = [*_SESSION, "block", "episode"]
    placed = steps.merge(episodes[[*where, "number"]], on=where, how="left", validate="many_to_one")
    np.add.at(kinds, (_index(steps, keys), placed["number"].to_numpy(int) - 1, _kinds(steps)), 1)

    taught = steps[steps["update"].eq(True) & steps["expected_case"].notna()]
    case = taught["expected_case"].map({name: k for k, name in enumerate(CASES)}).to_numpy(int)
    takeover = (taught["predicted"] != taught["before"]).to_numpy(int)
    np.add.at(decisions, (_index(taught, keys), case, takeover), 1)
    return LoopSessions(policies, owners, updates, kinds, decisions)


def as_measured(model: LoopModel, steps: pd.DataFrame) -> LoopModel:
    """Return a null model whose decisions teach, and are in time, as often as those of these steps.

    Where nothing was taught, nothing is; where nothing is known of being in time, all are. The null model's person does
    not adapt: measured rates are by the person's own choice, and what adapting does to them is in these already.
    """
    straight = steps[steps["before"].notna() & steps["drawn"].notna()]
    taught = straight[straight["update"].eq(True)]
    known = taught["in_time_for_tr"].dropna()
    teaches = len(taught) / len(straight) if len(straight) else 0.0
    in_time = float(known.astype(bool).mean()) if len(known) else 1.0
    return replace(model, teaches=teaches, in_time=in_time, closed=replace(model.closed, adapts=False))


def latencies(steps: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return the times from onset to each of ``STAGES`` in order, ms, of the decisions that came so far."""
    found = {name: steps[f"onset_to_{name}_ms"].to_numpy(float) for name in STAGES}
    return {name: values[np.isfinite(values)] for name, values in found.items()}


def deadlines(steps: pd.DataFrame) -> dict[str, tuple[int, int]]:
    """Return name -> how many, and of how many: steps after a move that were decided, in time, taken up, that taught.

    ``decided`` of all that follow a move; ``deadline_met`` and ``in_time_for_tr`` of those decided; ``update`` of all.
    """
    after = steps[steps["before"].notna()]
    decided = after[after["score"].notna()]
    return {
        "decided": (len(decided), len(after)),
        "deadline_met": (_true(decided, "deadline_met"), len(decided)),
        "in_time_for_tr": (_true(decided, "in_time_for_tr"), len(decided)),
        "update": (_true(after, "update"), len(after)),
    }


def causes(steps: pd.DataFrame) -> dict[str, int]:
    """Return why decisions taught nothing -> how many, the most frequent first."""
    counts = steps["cause"].dropna().value_counts()
    return {str(name): int(n) for name, n in counts.items()}


def _true(table: pd.DataFrame, name: str) -> int:
    return int(table[name].eq(True).sum())


def _index(table: pd.DataFrame, keys: Sequence[tuple[str, str]]) -> np.ndarray:
    place = {key: k for k, key in enumerate(keys)}
    return np.array([place[key] for key in table[_SESSION].itertuples(index=False, name=None)], int)


def _kinds(steps: pd.DataFrame) -> np.ndarray:
    """Return the number of each step's kind in ``STEPS``."""
    kind = steps["owner"].to_numpy(object).copy()
    kind[steps["taken"].to_numpy(bool)] = "taken"
    kind[steps["left"].to_numpy(bool)] = "left"
    kind[steps["drawn"].isna().to_numpy()] = "diagonal"
    return np.array([STEPS.index(one) for one in kind], int)
