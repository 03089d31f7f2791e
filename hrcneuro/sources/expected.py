"""Which markers a log lets one expect: of which of its moves, and how many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hrcneuro.sources.experiments import Onset

_KEYS = ["practice", "block", "episode", "trial"]
_NO_PRACTICE = "the practice blocks have no markers"
_NO_STAYS = "moves that the grid's edge stopped have no markers"


@dataclass(frozen=True)
class Expected:
    """The markers of a recording, in order.

    Attributes:
        rows: ndarray, shape (n_markers,): of which row of the log each is, by its place; -1 for none.
        what: What has a marker each, in words.
        notes: What a person may want to know of it.
    """

    rows: np.ndarray
    what: str = "rows in the log"
    notes: tuple[str, ...] = ()


def expected_markers(trials: pd.DataFrame, begun: Sequence[Onset] = ()) -> list[dict[int, Expected]]:
    """Return number of markers -> which they would be; the likelier kinds first, each with practice and without.

    A marker for each motion that is known to have begun; else for each row.

    Args:
        trials: The log's rows, with practice, block, episode and trial.
        begun: Whose motion has begun, in order, where that is known.
    """
    main, rows = ~trials["practice"].to_numpy(bool), np.arange(len(trials))
    kinds = [_with_and_without_practice(rows, main, "rows in the log")]
    return [_by_motion(trials, begun), *kinds] if begun else kinds


def _by_motion(trials: pd.DataFrame, begun: Sequence[Onset]) -> dict[int, Expected]:
    numbers = {key: n for n, key in enumerate(trials[_KEYS].itertuples(index=False, name=None))}
    # A move that was made again is that of its last onset; one that never ended has no row.
    last = {key: place for place, key in enumerate(begun)}
    rows = np.array([numbers.get(key, -1) if last[key] == place else -1 for place, key in enumerate(begun)], int)
    main = np.array([not practice for practice, *_ in begun])
    lost = int((rows < 0).sum())
    ended = [f"{lost} of the motions that began did not come to their end"] if lost else []
    return _with_and_without_practice(rows, main, "motions that began", _NO_STAYS, *ended)


def _with_and_without_practice(rows: np.ndarray, main: np.ndarray, what: str, *notes: str) -> dict[int, Expected]:
    without = Expected(rows[main], what, (*notes, _NO_PRACTICE))
    return {len(without.rows): without} | {len(rows): Expected(rows, what, notes)}
