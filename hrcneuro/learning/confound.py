"""What if the decoder answers to errors rather than to anticipation? It may score the same and teach nothing.

In the study's intermittent scenario an error often precedes a human takeover from the robot (68.0 % of RH trials follow
one, 26.1 % of RR trials). A decoder that does no more than tell trials after an error from others would score the
published rates there. How it teaches a robot depends on whether errors tell who acts next in the new task as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hrcneuro import published
from hrcneuro.learning.decoder import Answers, CoinFlips, Decoder
from hrcneuro.learning.rates import Rates, case
from hrcneuro.learning.simulations import Variant
from hrcneuro.learning.task import Draws, JointTask, actors, previous_actors

# Share of trials (tr−1) that follow an error, by case RR, RH, HR, HH: the authors' logs, iC, 11 subjects pooled.
LOGGED_SHARES = (0.2613, 0.6801, 0.0273, 0.2679)
ERROR_RATE = published.ERROR_SHARE.value  # of moves that do not follow an error (paper §2.2; none follows one)


@dataclass(frozen=True)
class ErrorReader:
    """A decoder that says "takeover" with one probability after an error and another after none.

    Attributes:
        after_error, after_none: These probabilities after a robot's and after a human's action.
        shares: How often an error went before, by case RR, RH, HR, HH; None: errors fall as they do in the study's
            moves, whoever acts.
    """

    after_error: tuple[float, float]
    after_none: tuple[float, float]
    shares: tuple[float, float, float, float] | None

    def answer(self, draws: Draws, rng: np.random.Generator, *, evidence: bool = False) -> Answers:
        """Return the answers; it offers no log-odds, since nobody who uses it knows what it answers to."""
        if evidence:
            raise ValueError("an error reader has no log-odds of who acts next")
        acting = actors(draws)
        before = previous_actors(acting, carry_over=draws.task.carry_over)
        if self.shares is None:
            error = falling_errors(acting.shape, rng)
        else:
            error = rng.random(acting.shape) < np.array(self.shares)[case(before, acting)]
        probability = np.array([self.after_none, self.after_error]).ravel()[2 * error + before]
        takeover = draws.epsilon < 100.0 * probability
        return Answers(takeover != before)


@dataclass(frozen=True)
class Mixture:
    """Each answer comes from ``one`` with probability ``share``, else from ``other``."""

    one: Decoder
    other: Decoder
    share: float

    def answer(self, draws: Draws, rng: np.random.Generator, *, evidence: bool = False) -> Answers:
        """Return the answers, without log-odds."""
        one, other = self.one.answer(draws, rng), self.other.answer(draws, rng)
        from_one = rng.random(one.predicted.shape) < self.share
        return Answers(np.where(from_one, one.predicted, other.predicted))


def falling_errors(shape: tuple[int, ...], rng: np.random.Generator) -> np.ndarray:
    """Return whether an error went before each event, bool: ERROR_RATE, never two errors in a row.

    Args:
        shape: (episodes, events, repetitions).
        rng: Source of the draws.
    """
    tried = rng.random((shape[0] * shape[1], shape[2])) < ERROR_RATE
    for now, earlier in zip(tried[1:], tried[:-1], strict=True):
        now &= ~earlier
    return tried.reshape(shape)


def error_reader(rates: Rates, *, as_logged: bool) -> ErrorReader:
    """Return the error reader that scores ``rates`` where errors precede takeovers as often as in the logs.

    Rates that no error reader can score are approached as nearly as probabilities allow.

    Args:
        rates: The rates to explain.
        as_logged: Errors precede takeovers in the new task as they do in the logs; otherwise they fall anyhow.
    """
    rr, rh, hr, hh = LOGGED_SHARES
    robot = said_by_cue(rr, rh, 1.0 - rates.tnr_rr / 100.0, rates.tpr_rh / 100.0)
    human = said_by_cue(hh, hr, 1.0 - rates.tnr_hh / 100.0, rates.tpr_hr / 100.0)
    after_error, after_none = zip(robot, human, strict=True)
    return ErrorReader(after_error, after_none, LOGGED_SHARES if as_logged else None)


def same_rates(rates: Rates, task: JointTask) -> list[Variant]:
    """Return learning from decoders of the same rates that answer to different things."""
    anticipation, anyhow = CoinFlips(rates), error_reader(rates, as_logged=False)
    decoders: dict[str, Decoder] = {
        "anticipation": anticipation,
        "errors, before takeovers as logged": error_reader(rates, as_logged=True),
        "half errors, half anticipation": Mixture(anyhow, anticipation, 0.5),
        "errors, whoever acts next": anyhow,
    }
    return [Variant("confound", name, task, decoder) for name, decoder in decoders.items()]


def said_by_cue(share_stay: float, share_take: float, said_stay: float, said_take: float) -> tuple[float, float]:
    """Return P(says takeover | cue), P(says takeover | none) of who reads a cue alone and scores given rates.

    Rates that nobody can score so are approached as nearly as probabilities allow.

    Args:
        share_stay, share_take: How often the cue is there where the actor stays, and where the other takes over.
        said_stay, said_take: How often "takeover" is said in the same cases.
    """
    slope = (said_take - said_stay) / (share_take - share_stay)
    after_none = said_stay - share_stay * slope
    return min(max(after_none + slope, 0.0), 1.0), min(max(after_none, 0.0), 1.0)
