"""A decoder that replays the scores of trials-out trials, so that the chain EEG → decision → policy is closed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.learning.decoder import Answers
from hrcneuro.learning.evidence import decision_odds
from hrcneuro.learning.rates import Rates, case
from hrcneuro.learning.task import Draws, actors, previous_actors

_SHRINK = 10.0  # trials' worth of doubt when a slope is estimated


@dataclass(frozen=True)
class HeldOutTrials:
    """One problem's trials-out trials of one subject and one repeat of the cross-validation, in recorded order.

    Attributes:
        label: ndarray, shape (n_trials,), int: 1 takeover, 0 none.
        score: ndarray, shape (n_trials,): the decoder's score, positive where it decides for takeover.
        block: ndarray, shape (n_trials,), int. Log-odds are calibrated on every other of the blocks that there are, in
            order, for the rest; where one half lacks a class (always with a single block), on all trials, those scored
            among them.
    """

    label: np.ndarray
    score: np.ndarray
    block: np.ndarray

    def rates(self) -> tuple[float, float]:
        """Return TNR and TPR in per cent."""
        return (
            100.0 * float((self.score[self.label == 0] <= 0).mean()),
            100.0 * float((self.score[self.label == 1] > 0).mean()),
        )


@dataclass(frozen=True)
class DecodedRepeat:
    """One repeat of one subject: what was decoded after a robot's action (RR, RH) and after a human's (HH, HR).

    Raises:
        ValueError: Trials of one class are missing.
    """

    after_robot: HeldOutTrials
    after_human: HeldOutTrials

    def __post_init__(self) -> None:
        for name, trials in (("after a robot's", self.after_robot), ("after a human's", self.after_human)):
            if not {0, 1} <= set(np.unique(trials.label).tolist()):
                raise ValueError(
                    f"the trials {name} action hold {trials.label.sum():g} takeovers of {len(trials.label)}"
                )

    def rates(self) -> Rates:
        """Return the rates of the trials at hand."""
        (rr, rh), (hh, hr) = self.after_robot.rates(), self.after_human.rates()
        return Rates(tnr_hh=hh, tpr_hr=hr, tnr_rr=rr, tpr_rh=rh)


class Replay:
    """Each repetition draws a decoded repeat and goes through its trials of each case in recorded order.

    It begins at a random one, and at the end of the recording it starts over. So a subject's runs of good and bad
    trials are kept, and so is the fact that a recording is finite.
    """

    def __init__(self, decoded: Sequence[DecodedRepeat]) -> None:
        self.decoded = tuple(decoded)
        tables = [_table(one) for one in self.decoded]
        # Every repeat's four cases one after the other; shape (n_repeats, 4) says where each begins and how long it is.
        self._lengths = np.array([[len(part[0]) for part in table] for table in tables])
        self._starts = (np.cumsum(self._lengths) - self._lengths.ravel()).reshape(-1, 4)
        self._flat = [np.concatenate([part[i] for table in tables for part in table]) for i in range(3)]

    def answer(self, draws: Draws, rng: np.random.Generator, *, evidence: bool = False) -> Answers:
        """Return the replayed answers, and the log-odds that their scores carry."""
        acting = actors(draws)
        before = previous_actors(acting, carry_over=draws.task.carry_over)
        index = self._places(case(before, acting), rng)
        takeover, decision, graded = (part[index] for part in self._flat)
        predicted = takeover != before
        if not evidence:
            return Answers(predicted)
        # Log-odds of takeover speak for the human after a robot's action, for the robot after a human's.
        sign = np.where(before, np.float32(-1), np.float32(1))
        return Answers(predicted, sign * decision, sign * graded)

    def _places(self, now: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return which trial answers each event, an index into the flat arrays; ``now`` is each event's case."""
        repetitions = now.shape[2]
        repeat = rng.integers(0, len(self.decoded), repetitions)
        first = rng.random((4, repetitions))
        index = np.empty(now.shape, np.intp)
        for which in range(4):
            here = now == which
            count = np.cumsum(here.reshape(-1, repetitions), axis=0).reshape(now.shape) - 1
            length, start = self._lengths[repeat, which], self._starts[repeat, which]
            place = (count + (first[which] * length).astype(np.intp)) % length + start
            index[here] = place[here]
        return index


def _table(repeat: DecodedRepeat) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return (takeover, decision log-odds, graded log-odds) of the trials of each case: RR, RH, HR, HH."""
    robot, human = _answers(repeat.after_robot), _answers(repeat.after_human)
    return [
        tuple(part[trials.label == label] for part in answers)
        for trials, answers, label in (
            (repeat.after_robot, robot, 0),
            (repeat.after_robot, robot, 1),
            (repeat.after_human, human, 1),
            (repeat.after_human, human, 0),
        )
    ]


def _answers(trials: HeldOutTrials) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    takeover = trials.score > 0
    decision, graded = np.zeros(len(takeover), np.float32), np.zeros(len(takeover), np.float32)
    # By rank, not by number: scenarios take turns, so that all blocks of one are odd.
    odd = np.unique(trials.block, return_inverse=True)[1] % 2 == 1
    for to in (odd, ~odd):
        source = ~to if {0, 1} <= set(trials.label[~to].tolist()) else np.ones(len(to), bool)
        known = HeldOutTrials(trials.label[source], trials.score[source], trials.block[source])
        decision[to], graded[to] = _decision(known, takeover[to]), calibrated(known, trials.score[to])
    return takeover, decision, graded


def _decision(known: HeldOutTrials, takeover: np.ndarray) -> np.ndarray:
    tnr, tpr = known.rates()
    # "Robot before" makes the human's odds those of takeover.
    rates = Rates(tnr_hh=50, tpr_hr=50, tnr_rr=tnr, tpr_rh=tpr)
    return decision_odds(np.zeros(len(takeover), bool), takeover, rates)


def calibrated(known: HeldOutTrials, score: np.ndarray) -> np.ndarray:
    """Return log-odds of takeover for scores: two Gaussians of one SD fitted to labelled scores, slightly shrunk.

    Args:
        known: Labelled trials.
        score: ndarray, shape (n_trials,): scores to turn into log-odds.
    """
    no, yes = known.score[known.label == 0], known.score[known.label == 1]
    within = np.concatenate([no - no.mean(), yes - yes.mean()])
    variance = float((within**2).sum()) / max(len(within) - 2, 1)
    if variance == 0.0:
        return np.zeros(len(score), np.float32)
    middle = (float(no.mean()) + float(yes.mean())) / 2.0
    doubt = min(len(no), len(yes)) / (min(len(no), len(yes)) + _SHRINK)
    slope = doubt * (float(yes.mean()) - float(no.mean())) / variance
    return (slope * (score - middle)).astype(np.float32)


def mean_rates(decoded: Sequence[DecodedRepeat]) -> Rates:
    """Return the mean rates over repeats."""
    values = np.array([one.rates().by_case for one in decoded]).mean(axis=0)
    rr, rh, hr, hh = (float(v) for v in values)
    return Rates(tnr_hh=hh, tpr_hr=hr, tnr_rr=rr, tpr_rh=rh)
