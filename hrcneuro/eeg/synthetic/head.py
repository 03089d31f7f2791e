"""The forward model: electrodes of the study on a spherical head, and what a dipole in it gives at each of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hrcneuro.eeg.synthetic.sphere import potential

EEG = (
    "Fp1", "Fp2", "F3", "F4", "F7", "F8", "FC1", "FC2", "FC5", "FC6", "C3", "C4", "T7", "T8",
    "CP5", "CP6", "P3", "P4", "P7", "P8", "TP9", "TP10", "O1", "O2", "Fz", "Cz", "Pz",
)  # fmt: skip
EOG = ("EOG1", "EOG2", "EOG3")
CH_NAMES = EEG + EOG
CH_TYPES = ("eeg",) * len(EEG) + ("eog",) * len(EOG)
MASTOIDS = (EEG.index("TP9"), EEG.index("TP10"))

# Millimetres right, forward and up from the centre of the sphere (96.5 mm) that MNE fits to these electrodes, those of
# the face left out: places of the 10-05 system on the Colin27 head (Oostenveld & Praamstra 2001; MNE's montage
# colin27_1005). Left and right outer canthus and forehead (Schlögl et al. 2007) are its AF9, AF10 and Fpz. Numbers,
# since a fit ends elsewhere on another processor.
_PLACES_MM = {
    "Fp1": (-30.0, 99.2, -13.0), "Fp2": (29.3, 100.0, -13.2), "F3": (-50.9, 71.3, 37.8),
    "F4": (51.1, 72.0, 36.4), "F7": (-71.0, 57.7, -15.1), "F8": (72.3, 59.1, -15.8),
    "FC1": (-34.8, 46.3, 77.1), "FC2": (34.0, 46.4, 75.9), "FC5": (-78.0, 36.0, 22.0),
    "FC6": (78.7, 36.7, 22.0), "C3": (-66.3, 8.0, 63.6), "C4": (66.2, 8.2, 62.8),
    "T7": (-85.1, -0.5, -9.7), "T8": (84.1, -0.1, -9.9), "CP5": (-80.6, -28.7, 32.2),
    "CP6": (82.3, -28.9, 32.5), "P3": (-54.2, -59.6, 59.0), "P4": (54.5, -59.7, 59.6),
    "P7": (-73.6, -57.5, 0.4), "P8": (71.9, -57.7, 0.3), "TP9": (-86.7, -33.0, -44.3),
    "TP10": (85.1, -34.2, -44.4), "O1": (-30.7, -96.0, 13.9), "O2": (28.6, -95.9, 13.8),
    "Fz": (-0.4, 77.9, 61.7), "Cz": (-0.5, 12.2, 99.3), "Pz": (-0.8, -60.6, 85.8),
    "EOG1": (-49.6, 77.2, -52.6), "EOG2": (49.8, 76.6, -52.9), "EOG3": (-0.5, 103.7, -8.0),
}  # fmt: skip
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
    """Return the head model, computed on first use (a third of a second, then kept)."""
    electrodes = np.array([_PLACES_MM[name] for name in CH_NAMES]) / 1000
    grid = _grid()
    return Head(electrodes, grid, potential(electrodes, grid) * 1e-3)  # V per A·m to µV per nA·m


def to_mastoids(gain: np.ndarray) -> np.ndarray:
    """Return gains or signals, shape (30, …), against the average of TP9 and TP10, the study's reference (§2.3.3)."""
    return gain - gain[list(MASTOIDS)].mean(axis=0)


def site(name: str) -> np.ndarray:
    """Return the direction of an electrode from the sphere's centre, shape (3,), length 1."""
    where = head().electrodes[CH_NAMES.index(name)]
    return where / np.sqrt(np.sum(where**2))


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
    # einsum, not BLAS, whose last bits depend on the processor.
    gain = to_mastoids(np.einsum("ck,k->c", model.gain[:, nearest], orientation / np.sqrt(np.sum(orientation**2))))
    return gain / np.abs(gain[: len(EEG)]).max()


def _grid() -> np.ndarray:
    axis = np.arange(-0.081, 0.0811, _STEP_M)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    radius = np.linalg.norm(points, axis=1)
    return points[(radius > _SHELL_M[0]) & (radius < _SHELL_M[1]) & (points[:, 2] > _FLOOR_M)]
