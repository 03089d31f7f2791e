"""One problem of one subject: two classes of trials, one plan of folds, and every result that stands on it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hrcneuro.decoding import baselines, chance, crossval, metrics
from hrcneuro.decoding.crossval import Split
from hrcneuro.decoding.refusals import TwinTrialsError
from hrcneuro.decoding.scheme import Scheme
from hrcneuro.paradigm.design import CUES

# Labels and folds in, the held-out trials' scores out: a decoder together with its features of all trials.
Decode = Callable[[np.ndarray, Sequence[Split]], list[np.ndarray]]

MATCHED_CUE = "prev_error"

_MOST_KEPT = 1000  # labellings with their folds, of 25 kB each


@dataclass(frozen=True)
class LabelledTrials:
    """The trials of a problem, in the order of the recording.

    Attributes:
        labels: ndarray, shape (n_trials,), bool, true for class 2 (takeover).
        onsets_s: ndarray, shape (n_trials,), when they begin, s.
        blocks: ndarray, shape (n_trials,), int; None where the study has no blocks.
        cues: Name, one of ``CUES`` -> ndarray, shape (n_trials,), bool; those that the study has.
    """

    labels: np.ndarray
    onsets_s: np.ndarray
    blocks: np.ndarray | None
    cues: Mapping[str, np.ndarray] = field(default_factory=dict)

    @property
    def counts(self) -> tuple[int, int]:
        """Trials of class 1 and of class 2."""
        second = int(np.count_nonzero(self.labels))
        return len(self.labels) - second, second


class Labellings:
    """The true labels, then their permutations within block, each with the folds of one repeat.

    They depend on the seed alone, so that every decoder meets the same ones, whichever ran before.
    """

    def __init__(self, trials: LabelledTrials, scheme: Scheme, seed: int) -> None:
        """Draw nothing yet."""
        self._trials, self._scheme, self._seed = trials, scheme, seed
        self._kept: list[tuple[np.ndarray, list[Split]]] = []

    def __iter__(self) -> Iterator[tuple[np.ndarray, list[Split]]]:
        if self._scheme.permutations > _MOST_KEPT:
            return self._draw()
        # Drawing them takes as long as half of what a decoder does with them.
        self._kept = self._kept or list(self._draw())
        return iter(self._kept)

    def _draw(self) -> Iterator[tuple[np.ndarray, list[Split]]]:
        trials, scheme = self._trials, self._scheme
        blocks = np.zeros(len(trials.labels), dtype=int) if trials.blocks is None else trials.blocks
        rng = np.random.default_rng(self._seed)
        n_folds = crossval.feasible_folds(trials.labels, scheme.folds)
        for labels in chance.labellings(trials.labels, blocks, n_permutations=scheme.permutations, rng=rng):
            yield labels, crossval.shuffled_splits(labels, n_folds=n_folds, n_repeats=1, how=scheme.balance, rng=rng)


@dataclass(frozen=True)
class Plan:
    """The folds of a problem, drawn once, so that every decoder and baseline meets the same ones.

    ``fallbacks`` say why the main result is missing or has fewer folds, ``notes`` what else is missing.
    """

    shuffled: list[Split]
    blockwise: list[Split]
    matched: list[Split]
    fallbacks: tuple[str, ...]
    notes: tuple[str, ...]
    labellings: Labellings


@dataclass(frozen=True)
class Stratum:
    """Held-out trials with one value of a cue, scored by decoders that were trained on all training trials."""

    cue: str
    value: bool
    n1: int
    n2: int
    bacc: float


@dataclass(frozen=True)
class Decoded:
    """The results of one decoder on one problem; rates are fractions, NaN where a note says why.

    Attributes:
        fold_rates: The rates of each fold.
        roc: ndarray, shape (101,), see :func:`.metrics.mean_roc`.
        scores: ndarray, shape (n_repeats, n_trials): in each repeat every trial is held out once.
        lobo_bacc: Balanced accuracy with one block left out at a time.
        matched_bacc: Balanced accuracy of decoders trained and tested on trials after no error.
        strata: The held-out trials by cue and value.
        permutation: The test of the balanced accuracy of one repeat, drawn for it, not that of ``fold_rates``; None
            without.
    """

    fold_rates: metrics.FoldRates
    roc: np.ndarray
    scores: np.ndarray
    lobo_bacc: float
    matched_bacc: float
    strata: tuple[Stratum, ...]
    permutation: chance.PermutationTest | None


def draw_plan(trials: LabelledTrials, scheme: Scheme, rng: np.random.Generator) -> Plan:
    """Return the folds of a problem; ``shuffled`` is empty where it has too few trials (a fallback says so).

    Each kind of fold has its own stream of random numbers: leaving one out changes no other.

    Raises:
        TwinTrialsError: Two trials are one event: a fold could test on what it was trained on.
    """
    twins = int((~crossval.distinct(trials.onsets_s)).sum())
    if twins:
        raise TwinTrialsError(f"{twins} trials begin less than {crossval.ONE_EVENT_S:g} s after another")
    folds_rng, blocks_rng, matched_rng, permutation_rng = rng.spawn(4)
    labellings = Labellings(trials, scheme, int(permutation_rng.integers(2**63)))
    labels, smaller = trials.labels, min(trials.counts)
    n_folds = crossval.feasible_folds(labels, scheme.folds)
    if not n_folds:
        note = f"not computed: the smaller class has {smaller} trials; at least {crossval.SMALLEST_CLASS} are needed"
        return Plan([], [], [], (note,), (), labellings)
    fallbacks, notes = [], []
    if n_folds < scheme.folds:
        fallbacks.append(f"{n_folds} instead of {scheme.folds} folds: the smaller class has {smaller} trials")
    repeats: Any = {"n_repeats": scheme.repeats, "how": scheme.balance}
    shuffled = crossval.shuffled_splits(labels, n_folds=n_folds, rng=folds_rng, **repeats)

    blockwise: list[Split] = []
    if trials.blocks is not None:
        blockwise = crossval.block_splits(labels, trials.blocks, rng=blocks_rng, **repeats)
    if not blockwise:
        notes.append("leave-one-block-out not computed: it needs two blocks and two trials a class outside each")

    matched: list[Split] = []
    if MATCHED_CUE in trials.cues:
        kept = np.flatnonzero(~trials.cues[MATCHED_CUE])
        if crossval.feasible_folds(labels[kept], scheme.folds) == scheme.folds:
            inner = crossval.shuffled_splits(labels[kept], n_folds=scheme.folds, rng=matched_rng, **repeats)
            matched = [Split(s.repeat, s.fold, kept[s.train], kept[s.test]) for s in inner]
        else:
            notes.append(f"matched retraining not computed: it needs {scheme.folds} trials a class after no error")
    missing = [cue for cue in CUES if cue not in trials.cues]
    if missing:
        notes.append(
            f"no strata, matched trials or label-free baseline of {' and '.join(missing)}: no such column, or trials "
            "without a value in it"
        )
    return Plan(shuffled, blockwise, matched, tuple(fallbacks), tuple(notes), labellings)


def decode(
    trials: LabelledTrials, plan: Plan, scheme: Scheme, decoder: Decode, *, permuted: Decode | None = None
) -> Decoded:
    """Return every result of one decoder on one problem.

    Args:
        trials: The problem.
        plan: Its folds; ``shuffled`` must not be empty.
        scheme: The number of permutations and the smallest stratum.
        decoder: Scores held-out trials for any labelling and folds.
        permuted: Decides as ``decoder`` does, for the permutation test (200 × 10 fits: for quick decoders); none: no
            such test.
    """
    labels, n = trials.labels, len(trials.labels)
    scores = decoder(labels, plan.shuffled)
    table = crossval.by_repeat(plan.shuffled, scores, n)
    return Decoded(
        fold_rates=metrics.fold_rates(labels, plan.shuffled, scores),
        roc=metrics.mean_roc(labels, plan.shuffled, scores),
        scores=table,
        lobo_bacc=_pooled(labels, plan.blockwise, decoder),
        matched_bacc=_pooled(labels, plan.matched, decoder, trials.cues.get(MATCHED_CUE)),
        strata=strata(trials, table, min_trials=scheme.min_stratum),
        permutation=permutation_test(trials, plan, permuted) if permuted and scheme.permutations else None,
    )


def strata(trials: LabelledTrials, score_table: np.ndarray, *, min_trials: int) -> tuple[Stratum, ...]:
    """Return the balanced accuracy of held-out trials in each stratum of each cue.

    The decoders were trained on all training trials: those retrained on matched ones learn from fewer and have less
    power (docs/synthetic.md). A stratum with fewer than ``min_trials`` of a class has NaN.
    """
    scored = []
    for cue, values in trials.cues.items():
        for value in (False, True):
            among = values == value
            n2 = int(np.count_nonzero(among & trials.labels))
            n1 = int(np.count_nonzero(among)) - n2
            enough = min(n1, n2) >= min_trials
            bacc = metrics.pooled_bacc(trials.labels, score_table, among) if enough else float("nan")
            scored.append(Stratum(cue, value, n1, n2, bacc))
    return tuple(scored)


def label_free(trials: LabelledTrials, plan: Plan) -> dict[str, float]:
    """Return ``CUE_rule_bacc`` and ``CUE_fitted_bacc`` of each cue: what can be decoded without EEG."""
    baccs = {}
    for cue, values in trials.cues.items():
        baccs[f"{cue}_rule_bacc"] = baselines.rule_bacc(values, trials.labels)
        scores = baselines.fitted_scores(values.astype(int), trials.labels, plan.shuffled)
        baccs[f"{cue}_fitted_bacc"] = metrics.fold_rates(trials.labels, plan.shuffled, scores).mean()["bacc"]
    return baccs


def permutation_test(trials: LabelledTrials, plan: Plan, decoder: Decode) -> chance.PermutationTest:
    """Return the permutation test of the balanced accuracy: one repeat a labelling, labels shuffled within block."""
    n = len(trials.labels)
    return chance.permutation_test(
        [
            metrics.pooled_bacc(labels, crossval.by_repeat(splits, decoder(labels, splits), n))
            for labels, splits in plan.labellings
        ]
    )


def _pooled(labels: np.ndarray, splits: list[Split], decoder: Decode, left_out: np.ndarray | None = None) -> float:
    if not splits:
        return float("nan")
    table = crossval.by_repeat(splits, decoder(labels, splits), len(labels))
    return metrics.pooled_bacc(labels, table, None if left_out is None else ~left_out)
