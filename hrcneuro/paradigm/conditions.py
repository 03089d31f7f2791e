"""The takeover case and conditions of every move (paper §2.5, Table 1): the one place for logs and simulations alike.

A pair is two successive moves of one episode, tr−1 and tr; its case names their actors: HR is a human's move followed
by the robot's. A pair counts only in a main block and only if tr−1 is no error; tr may be one.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from hrcneuro.paradigm.design import CASES

EPISODE = ("practice", "block", "episode")
"""Columns that name an episode of one subject."""


def annotate(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the moves with the columns case, condition_before, condition_after, prev_error, turn and soa_s.

    ``case`` is this move's actor after the previous move's, None on an episode's first. ``condition_before`` is the
    case of the counting pair in which this move is tr−1, ``condition_after`` of the one in which it is tr, None where
    there is no such pair. ``prev_error`` and ``turn`` are false where the previous or the next move is missing.
    ``soa_s`` is the time to the next onset, NaN on an episode's last move and where the moves have no ``onset_s``.

    Args:
        trials: One row a move in order, with practice, block, episode, actor, target and error, and with a column
            ``subject`` if there are several.
    """
    episode = _episode_numbers(trials)
    follows = np.roll(episode, 1) == episode
    follows[:1] = False
    leads = np.roll(follows, -1)

    letter = trials["actor"].map({"human": "H", "robot": "R"}).to_numpy(dtype=object)
    target = trials["target"].to_numpy(dtype=object)
    previous_error = follows & np.roll(trials["error"].to_numpy(dtype=bool), 1)
    counts = follows & ~previous_error & ~trials["practice"].to_numpy(dtype=bool)
    case = np.roll(letter, 1) + letter
    onset = trials["onset_s"].to_numpy(dtype=float) if "onset_s" in trials else np.full(len(trials), np.nan)

    out = trials.copy()
    out["case"] = _strings(case, follows, out)
    out["condition_before"] = _strings(np.roll(case, -1), np.roll(counts, -1), out)
    out["condition_after"] = _strings(case, counts, out)
    out["prev_error"] = previous_error
    out["turn"] = leads & (np.roll(target, -1) != target)
    out["soa_s"] = np.where(leads, np.roll(onset, -1) - onset, np.nan)
    return out


def count_pairs(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the number of pairs, one row a scenario (iC, sC), one column a case, zeros where none counts."""
    counts = pd.crosstab(trials["scenario"].to_numpy(), trials["condition_before"].to_numpy(dtype=object))
    return counts.reindex(index=["iC", "sC"], columns=list(CASES), fill_value=0)


def no_previous_error(trials: pd.DataFrame) -> pd.Series:
    """Return which moves follow no error: in iC a human takeover often does, so labels leak (docs/confound.md)."""
    return ~trials["prev_error"].astype(bool)


def matched(trials: pd.DataFrame) -> pd.Series:
    """Return which moves precede a turn and follow no error: the two known ways to guess a takeover without EEG."""
    return no_previous_error(trials) & trials["turn"].astype(bool)


def _episode_numbers(trials: pd.DataFrame) -> np.ndarray:
    keys = [name for name in ("subject", *EPISODE) if name in trials]
    return trials.groupby(keys, sort=False, dropna=False, observed=True).ngroup().to_numpy()


def _strings(values: np.ndarray, where: np.ndarray, like: pd.DataFrame) -> pd.Series:
    # The object type keeps None where pandas' string type would turn it into NaN.
    strings = np.full(len(like), None, dtype=object)
    strings[where] = values[where]
    return pd.Series(strings, index=like.index, dtype=object)
