"""What was foretold of a closed loop with people, held against what they did: how good must a decoder be?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.analyses.gaze_scores import BINS, People
from hrcneuro.learning.gaze import CHANCE, SUCCESS, TAIL, TRIALS, DecoderRates
from hrcneuro.learning.gaze_game import play
from hrcneuro.learning.gaze_partner import Partner, Surface
from hrcneuro.learning.grid import GridPoint
from hrcneuro.learning.simulations import Z95
from hrcneuro.learning.sweep import LEVEL, needed, run_points

DESIGN_TOOL = "eq3-6"
_EPISODES, _EVENTS = 5, 10  # TRIALS decoded moves, as a sweep has them
_ACCURACIES = np.arange(50.0, 100.1, 2.5)


class DesignTool:
    """How often a robot that learns by Eq 3-6 chooses right after as many answers as a session has trials.

    It is the sweep's own question, asked of its usual task: ``simulate --sweep accuracy=...`` with 5 episodes of 10
    events that carry over.

    Args:
        config: The options of the stage: subtasks, chosen, alpha, tau, ddof, seed and evidence_repetitions.
    """

    def __init__(self, config: Any) -> None:
        points = [
            GridPoint(_EVENTS, config.subtasks, config.chosen, 0, float(a), config.alpha, config.tau)
            for a in _ACCURACIES
        ]
        reached = run_points(
            points,
            None,
            episodes=_EPISODES,
            repetitions=max(config.evidence_repetitions, 2),
            seed=config.seed,
            ddof=config.ddof,
            carry_over=True,
        )
        self.chosen = np.array([one.final for one in reached])
        self.half_width = np.array([one.final_half_width for one in reached])
        self.needed = needed(_ACCURACIES, self.chosen, self.half_width, LEVEL)

    def guesses(self, balanced: np.ndarray) -> np.ndarray:
        """Return the share of right guesses that decoders of such balanced accuracies foretell, chance corrected."""
        return as_guesses(np.interp(100 * balanced, _ACCURACIES, self.chosen))

    def rows(self) -> list[dict[str, Any]]:
        """Return its rows of ``design.parquet``."""
        scale = (1 - CHANCE) / (1 - 0.5)
        foretold = as_guesses(self.chosen)
        return _rows(DESIGN_TOOL, foretold, scale * self.half_width)


def as_guesses(chosen: Any) -> Any:
    """Return the share of right guesses of three that is as far above chance as a share of right choices of two."""
    return CHANCE + (1 - CHANCE) * np.maximum(2 * np.asarray(chosen) - 1, 0.0)


@dataclass(frozen=True)
class FittedPartner:
    """A model of the person who guesses, fitted to people.

    Attributes:
        kind: ``fixed`` or ``adapting``.
        alike: Fitted to all, one weight for everybody.
        whole: Fitted to all, each with a weight of her own.
        others: Person -> the same fitted to all others; nobody where there is only one.
        held_out: Person -> log-likelihood of her guesses under that.
    """

    kind: str
    alike: Partner
    whole: Partner
    others: Mapping[str, Partner]
    held_out: Mapping[str, float]


def fit_partner(likely: Surface, kind: str) -> FittedPartner:
    """Return a kind of partner fitted to all people, and to all but each of them."""
    whole = likely.fit(kind)
    people = likely.people if len(likely.people) > 1 else ()
    others = {name: likely.without(name).fit(kind, near=whole) for name in people}
    held_out = {name: likely.of(one)[name] for name, one in others.items()}
    return FittedPartner(kind, likely.fit(kind, alike=True), whole, others, held_out)


def partner_rows(likely: Surface, fitted: Sequence[FittedPartner]) -> pd.DataFrame:
    """Return the rows of ``partners.parquet``."""
    return pd.DataFrame(
        [
            {
                "partner": one.kind,
                "people": people,
                **{name: getattr(partner, name) for name in ("weight", "spread", "rate")},
                "log_likelihood": sum(likely.of(partner).values()),
                "held_out": held_out,
            }
            for one in fitted
            for people, partner, held_out in (
                ("alike", one.alike, np.nan),
                ("differ", one.whole, sum(one.held_out.values()) if one.held_out else np.nan),
            )
        ]
    )


def play_sessions(
    rows: pd.DataFrame, fitted: FittedPartner, lengths: np.ndarray, config: Any
) -> tuple[np.ndarray, float]:
    """Return the share of right guesses foretold for the last ten trials of each session, and how often it came true.

    Args:
        rows: Rows of sessions.parquet: the decoder of each session.
        fitted: The simulated partner who guesses. For the sessions of a person the one fitted to all other people.
        lengths: Numbers of transitions, from which those of simulated trials are drawn.
        config: The options of the stage: seed and evidence_repetitions.

    Returns:
        ndarray, shape (n_sessions,), and the share of logged sessions that lie within 95 % of their simulated ones;
        nan where there are no other people.
    """
    if not fitted.others:
        return np.full(len(rows), np.nan), float("nan")
    decoders = [DecoderRates(a, b) for a, b in zip(rows["tnr"].fillna(1.0), rows["tpr"].fillna(0.0), strict=True)]
    partners = [fitted.others[name] for name in rows["subject"]]
    ends = _ends(decoders, partners, lengths, config)
    low, high = np.percentile(ends, [2.5, 97.5], axis=1)
    seen = rows["last_right"].to_numpy()
    return ends.mean(axis=1), float(((seen >= low) & (seen <= high)).mean())


def play_design(fitted: FittedPartner, lengths: np.ndarray, config: Any) -> list[dict[str, Any]]:
    """Return a partner's rows of ``design.parquet``."""
    decoders = [DecoderRates(a / 100, a / 100) for a in _ACCURACIES]
    ends = _ends(decoders, [fitted.whole] * len(decoders), lengths, config)
    half = Z95 * ends.std(axis=1, ddof=1) / np.sqrt(ends.shape[1])
    return _rows(fitted.kind, ends.mean(axis=1), half)


def _ends(
    decoders: Sequence[DecoderRates], partners: Sequence[Partner], lengths: np.ndarray, config: Any
) -> np.ndarray:
    """Return the share of right guesses in the last ten trials: ndarray, shape (n_games, n_repetitions)."""
    rng = np.random.default_rng([config.seed, *b"gaze"])
    right = play(decoders, partners, lengths, repetitions=config.evidence_repetitions, rng=rng, trials=TRIALS)
    return right[..., -TAIL:].mean(axis=-1)


def _rows(predictor: str, predicted: np.ndarray, half: np.ndarray) -> list[dict[str, Any]]:
    columns = zip(_ACCURACIES, predicted, half, strict=True)
    return [{"predictor": predictor, "accuracy": a, "predicted": p, "half_width": h} for a, p, h in columns]


def predicted_rows(rows: pd.DataFrame, predictors: Sequence[str], people: People) -> pd.DataFrame:
    """Return the rows of ``predicted.parquet``: what was foretold and what was seen, by the decoder's accuracy."""
    seen, made = rows["last_right"].to_numpy(), []
    for predictor in predictors:
        for interval in ("all", *BINS):
            of = np.ones(len(rows), bool) if interval == "all" else (rows["bin"] == interval).to_numpy()
            if of.any():
                low, high = people.mean(seen, of)
                means = {"predicted": float(rows[predictor][of].mean()), "observed": float(seen[of].mean())}
                size = {"sessions": int(of.sum())}
                made.append({"predictor": predictor, "bin": interval, **size, **means, "low": low, "high": high})
    return pd.DataFrame(made)


def calibration(predicted: np.ndarray, seen: np.ndarray, people: People) -> dict[str, Any]:
    """Return slope, bias, error and correlation of a prediction, each with its 95 % interval over people.

    A slope of 1 with no bias is a prediction as good as its spread; below 1 it promises more difference than there is.
    """

    def covariance(times: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        total = times.sum(axis=1)
        return times @ (x * y) / total - (times @ x / total) * (times @ y / total)

    def slope(times: np.ndarray) -> np.ndarray:
        return covariance(times, predicted, seen) / covariance(times, predicted, predicted)

    def bias(times: np.ndarray) -> np.ndarray:
        return times @ (seen - predicted) / times.sum(axis=1)

    def error(times: np.ndarray) -> np.ndarray:
        return times @ np.abs(seen - predicted) / times.sum(axis=1)

    def correlation(times: np.ndarray) -> np.ndarray:
        spread = covariance(times, predicted, predicted) / covariance(times, seen, seen)
        return slope(times) * np.sqrt(np.maximum(spread, 0.0))

    once = np.ones((1, len(seen)))
    return {
        name: {"value": float(of(once)[0]), **dict(zip(("low", "high"), people.interval(of), strict=True))}
        for name, of in (("slope", slope), ("bias", bias), ("error", error), ("correlation", correlation))
    }


def success(accuracy: np.ndarray, seen: np.ndarray, threshold: float, people: People) -> dict[str, Any]:
    """Return how many sessions at or above an accuracy, and below it, ended well, with intervals over people.

    Args:
        accuracy: ndarray, shape (n_sessions,): balanced accuracies.
        seen: ndarray, shape (n_sessions,): share of right guesses in the last ten trials.
        threshold: The accuracy that was called enough.
        people: Whose the sessions are.
    """
    well = (seen >= SUCCESS / TAIL - 1e-9).astype(float)
    told: dict[str, Any] = {"accuracy": threshold, "right": SUCCESS}
    for name, of in (("above", accuracy >= threshold), ("below", accuracy < threshold)):
        n = people.count(of)
        share = float(well[of].mean()) if of.any() else float("nan")
        low, high = people.mean(well, of)
        # Where all are alike, drawing among them tells nothing: the exact interval of as many people takes its place.
        if n and share in (0.0, 1.0):
            edge = 0.025 ** (1 / n)
            low, high = (0.0, 1.0 - edge) if share == 0.0 else (edge, 1.0)
        sizes = {"sessions": int(of.sum()), "people": n, "well": int(well[of].sum())}
        told[name] = {**sizes, "share": share, "low": low, "high": high}
    return told
