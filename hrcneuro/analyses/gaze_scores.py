"""Session logs of a closed loop as rows: how good the online decoder was, and whether the learner comes out again."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.learning.gaze import TAIL, GazeSession, rates, replay
from hrcneuro.learning.gaze_counts import TrialCounts, is_path, looks, trial_counts
from hrcneuro.learning.gaze_partner import Reading

EDGES = (0.60, 0.75, 0.85)
BINS = ("< 0.60", "0.60-0.75", "0.75-0.85", ">= 0.85")
EARLY = 25  # trials, of which an accuracy is told that shares none with the last ten
UNSOLVED = -1  # stands for the number of transitions where none explain the policy
LEAST_PEOPLE = 5  # of fewer, drawing them again and again tells nothing of people
_DRAWS = 4000


class People:
    """Resamples people, and all sessions of theirs with them; of fewer than ``LEAST_PEOPLE`` no interval is known.

    Args:
        people: Whose each session is.
        seed: Of the draws.
    """

    def __init__(self, people: Sequence[str], seed: int) -> None:
        names, self._whose = np.unique(np.array(people), return_inverse=True)
        rng = np.random.default_rng([seed, *b"people"])
        self._times = rng.multinomial(len(names), np.full(len(names), 1 / len(names)), size=_DRAWS)

    def interval(self, statistic: Callable[[np.ndarray], np.ndarray]) -> tuple[float, float]:
        """Return the 95 % interval of a statistic; nan, nan of too few people.

        Args:
            statistic: Takes how often each session counts, ndarray, shape (n_draws, n_sessions); returns (n_draws,).
        """
        if self._times.shape[1] < LEAST_PEOPLE:
            return float("nan"), float("nan")
        with np.errstate(invalid="ignore", divide="ignore"):
            drawn = statistic(self._times[:, self._whose].astype(float))
        kept = drawn[np.isfinite(drawn)]
        if not len(kept):
            return float("nan"), float("nan")
        low, high = np.percentile(kept, [2.5, 97.5])
        return float(low), float(high)

    def count(self, of: np.ndarray) -> int:
        """Return how many people have a session of those that count, bool."""
        return len(set(self._whose[of].tolist()))

    def mean(self, values: np.ndarray, of: np.ndarray | None = None) -> tuple[float, float]:
        """Return the interval of the mean of sessions' values; ``of``: which sessions count, bool."""
        if of is not None and self.count(of) < LEAST_PEOPLE:
            return float("nan"), float("nan")
        mask = np.ones(len(values)) if of is None else of.astype(float)
        return self.interval(lambda times: (times * mask) @ values / (times @ mask))


def scored(sessions: Sequence[GazeSession]) -> list[GazeSession]:
    """Return the sessions in which guesses were logged."""
    return [one for one in sessions if one.right is not None]


def session_rows(sessions: Sequence[GazeSession]) -> pd.DataFrame:
    """Return the rows of ``sessions.parquet`` without what was foretold."""
    rows = []
    for one in scored(sessions):
        right = _right(one)
        whole, early = rates(right, one.error), rates(right[:EARLY], one.error[:EARLY], prior=0.5)
        rows.append(
            {
                "subject": one.subject,
                "run": one.run,
                "trials": len(right),
                **_rates(whole, right),
                "first_right": float(right[:TAIL].mean()),
                "last_right": float(right[-TAIL:].mean()),
                "early_balanced": early.balanced,
                "bin": BINS[int(np.searchsorted(EDGES, whole.balanced, side="right"))],
            }
        )
    return pd.DataFrame(rows)


def subject_rows(sessions: Sequence[GazeSession]) -> pd.DataFrame:
    """Return the rows of ``subjects.parquet``: the trials of a subject's sessions are pooled."""
    rows = []
    for subject in sorted({one.subject for one in scored(sessions)}):
        own = [one for one in scored(sessions) if one.subject == subject]
        right, error = np.concatenate([_right(one) for one in own]), np.concatenate([one.error for one in own])
        counts = {"subject": subject, "sessions": len(own), "trials": len(right)}
        rows.append({**counts, **_rates(rates(right, error), right)})
    return pd.DataFrame(rows)


def _rates(of: Any, right: np.ndarray) -> dict[str, float]:
    return {"tnr": of.tnr, "tpr": of.tpr, "balanced": of.balanced, "right": float(right.mean())}


def _right(session: GazeSession) -> np.ndarray:
    assert session.right is not None
    return session.right


def guess_rows(sessions: Sequence[GazeSession], rows: pd.DataFrame, people: People) -> pd.DataFrame:
    """Return the rows of ``guesses.parquet``: right guesses as a session goes on, by the decoder's accuracy."""
    right = np.stack([_right(one) for one in scored(sessions)])
    made = []
    for interval in BINS:
        of = (rows["bin"] == interval).to_numpy()
        for end in range(TAIL, right.shape[1] + 1, TAIL) if of.any() else ():
            share = right[:, end - TAIL : end].mean(axis=1)
            low, high = people.mean(share, of)
            mean = float(share[of].mean())
            made.append(
                {"bin": interval, "sessions": int(of.sum()), "trial": end, "right": mean, "low": low, "high": high}
            )
    return pd.DataFrame(made)


class Replay:
    """The transitions of every trial, inferred from the policies, and what they can be held against.

    Args:
        sessions: The sessions, all of equal length.
    """

    def __init__(self, sessions: Sequence[GazeSession]) -> None:
        self.sessions = list(sessions)
        self.counts = [_counts(one) for one in self.sessions]

    def rows(self) -> pd.DataFrame:
        """Return the rows of ``trials.parquet``."""
        return pd.concat([self._of(s, c) for s, c in zip(self.sessions, self.counts, strict=True)], ignore_index=True)

    def _of(self, session: GazeSession, counts: Sequence[TrialCounts]) -> pd.DataFrame:
        solved = all(one.solved for one in counts)
        least = np.stack([one.least for one in counts]) if solved else None
        away = np.full(len(counts), np.nan)
        if least is not None:
            away = np.abs(replay(least, session.error) - session.policies).max(axis=(1, 2))
        rows = []
        for trial, one in enumerate(counts):
            logged = None if session.transitions is None else int(session.transitions[trial])
            ways = None if logged is None else one.matrices(logged)
            rows.append(
                {
                    "subject": session.subject,
                    "run": session.run,
                    "trial": trial + 1,
                    "error": bool(session.error[trial]),
                    "transitions": np.nan if logged is None else logged,
                    "counted": int(one.least.sum()) if one.solved else UNSOLVED,
                    "rows_one": sum(len(row) == 1 and not any(row[0].truncated) for row in one.rows),
                    "rows_several": sum(len(row) > 1 for row in one.rows),
                    "truncated": one.truncated,
                    "agrees": None if logged is None else one.allows(logged),
                    "ways": np.nan if ways is None else len(ways),
                    "paths": np.nan if ways is None else int(is_path(ways).sum()),
                    "difference": away[trial],
                }
            )
        return pd.DataFrame(rows)

    def reading(self) -> Reading:
        """Return what people saw and guessed in the scored sessions.

        Where several counts remain, all of them one path, their looks are averaged.
        """
        own = [(s, c) for s, c in zip(self.sessions, self.counts, strict=True) if s.right is not None]
        seen, known = [], []
        for session, counts in own:
            assert session.transitions is not None
            pairs = zip(counts, session.transitions, strict=True)
            ways = [one.matrices(int(logged)) for one, logged in pairs]
            paths = [one[is_path(one)] for one in ways]
            known.append([len(one) > 0 for one in paths])
            seen.append([looks(one).mean(axis=0) if len(one) else np.zeros(3) for one in paths])
        return Reading(
            tuple(s.subject for s, _ in own), np.array(seen), np.array(known), np.stack([_right(s) for s, _ in own])
        )

    def paths_by_chance(self) -> float:
        """Return how often rows of different trials, put together, are one path; of trials without doubt."""
        whole = [
            [one.least for one in counts if one.unique and not one.truncated]
            for session, counts in zip(self.sessions, self.counts, strict=True)
            if session.transitions is not None
        ]
        mixed = [
            np.stack([trials[(at + row) % len(trials)][row] for row in range(4)])
            for trials in whole
            if len(trials) >= 4
            for at in range(len(trials))
        ]
        return float(is_path(np.stack(mixed)).mean()) if mixed else float("nan")


def _counts(session: GazeSession) -> list[TrialCounts]:
    pairs = zip(session.before, session.policies, session.error, strict=True)
    return [trial_counts(before, after, error=bool(wrong)) for before, after, wrong in pairs]


def replay_summary(trials: pd.DataFrame, by_chance: float) -> dict[str, Any]:
    """Return what the replay comes to, and every trial whose logged number contradicts it.

    Args:
        trials: Rows of trials.parquet.
        by_chance: How often rows of different trials are one path.
    """
    logged = trials[trials["transitions"].notna()]
    whole = logged[logged["rows_one"] == 4]
    settled = logged[logged["ways"] == 1]
    differing = logged[~logged["agrees"].astype(bool)]
    rows, several = 4 * len(trials), int(trials["rows_several"].sum())
    one, unsolved = int(trials["rows_one"].sum()), int((trials["counted"] == UNSOLVED).sum())
    replayed = trials.groupby(["subject", "run"], observed=True)["difference"].max()
    return {
        "sessions": len(replayed),
        "replayed": int(replayed.notna().sum()),
        "rows": rows,
        "rows_one": one,
        "rows_several": several,
        "rows_truncated": rows - one - several - 4 * unsolved,
        "trials": len(trials),
        "trials_one": int((trials["rows_one"] == 4).sum()),
        "unsolved": unsolved,
        "logged": len(logged),
        "whole": len(whole),
        "whole_agree": int((whole["counted"] == whole["transitions"]).sum()),
        "allowed": int(logged["agrees"].astype(bool).sum()),
        "settled": len(settled),
        "settled_paths": int((settled["paths"] == 1).sum()),
        "several_paths": int((logged["paths"] > 1).sum()),
        "paths_by_chance": round(by_chance, 6) if np.isfinite(by_chance) else None,
        "largest_difference": float(replayed.max()),  # of the sessions that were
        "disagreeing": [_named(row) for row in differing.to_dict("records")],
    }


def _named(row: Mapping[Hashable, Any]) -> dict[str, Any]:
    """Return a trial whose logged number is impossible; ``counted`` is None where no transitions explain its policy."""
    told = {name: int(row[name]) for name in ("run", "trial", "transitions", "counted")}
    return {"subject": row["subject"], **told} | ({"counted": None} if told["counted"] == UNSOLVED else {})
