"""Every built-in recipe on what preprocessing leaves: channels that are combinations of others, in single precision."""

import functools
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom
from sklearn.base import clone

from hrcneuro.decoding import classifiers, crossval, decoders, features
from hrcneuro.decoding.problem import Decode
from hrcneuro.decoding.recipes import BUILTIN

N_TRIALS, N_CHANNELS, N_REPLACED = 160, 16, 4
RANK = N_CHANNELS - N_REPLACED - 1
TIMES_S = np.arange(-26, 154) / 128
# Under no effect a held-out trial is decided right with probability ½: beyond the bound once in 1000 times.
SURELY = 0.999

needs_pyriemann = pytest.mark.skipif(find_spec("pyriemann") is None, reason="pyriemann is not installed")
XDAWN = pytest.param("xdawn_tangent", marks=needs_pyriemann)
every_recipe = pytest.mark.parametrize("name", [XDAWN if n == "xdawn_tangent" else n for n in BUILTIN])


@functools.cache
def study(*, replaced: int = N_REPLACED) -> tuple[np.ndarray, np.ndarray]:
    """Return epochs in µV, shape (trials, channels, samples), and labels, true for the second class.

    Slow sources reach all channels; a positivity at 450 ms is higher in the second class. Then, as preprocessing does,
    the last channels are replaced by means of the others, and the common average is removed; single precision.
    """
    rng = np.random.default_rng(7)
    mixing = rng.normal(size=(N_CHANNELS, N_CHANNELS)) * np.geomspace(1, 0.1, N_CHANNELS)
    sources = lfilter([1], [1, -0.9], rng.normal(size=(N_TRIALS, N_CHANNELS, len(TIMES_S))))
    labels = rng.permutation(N_TRIALS) < N_TRIALS // 2
    height = 6.0 + 2.0 * labels
    wave = np.exp(-(((TIMES_S - 0.45) / 0.06) ** 2))
    epochs = 2 * mixing @ sources + rng.normal(0, 1, sources.shape)
    epochs += height[:, None, None] * rng.normal(size=N_CHANNELS)[:, None] * wave
    if replaced:
        epochs[:, -replaced:] = rng.dirichlet(np.ones(N_CHANNELS - replaced), replaced) @ epochs[:, :-replaced]
        epochs -= epochs.mean(axis=1, keepdims=True)
    return epochs.astype(np.float32).astype(float), labels


def decoder_of(name: str, epochs: np.ndarray) -> Decode:
    made = decoders.Decoders({name: BUILTIN[name]}, epochs_uv=lambda rows: epochs[rows], times_s=TIMES_S)
    return next(made.of(made.features_of(np.arange(len(epochs)))))[1]


def held_out(decoder: Decode, labels: np.ndarray, seed: int = 0) -> np.ndarray:
    """Return the score of each trial, from the fold that held it out."""
    rng = np.random.default_rng(seed)
    splits = crossval.shuffled_splits(labels, n_folds=5, n_repeats=1, how="undersample", rng=rng)
    return crossval.by_repeat(splits, decoder(labels, splits), len(labels))[0]


def right(decoder: Decode, labels: np.ndarray, seed: int = 0) -> int:
    return int(np.count_nonzero((held_out(decoder, labels, seed) > 0) == labels))


def test_the_study_has_the_rank_that_preprocessing_leaves():
    for replaced, rank in ((N_REPLACED, RANK), (0, N_CHANNELS)):
        epochs, _ = study(replaced=replaced)
        assert np.linalg.matrix_rank(np.cov(np.hstack(epochs)), rtol=1e-10, hermitian=True) == rank


@every_recipe
@pytest.mark.parametrize("residue_uv", [0, 0.01])
def test_a_planted_effect_is_found_where_channels_are_combinations_of_others(name, residue_uv):
    # With a residue (another interpolation, another reference) the rank is full, and the weak directions still empty.
    epochs, labels = study()
    epochs = epochs + residue_uv * np.random.default_rng(1).normal(size=epochs.shape)
    assert right(decoder_of(name, epochs), labels) > binom.ppf(SURELY, N_TRIALS, 0.5)


@every_recipe
def test_shuffled_labels_are_decoded_at_chance(name):
    epochs, labels = study()
    decoder, n = decoder_of(name, epochs), 4
    found = sum(right(decoder, np.random.default_rng(seed).permutation(labels), seed) for seed in range(n))
    low, high = binom.interval(SURELY, n * N_TRIALS, 0.5)
    assert low <= found <= high


@pytest.mark.parametrize("name", ["rlda", "rlda_600", XDAWN])
def test_empty_directions_and_turned_axes_change_no_score(name):
    # An absolute ridge, and xDAWN, see distances only: leaving out what is empty is a turn of the axes.
    epochs, labels = study()
    axes, *_ = np.linalg.svd(np.hstack(epochs), full_matrices=False)
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(N_CHANNELS, N_CHANNELS)))
    scores = held_out(decoder_of(name, epochs), labels)
    for other in (axes[:, :RANK].T @ epochs, turn @ epochs):
        assert held_out(decoder_of(name, other), labels) == pytest.approx(scores, rel=1e-6, abs=1e-6)


@needs_pyriemann
def test_xdawn_keeps_as_many_axes_as_the_training_trials_have():
    for replaced, rank in ((N_REPLACED, RANK), (0, N_CHANNELS)):
        epochs, labels = study(replaced=replaced)
        steps = features.extract("epochs", epochs, TIMES_S)
        fitted = classifiers.make("xdawn_tangent", {}).fit(steps[:120], labels[:120].astype(int))
        assert fitted[0].transform(steps[:2]).shape == (2, rank, steps.shape[2])


@needs_pyriemann
def test_xdawn_of_full_rank_needs_no_projection():
    epochs, labels = study(replaced=0)
    steps, classes = features.extract("epochs", epochs, TIMES_S), labels.astype(int)
    whole = classifiers.make("xdawn_tangent", {})
    without = clone(whole[1:])
    expected = without.fit(steps[:120], classes[:120]).decision_function(steps[120:])
    assert whole.fit(steps[:120], classes[:120]).decision_function(steps[120:]) == pytest.approx(expected, rel=1e-6)
