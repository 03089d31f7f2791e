"""The head of the synthetic recordings: its potentials are those of physics and of MNE."""

import mne
import numpy as np
import pytest

from hrcneuro.eeg.synthetic import sphere
from hrcneuro.eeg.synthetic.head import CH_NAMES, head


def test_one_shell_has_the_potential_of_a_homogeneous_sphere(monkeypatch):
    # On the surface of one conductor the series has a closed form (Brody et al. 1973).
    monkeypatch.setattr(sphere, "CONDUCTIVITIES", (0.33,) * 4)
    rng = np.random.default_rng(0)
    electrodes = rng.standard_normal((6, 3))
    electrodes *= 0.09 / np.linalg.norm(electrodes, axis=1, keepdims=True)
    dipoles = rng.uniform(-0.035, 0.035, (7, 3))
    d = electrodes[:, None] - dipoles[None]
    far = np.linalg.norm(d, axis=2, keepdims=True)
    edge = 0.09**2 - (electrodes[:, None] * dipoles[None]).sum(axis=2, keepdims=True) + 0.09 * far
    closed = 2 * d / far**3 + (electrodes[:, None] + 0.09 * d / far) / (0.09 * edge)
    np.testing.assert_allclose(sphere.potential(electrodes, dipoles), closed / (4 * np.pi * 0.33), rtol=1e-9, atol=1e-9)


def test_four_shells_have_the_potential_of_mne():
    model = head()
    info = mne.create_info(list(CH_NAMES), 1000.0, "eeg")
    info.set_montage(
        mne.channels.make_dig_montage(dict(zip(CH_NAMES, model.electrodes, strict=True)), coord_frame="head")
    )
    shells = mne.make_sphere_model((0.0, 0.0, 0.0), 0.0965, verbose="error")
    few = model.dipoles[::40]
    grid = {"rr": few, "nn": np.tile([0.0, 0.0, 1.0], (len(few), 1))}
    sources = mne.setup_volume_source_space(pos=grid, sphere=shells, verbose="error")
    made = mne.make_forward_solution(info, None, sources, shells, meg=False, mindist=0.0, verbose="error")
    theirs = made["sol"]["data"].reshape(len(CH_NAMES), len(few), 3) * 1e-3
    # MNE approximates the series by three dipoles.
    np.testing.assert_allclose(model.gain[:, ::40], theirs, atol=0.005 * np.abs(theirs).max())


def test_the_series_has_ended():
    deepest = head().dipoles[np.linalg.norm(head().dipoles, axis=1).argmax()]
    before = sphere.potential(head().electrodes, deepest[None])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sphere, "_TERMS", 2 * sphere._TERMS)
        after = sphere.potential(head().electrodes, deepest[None])
    np.testing.assert_allclose(before, after, rtol=0, atol=1e-12 * np.abs(after).max())
