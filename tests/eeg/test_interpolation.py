import math

import mne
import numpy as np
import pytest
from scipy.special import eval_legendre

from hrcneuro.eeg import interpolation

NAMES = ["Fp1", "Fp2", "F3", "F4", "F7", "F8", "FC1", "FC2", "C3", "C4", "T7", "T8", "P3", "P4", "P7", "P8", "O1", "O2"]


@pytest.fixture(scope="module")
def info():
    made = mne.create_info(NAMES, 100.0, "eeg")
    montages = mne.channels.get_builtin_montages()
    made.set_montage("colin27_1005" if "colin27_1005" in montages else "standard_1005")
    return made


@pytest.fixture(scope="module")
def sphere():
    points = np.random.default_rng(2).standard_normal((20, 3))
    return 0.085 * points / np.linalg.norm(points, axis=1, keepdims=True)


def eeg_interp(values, good, bad):
    """EEGLAB's spherical interpolation, sample by sample as its steps read."""

    def g(a, b):
        chord = math.dist(a / np.linalg.norm(a), b / np.linalg.norm(b))
        return sum((2 * n + 1) / (n**4 * (n + 1) ** 4) * eval_legendre(n, 1 - chord) for n in range(1, 8)) / 4 / math.pi

    matrix = np.array([[g(a, b) for b in good] for a in good] + [[1.0] * len(good)])
    target = np.array([[g(a, b) for b in good] for a in bad])
    out = np.empty((len(bad), values.shape[1]))
    for t, sample in enumerate(values.T):
        mean = sample.mean()
        coefficients = np.linalg.lstsq(matrix, np.append(sample - mean, 0))[0]
        out[:, t] = target @ coefficients + mean
    return out


def test_eeglab_is_its_recipe(sphere):
    values = 20 * np.random.default_rng(0).standard_normal((16, 9))
    ours = interpolation.weights(sphere[4:], sphere[:4], method="eeglab") @ values
    np.testing.assert_allclose(ours, eeg_interp(values, sphere[4:], sphere[:4]), rtol=0, atol=1e-9)


def test_perrin_is_mnes(info):
    data = 1e-5 * np.random.default_rng(1).standard_normal((len(NAMES), 300))
    raw = mne.io.RawArray(data.copy(), info, verbose="error")
    raw.info["bads"] = ["F3", "T8", "O2"]
    bad = np.array([raw.ch_names.index(name) for name in raw.info["bads"]])
    good = np.setdiff1d(np.arange(len(NAMES)), bad)
    centre = mne.bem.fit_sphere_to_headshape(raw.info, units="m", verbose="error")[1]
    at = np.array([ch["loc"][:3] for ch in raw.info["chs"]]) - centre
    raw.interpolate_bads(verbose="error")
    ours = interpolation.apply(data * 1e6, bad, good, interpolation.weights(at[good], at[bad], method="perrin"))
    np.testing.assert_allclose(ours, raw.get_data() * 1e6, rtol=0, atol=1e-7)


@pytest.mark.parametrize("method", interpolation.SPLINES)
def test_a_constant_stays_and_scale_does_not_matter(sphere, method):
    matrix = interpolation.weights(sphere[3:], sphere[:3], method=method)
    np.testing.assert_allclose(matrix.sum(axis=1), 1, atol=1e-9)
    scaled = interpolation.weights(1000 * sphere[3:], 7 * sphere[:3], method=method)
    np.testing.assert_allclose(scaled, matrix, atol=1e-7)


@pytest.mark.parametrize("method", interpolation.SPLINES)
def test_rotating_the_head_changes_nothing(sphere, method):
    turn, _ = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))
    matrix = interpolation.weights(sphere[3:], sphere[:3], method=method)
    np.testing.assert_allclose(
        interpolation.weights(sphere[3:] @ turn, sphere[:3] @ turn, method=method), matrix, atol=1e-6
    )


def test_perrin_brings_a_smooth_field_back_and_eeglab_less_so(sphere):
    field = sphere @ [1.0, -2.0, 0.5] / 0.085
    made = {m: interpolation.weights(sphere[1:], sphere[:1], method=m) @ field[1:] for m in interpolation.SPLINES}
    assert abs(made["perrin"][0] - field[0]) < 0.35 < abs(made["eeglab"][0] - field[0]) < 1


def test_the_two_methods_are_not_the_same(sphere):
    a, b = (interpolation.weights(sphere[3:], sphere[:3], method=m) for m in interpolation.SPLINES)
    assert np.abs(a - b).max() > 0.05


def test_apply_touches_only_the_bad_channels(sphere, monkeypatch):
    monkeypatch.setattr(interpolation, "_SLAB", 40)
    data = np.random.default_rng(4).standard_normal((20, 101))
    bad, good = np.array([2, 11]), np.setdiff1d(np.arange(20), [2, 11])
    matrix = interpolation.weights(sphere[good], sphere[bad], method="eeglab")
    out = interpolation.apply(data.copy(), bad, good, matrix)
    np.testing.assert_array_equal(out[good], data[good])
    np.testing.assert_allclose(out[bad], matrix @ data[good], atol=1e-12)


def test_sphere_centre(sphere):
    np.testing.assert_array_equal(interpolation.sphere_centre(sphere), 0)
    np.testing.assert_array_equal(interpolation.sphere_centre(sphere.astype(np.float32).astype(float)), 0)
    shift = np.array([0.001, -0.01, 0.04])
    np.testing.assert_allclose(interpolation.sphere_centre(sphere + shift), shift, atol=1e-9)
    np.testing.assert_array_equal(interpolation.sphere_centre(sphere[:4] + shift), 0)
    flat = sphere * [1, 1, 0]
    np.testing.assert_array_equal(interpolation.sphere_centre(flat), 0)


def test_unknown_method():
    with pytest.raises(ValueError, match=r"'spline'; allowed: eeglab, perrin"):
        interpolation.weights(np.eye(3), np.eye(3), method="spline")
