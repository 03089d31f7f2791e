"""What a decoder answers to: how likely it says "takeover", by who is expected, a turn ahead and an error before.

Decoders with the same rates in their calibration teach different things once the robot acts by them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist

import numpy as np

from hrcneuro.learning.confound import said_by_cue
from hrcneuro.learning.learners import Kind
from hrcneuro.learning.online import HUMAN, ROBOT, OnlineLearner
from hrcneuro.learning.rates import Rates

LOGGED_CASES = np.array(
    [
        [[[1584, 413], [330, 264]], [[0, 0], [539, 1146]]],
        [[[1919, 452], [300, 360]], [[0, 0], [926, 26]]],
    ]
)
"""Trials of iC in the authors' logs, 11 subjects pooled: ndarray, shape (2, 2, 2, 2), int, by whether tr−1 is the
human's, the other takes over, a turn lies ahead, and the move before was an error."""
_EDGE = 0.001  # a rate nearer to 0 or 1 would claim infinite evidence
_LEAST = 1e-7  # and so would a score that no finite quantile has


@dataclass(frozen=True)
class LoopDecoder:
    """A decoder whose answers are independent draws.

    Attributes:
        says: ndarray, shape (2, 2, 2, 2): the probability that it says "takeover", by whether the move is the human's,
            a takeover is expected, a turn lies ahead, and the move before was an error.
        claimed: The rates that it was calibrated with, by which learners may weigh its answers.
    """

    says: np.ndarray
    claimed: Rates

    def says_takeover(self, by_human: bool, takeover: bool, turn: bool, error: bool) -> float:
        """Return the probability that it says "takeover" of one move."""
        return float(self.says[int(by_human), int(takeover), int(turn), int(error)])

    def log_odds(self, by_human: bool, probability: float, uniform: float) -> float:
        """Return the log-odds of takeover that the score of one answer claims.

        Scores are Gaussian with equal variance, as in :func:`hrcneuro.learning.evidence.graded_odds`; positive ones
        say "takeover".

        Args:
            by_human: Whose move it is.
            probability: That it says "takeover".
            uniform: The answer's draw from U(0, 1): it says "takeover" where this lies below the probability.
        """
        no, yes = self._separations[by_human]
        score = _quantile(probability) - _quantile(uniform)
        return (no + yes) * (score - (yes - no) / 2.0)

    def teach(
        self, learner: OnlineLearner, kind: Kind, step: str, uniform: float, *,
        by_human: bool, takeover: bool, turn: bool, error: bool,
    ) -> bool:  # fmt: skip
        """Let the answer at a move's onset teach who makes the next step; return whether it says "takeover".

        Args:
            learner: Takes it.
            kind: Which learner that is.
            step: Direction of the next step, of four.
            uniform: The answer's draw from U(0, 1).
            by_human, takeover, turn, error: As ``says`` has them.
        """
        probability = self.says_takeover(by_human, takeover, turn, error)
        said = uniform < probability
        odds = self.log_odds(by_human, probability, uniform) if kind.evidence == "graded" else 0.0
        learner.update(step, before=HUMAN if by_human else ROBOT, takeover=said, log_odds=odds)
        return said

    @cached_property
    def _separations(self) -> tuple[tuple[float, float], tuple[float, float]]:
        rr, rh, hr, hh = (_quantile(min(max(rate / 100.0, _EDGE), 1.0 - _EDGE)) for rate in self.claimed.by_case)
        return (rr, rh), (hh, hr)


def _quantile(share: float) -> float:
    return NormalDist().inv_cdf(min(max(share, _LEAST), 1.0 - _LEAST))


def anticipation(rates: Rates) -> LoopDecoder:
    """Return a decoder of whom the person expects, right at these rates whatever else is the case (Eq 4)."""
    table = np.empty((2, 2, 2, 2))
    for by_human, takeover in np.ndindex(2, 2):
        table[by_human, takeover] = _rates_of(rates)[by_human][takeover]
    return LoopDecoder(table, rates)


def independent(*, after_human: float, after_robot: float, claimed: Rates | None = None) -> LoopDecoder:
    """Return a decoder that knows nothing: it says "takeover" with these probabilities, whoever is expected.

    Its rates are TNR = 1 − p and TPR = p; it claims them unless others are given.
    """
    h, r = 100.0 * after_human, 100.0 * after_robot
    own = Rates(tnr_hh=100.0 - h, tpr_hr=h, tnr_rr=100.0 - r, tpr_rh=r)
    answers = anticipation(own).says
    return LoopDecoder(answers, own if claimed is None else claimed)


def of_errors(rates: Rates) -> LoopDecoder:
    """Return a decoder of the error before the move that scores ``rates`` in iC as logged, as nearly as one can."""
    return _of_cue(rates, axis=3)


def of_turns(rates: Rates) -> LoopDecoder:
    """Return a decoder of the turn ahead that scores ``rates`` in iC as logged, as nearly as one can."""
    return _of_cue(rates, axis=2)


RULES = ("stays", "prev_error", "turn")
"""Rules that look at no EEG: the actor stays; after an error, takeover; before a turn, takeover."""


def of_rule(rule: str) -> LoopDecoder:
    """Return one of ``RULES``, with the rates that it scores in iC as logged.

    Raises:
        KeyError: Another one.
    """
    table = np.zeros((2, 2, 2, 2))
    if rule != "stays":
        table[{"turn": np.s_[:, :, 1], "prev_error": np.s_[..., 1]}[rule]] = 1.0
    return LoopDecoder(table, scored(LoopDecoder(table, Rates.level(50))))


def scored(decoder: LoopDecoder, cases: np.ndarray = LOGGED_CASES) -> Rates:
    """Return the rates that a decoder scores.

    Args:
        decoder: Any.
        cases: ndarray, shape (2, 2, 2, 2): how many trials there are of each kind, in the order of ``says``.
    """
    takeovers = (decoder.says * cases).sum(axis=(2, 3)) / cases.sum(axis=(2, 3))
    (rr, rh), (hh, hr) = (100.0 * takeovers).tolist()
    return Rates(tnr_hh=100.0 - hh, tpr_hr=hr, tnr_rr=100.0 - rr, tpr_rh=rh)


def _of_cue(rates: Rates, *, axis: int) -> LoopDecoder:
    with_cue_there = np.take(LOGGED_CASES, 1, axis=axis).sum(axis=2) / LOGGED_CASES.sum(axis=(2, 3))
    table = np.empty((2, 2, 2, 2))
    for by_human, (stay, take) in enumerate(with_cue_there.tolist()):
        with_cue, without = said_by_cue(stay, take, *_rates_of(rates)[by_human])
        table[by_human] = np.moveaxis(np.broadcast_to([without, with_cue], (2, 2, 2)), -1, axis - 1)
    return LoopDecoder(table, rates)


def _rates_of(rates: Rates) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return P(says takeover | stays, takes over) of the robot's and of the human's moves."""
    return (
        (1 - rates.tnr_rr / 100.0, rates.tpr_rh / 100.0),
        (1 - rates.tnr_hh / 100.0, rates.tpr_hr / 100.0),
    )
