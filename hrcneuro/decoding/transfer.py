"""One subject decoded by decoders of the others, and by its own after so many calibration trials, on the same folds.

The held-out parts are the subject's blocks. What a decoder may see of the subject is a calibration: the first trials of
the blocks that follow the held-out one (after the last block comes the first), until both classes have so many. No way
sees a held-out trial, with or without its label, before it is scored.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.decoding import crossval, decoders
from hrcneuro.decoding.crossval import Split
from hrcneuro.decoding.lda import Moments, discriminant_of
from hrcneuro.decoding.recentring import centre, common, recentred
from hrcneuro.decoding.transfer_scheme import RECENTRING, TransferScheme

Size = int | None
"""Calibration trials a class; None: all that there are outside the held-out part."""

_LEAST = 2  # trials a class: covariances with n − 1 need them


@dataclass(frozen=True)
class Person:
    """A subject's trials of one problem, in the order of the recording.

    Attributes:
        features: ndarray, shape (n_trials, n_channels, n_windows), µV.
        labels: ndarray, shape (n_trials,), bool, true for class 2 (takeover).
        onsets_s: ndarray, shape (n_trials,), when they begin, s.
        parts: ndarray, shape (n_trials,), int: trials of equal value, such as a block's, are held out together.
    """

    features: np.ndarray
    labels: np.ndarray
    onsets_s: np.ndarray
    parts: np.ndarray

    @property
    def rows(self) -> np.ndarray:
        """The features, ndarray, shape (n_trials, n_channels × n_windows), µV."""
        return self.features.reshape(len(self.features), -1)


@dataclass(frozen=True)
class Calibration:
    """What a decoder may see of a subject before a part of its trials is scored.

    Attributes:
        seen: The trials, in the order in which they are seen.
        test: The held-out ones.
        pairs: How many trials of each class are seen.
        minutes: How long that takes, from the first trial of a block to the last one that is needed of it.
    """

    seen: np.ndarray
    test: np.ndarray
    pairs: int
    minutes: float


@dataclass(frozen=True)
class Scored:
    """All trials of a subject, scored in one way after calibrations of one size.

    Attributes:
        way: One of ``WAYS``.
        size: Calibration trials a class that were asked for.
        pairs, minutes: As :class:`Calibration` has them, mean over the held-out parts.
        scores: ndarray, shape (n_trials,), positive where takeover is decided.
    """

    way: str
    size: Size
    pairs: float
    minutes: float
    scores: np.ndarray


def calibrations(person: Person, size: Size) -> list[Calibration]:
    """Return what is seen before each part is scored; empty where a part has fewer trials outside it."""
    made = [_calibration(person, part, size) for part in np.unique(person.parts)]
    return [one for one in made if one is not None] if all(made) else []


def _calibration(person: Person, part: int, size: Size) -> Calibration | None:
    names = np.unique(person.parts)
    at = int(np.flatnonzero(names == part)[0])
    following = [*names[at + 1 :], *names[:at]]
    order = np.concatenate([np.flatnonzero(person.parts == one) for one in following] or [np.zeros(0, int)])
    second = person.labels[order]
    pairs = np.minimum(np.cumsum(second), np.cumsum(~second))
    if size is None:
        stop = len(order)
    elif size == 0:
        stop = 0
    elif len(pairs) and pairs[-1] >= size:
        stop = int(np.searchsorted(pairs, size)) + 1
    else:
        return None
    seen = order[:stop]
    test = np.flatnonzero(person.parts == part)
    return Calibration(seen, test, int(pairs[stop - 1]) if stop else 0, cap_minutes(person, seen))


def cap_minutes(person: Person, seen: np.ndarray) -> float:
    """Return how long it takes to record these trials: in each part from its first trial to the last one seen, min."""
    total = 0.0
    for part in np.unique(person.parts[seen]):
        first = person.onsets_s[person.parts == part].min()
        total += person.onsets_s[seen[person.parts[seen] == part]].max() - first
    return float(total) / 60


def scored(
    people: Mapping[str, Person], target: str, scheme: TransferScheme, rng: np.random.Generator
) -> Iterator[Scored]:
    """Yield the target's trials scored in every way and after every size of calibration that its trials allow.

    Args:
        people: Subject -> trials of the same problem, channels and windows; at least two.
        target: The one that is left out of the training sets but for its calibration trials.
        scheme: Ways, sizes, λ, draws.
        rng: For the draws; each way has a stream of its own.

    Raises:
        MissingLibraryError: A way needs pyRiemann, which is not installed.
    """
    own_rng, pooled_rng, recentred_rng = rng.spawn(3)
    own, others = people[target], [one for name, one in people.items() if name != target]
    if "own" in scheme.ways:
        yield from _by_own(own, scheme, own_rng)
    if "pooled" in scheme.ways:
        classes = _drawn([(one.rows, one.labels) for one in others], scheme.draws, pooled_rng)
        weights, bias = _mean_discriminant(classes, scheme.shrinkage)
        yield Scored("pooled", 0, 0.0, 0.0, own.rows @ weights + bias)
    if set(RECENTRING) & set(scheme.ways):
        found = _by_recentred(own, others, scheme, recentred_rng)
        yield from (one for one in found if one.way in scheme.ways)


def _by_own(own: Person, scheme: TransferScheme, rng: np.random.Generator) -> Iterator[Scored]:
    """Yield what the study's decoder makes of calibrations of its own subject."""
    decode = decoders.rlda(own.rows, shrinkage=scheme.shrinkage)
    for size in (*scheme.pairs, None):
        made = calibrations(own, size)
        if not made or min(one.pairs for one in made) < _LEAST:
            continue
        splits = [
            Split(draw, fold, crossval.balance(one.seen, own.labels, "undersample", rng), one.test)
            for draw in range(scheme.draws)
            for fold, one in enumerate(made)
        ]
        scores = crossval.by_repeat(splits, decode(own.labels, splits), len(own.labels)).mean(axis=0)
        yield _scored("own", size, made, scores)


def _by_recentred(
    own: Person, others: Sequence[Person], scheme: TransferScheme, rng: np.random.Generator
) -> Iterator[Scored]:
    """Yield what recentred decoders of the others make of the subject, without and with its calibration's labels."""
    sources_rng, joint_rng = rng.spawn(2)
    centres = [centre(one.features) for one in others]
    middle = common(centres)
    size_uv = middle.size_uv
    moved = [recentred(one.features, at, size_uv=size_uv) for one, at in zip(others, centres, strict=True)]
    classes = _drawn([(rows, one.labels) for rows, one in zip(moved, others, strict=True)], scheme.draws, sources_rng)
    weights, bias = _mean_discriminant(classes, scheme.shrinkage)
    for size in (0, *scheme.pairs, None):
        made = calibrations(own, size)
        if not made:
            continue
        without, joint = np.full(len(own.labels), np.nan), np.full(len(own.labels), np.nan)
        for one in made:
            at = centre(own.features[one.seen], middle, weight=scheme.prior_trials)
            rows = recentred(own.features, at, size_uv=size_uv)
            without[one.test] = rows[one.test] @ weights + bias
            if "joint" in scheme.ways and one.pairs:
                more = [_added(both, rows, own.labels, one.seen, joint_rng) for both in classes]
                joint_weights, joint_bias = _mean_discriminant(more, scheme.shrinkage)
                joint[one.test] = rows[one.test] @ joint_weights + joint_bias
        yield _scored("recentred", size, made, without)
        if np.isfinite(joint).all():
            yield _scored("joint", size, made, joint)


def _drawn(
    sources: Sequence[tuple[np.ndarray, np.ndarray]], draws: int, rng: np.random.Generator
) -> list[tuple[Moments, Moments]]:
    """Return both classes of all sources (rows and labels) together, each source balanced, as often as is drawn."""
    found = []
    for _ in range(draws):
        taken = [crossval.balance(np.arange(len(labels)), labels, "undersample", rng) for _, labels in sources]
        rows = np.concatenate([one[which] for (one, _), which in zip(sources, taken, strict=True)])
        labels = np.concatenate([own[which] for (_, own), which in zip(sources, taken, strict=True)])
        found.append((Moments.of(rows[~labels]), Moments.of(rows[labels])))
    return found


def _added(
    classes: tuple[Moments, Moments], rows: np.ndarray, labels: np.ndarray, seen: np.ndarray, rng: np.random.Generator
) -> tuple[Moments, Moments]:
    """Return both classes with a balanced draw of the trials seen."""
    taken = crossval.balance(seen, labels, "undersample", rng)
    first, second = rows[taken[~labels[taken]]], rows[taken[labels[taken]]]
    return classes[0].joined(Moments.of(first)), classes[1].joined(Moments.of(second))


def _mean_discriminant(classes: Sequence[tuple[Moments, Moments]], shrinkage: float) -> tuple[np.ndarray, float]:
    """Return weights and bias whose score is the mean of all draws' scores."""
    found = [discriminant_of(first, second, shrinkage=shrinkage) for first, second in classes]
    return np.mean([weights for weights, _ in found], axis=0), float(np.mean([bias for _, bias in found]))


def _scored(way: str, size: Size, made: Sequence[Calibration], scores: np.ndarray) -> Scored:
    pairs, minutes = (float(np.mean(values)) for values in ([m.pairs for m in made], [m.minutes for m in made]))
    return Scored(way, size, pairs, minutes, scores)
