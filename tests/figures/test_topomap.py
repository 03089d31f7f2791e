"""Scalp maps: they pass through the electrodes, and lie near what MNE's interpolation draws."""

import warnings

import mne
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.interpolate import CloughTocher2DInterpolator

from hrcneuro.eeg.interpolation import sphere_centre
from hrcneuro.figures import topomap
from hrcneuro.figures.topomap import Scalp, Topography

FRONT = ["Fp1", "Fp2", "F7", "F3", "Fz", "F4", "F8", "FC5", "FC1", "FC2", "FC6"]
NAMES = [*FRONT, "T7", "C3", "Cz", "C4", "T8", "TP9", "CP5", "CP6", "TP10", "P7", "P3", "Pz", "P4", "P8", "O1", "O2"]


@pytest.fixture(scope="module")
def positions():
    with warnings.catch_warnings(action="ignore"):  # MNE announces other names for its montages
        found = mne.channels.make_standard_montage("standard_1020").get_positions()["ch_pos"]
    return np.array([found[name] for name in NAMES])


def smooth(positions, seed=0):
    """Return a field of a few broad hills on the head, one value an electrode."""
    rng = np.random.default_rng(seed)
    at = positions - sphere_centre(positions)
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    hills = rng.standard_normal((4, 3))
    hills /= np.linalg.norm(hills, axis=1, keepdims=True)
    return np.exp(2 * at @ hills.T) @ rng.standard_normal(4)


def test_the_view_from_above_and_back():
    flat = np.random.default_rng(0).uniform(-1.2, 1.2, (200, 2))
    np.testing.assert_allclose(topomap._from_above(topomap._onto_sphere(flat)), flat, atol=1e-12)
    nose, right, vertex = topomap._from_above(np.array([[0, 2.0, 0], [3.0, 0, 0], [0, 0, 1.0]]))
    np.testing.assert_allclose([*nose, *right, *vertex], [0, 1, 1, 0, 0, 0], atol=1e-12)


def test_a_map_has_the_electrodes_values(positions):
    scalp = Scalp.of(positions)
    column, row = np.abs(topomap._CENTRES[:, None, None] - scalp.electrodes).argmin(axis=0).T
    for values in (smooth(positions), *np.eye(len(positions))):  # broad hills, and each electrode alone
        error = np.abs(scalp.image(values)[row, column] - values)
        # A pixel's centre lies up to 2 % of the head beside its electrode.
        assert error.max() < 0.15 * np.ptp(values)
    assert np.linalg.norm(scalp.electrodes, axis=1).max() < 1


@pytest.mark.parametrize("seed", range(5))
def test_a_map_is_near_mnes(positions, seed):
    # plot_topomap interpolates with Clough and Tocher's triangles; inside the electrodes both must tell the same.
    scalp, values = Scalp.of(positions), smooth(positions, seed)
    theirs = CloughTocher2DInterpolator(scalp.electrodes, values)(*np.meshgrid(topomap._CENTRES, topomap._CENTRES))
    inside = np.isfinite(theirs)
    assert inside.sum() > 2000
    assert np.corrcoef(theirs[inside], scalp.image(values)[inside])[0, 1] > 0.99


def test_channels_without_a_place_are_left_out(positions):
    lacking = positions.copy()
    lacking[3], lacking[7] = np.nan, 0
    scalp, values = Scalp.of(lacking), smooth(positions)
    assert set(range(len(NAMES))) - set(scalp.rows) == {3, 7}
    values[[3, 7]] = 1e9
    assert np.abs(scalp.image(values)).max() < 100
    assert Scalp.of(np.vstack([positions[:3], np.full((5, 3), np.nan)])) is None


def test_a_row_of_maps_is_few_artists(positions):
    figure = Figure(figsize=(5, 2))
    axes = figure.add_axes((0.1, 0.1, 0.8, 0.5))
    values = smooth(positions)
    maps = [Topography(0.1 * i, values, values > np.quantile(values, 0.8)) for i in range(3)]
    Scalp.of(positions).draw(axes, maps, 2.0, slots=4, bar=True)
    assert [text.get_text() for text in axes.texts] == ["0 ms", "100 ms", "200 ms", "−2", "0", "2", "µV"]
    assert len(axes.images) + len(axes.collections) + len(axes.lines) == 6
