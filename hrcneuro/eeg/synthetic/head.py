"""The forward model: electrodes of the study on a spherical head, and what a dipole in it gives at each of them."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

EEG = (
    "Fp1", "Fp2", "F3", "F4", "F7", "F8", "FC1", "FC2", "FC5", "FC6", "C3", "C4", "T7", "T8",
    "CP5", "CP6", "P3", "P4", "P7", "P8", "TP9", "TP10", "O1", "O2", "Fz", "Cz", "Pz",
)  # fmt: skip
EOG = ("EOG1", "EOG2", "EOG3")
CH_NAMES = EEG + EOG
CH_TYPES = ("eeg",) * len(EEG) + ("eog",) * len(EOG)
MASTOIDS = (EEG.index("TP9"), EEG.index("TP10"))

# Left and right outer canthus and forehead (Schlögl et al. 2007), by their nearest neighbours in the 10-05 system.
_EOG_SITES = {"EOG1": "AF9", "EOG2": "AF10", "EOG3": "Fpz"}
# Cortex in a head of about 95 mm: no dipoles deeper than 40 mm from the centre, none below the ear line's basin.
_SHELL_M = (0.025, 0.072)
_FLOOR_M = -0.03
_STEP_M = 0.009


@dataclass(frozen=True)
class Head:
    """A spherical head: electrodes and a grid of possible dipoles, head coordinates relative to the sphere's centre."""

    electrodes: np.ndarray  # (30, 3) m
    dipoles: np.ndarray  # (n, 3) m
    gain: np.ndarray  # (30, n, 3) µV per nA·m, reference at infinity


@lru_cache(maxsize=1)
def head() -> Head:
    """Return the head model, computed by MNE's four-layer sphere on first use (about a second, then kept).

    The electrodes are those of MNE's 10-05 montage; the sphere is fitted to them. Nothing is downloaded.
    """
    import mne

    sites = _montage()
    info = mne.create_info(list(CH_NAMES), 1000.0, "eeg", verbose="error")
    info.set_montage(sites, verbose="error")
    sphere = mne.make_sphere_model("auto", "auto", info, verbose="error")
    centre = np.asarray(sphere["r0"])
    grid = _grid()
    normals = np.tile([0.0, 0.0, 1.0], (len(grid), 1))
    sources = mne.setup_volume_source_space(pos={"rr": grid + centre, "nn": normals}, sphere=sphere, verbose="error")
    forward = mne.make_forward_solution(info, None, sources, sphere, meg=False, mindist=0.0, n_jobs=1, verbose="error")
    gain = forward["sol"]["data"].reshape(len(CH_NAMES), len(grid), 3) * 1e-3  # V per A·m to µV per nA·m
    electrodes = np.array([ch["loc"][:3] for ch in info["chs"]]) - centre
    return Head(electrodes, grid, gain)


def to_mastoids(gain: np.ndarray) -> np.ndarray:
    """Return gains or signals, shape (30, …), against the average of TP9 and TP10, the study's reference (§2.3.3)."""
    return gain - gain[list(MASTOIDS)].mean(axis=0)


def site(name: str) -> np.ndarray:
    """Return the direction of an electrode from the sphere's centre, shape (3,), length 1."""
    where = head().electrodes[CH_NAMES.index(name)]
    return where / np.linalg.norm(where)


def topography(
    where: np.ndarray, *, depth: float, tilt: np.ndarray, jitter_m: float, rng: np.random.Generator
) -> np.ndarray:
    """Return a source's gain at the 30 channels against the mastoids, scaled to a peak of one over the EEG.

    Args:
        where: Direction from the sphere's centre to the scalp above the source, shape (3,).
        depth: Distance from the centre as a share of the electrodes'.
        tilt: Added to the radial orientation, shape (3,): zero gives a field centred above the source.
        jitter_m: SD of the place over subjects, metres.
        rng: The subject's generator.
    """
    model = head()
    radius = np.linalg.norm(model.electrodes, axis=1).mean()
    place = where * depth * radius + jitter_m * rng.standard_normal(3)
    nearest = int(np.argmin(np.linalg.norm(model.dipoles - place, axis=1)))
    orientation = where + tilt + 5 * jitter_m * rng.standard_normal(3)
    gain = to_mastoids(model.gain[:, nearest] @ (orientation / np.linalg.norm(orientation)))
    return gain / np.abs(gain[: len(EEG)]).max()


def _montage() -> object:
    import mne

    # MNE 1.13 renamed the montage and warns at the old name.
    known = {m if isinstance(m, str) else m[0] for m in mne.channels.get_builtin_montages()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)
        standard = mne.channels.make_standard_montage("colin27_1005" if "colin27_1005" in known else "standard_1005")
    at = standard.get_positions()
    places = {name: at["ch_pos"][_EOG_SITES.get(name, name)] for name in CH_NAMES}
    # Two channels may not share a place with another; Fpz, AF9 and AF10 are no channels of the study.
    return mne.channels.make_dig_montage(
        places, nasion=at["nasion"], lpa=at["lpa"], rpa=at["rpa"], coord_frame=at["coord_frame"]
    )


def _grid() -> np.ndarray:
    axis = np.arange(-0.081, 0.0811, _STEP_M)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    radius = np.linalg.norm(points, axis=1)
    return points[(radius > _SHELL_M[0]) & (radius < _SHELL_M[1]) & (points[:, 2] > _FLOOR_M)]
