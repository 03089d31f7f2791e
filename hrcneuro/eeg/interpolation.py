"""Bad channels from their neighbours by splines on a sphere: as EEGLAB computes them, and as Perrin wrote them."""

from __future__ import annotations

import numpy as np

from hrcneuro.eeg.params import SPLINES

_STIFFNESS = 4
_EEGLAB_TERMS, _PERRIN_TERMS = 7, 50
_PERRIN_LAMBDA = 1e-5
# Positions read from a file lie on their sphere to a few parts in a million (single precision).
_ON_SPHERE = 1e-4
# Fewer points than this, or points in a plane, leave a sphere undetermined.
_MIN_POINTS = 5
_SLAB = 1 << 18


def sphere_centre(positions: np.ndarray) -> np.ndarray:
    """Return the centre of the sphere nearest to the electrodes, ndarray, shape (3,), in the positions' unit.

    Positions on a sphere around the origin, such as EEGLAB's, keep the origin exactly. Too few positions do too.

    Args:
        positions: ndarray, shape (n_channels, 3), any unit.
    """
    radii = np.linalg.norm(positions, axis=1)
    if len(positions) < _MIN_POINTS or np.ptp(radii) <= _ON_SPHERE * radii.mean():
        return np.zeros(3)
    # |p|² = 2 p·c + (r² - |c|²) is linear in the centre c and the bracket.
    system = np.column_stack([2 * positions, np.ones(len(positions))])
    solution, _, rank, _ = np.linalg.lstsq(system, (positions**2).sum(axis=1), rcond=1e-6)
    return solution[:3] if rank == 4 else np.zeros(3)


def weights(good: np.ndarray, bad: np.ndarray, *, method: str, smoothing: float = _PERRIN_LAMBDA) -> np.ndarray:
    """Return the matrix that makes the bad channels from the good ones, ndarray, shape (n_bad, n_good).

    Args:
        good: ndarray, shape (n_good, 3), any unit: the good channels' positions, the sphere's centre taken off.
        bad: ndarray, shape (n_bad, 3), in that unit: the bad channels'.
        method: ``eeglab`` or ``perrin``.
        smoothing: λ of Perrin's splines; the default is MNE's. The smaller, the nearer they pass by the good channels.

    Raises:
        ValueError: The method is unknown.
    """
    if method not in SPLINES:
        raise ValueError(f"method is {method!r}; allowed: {', '.join(SPLINES)}")
    good = good / np.linalg.norm(good, axis=1, keepdims=True)
    bad = bad / np.linalg.norm(bad, axis=1, keepdims=True)
    return _eeglab(good, bad) if method == "eeglab" else _perrin(good, bad, smoothing)


def apply(data: np.ndarray, bad: np.ndarray, good: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Replace the bad channels of ``data`` in place.

    Args:
        data: ndarray, shape (n_channels, n_times), any unit.
        bad: ndarray, shape (n_bad,), rows of the bad channels.
        good: ndarray, shape (n_good,), rows of the good ones.
        matrix: ndarray, shape (n_bad, n_good), see :func:`weights`.

    Returns:
        ``data``.
    """
    whole = np.zeros((len(bad), len(data)))
    whole[:, good] = matrix
    for start in range(0, data.shape[1], _SLAB):
        slab = data[:, start : start + _SLAB]
        slab[bad] = whole @ slab
    return data


def _eeglab(good: np.ndarray, bad: np.ndarray) -> np.ndarray:
    """Weights of ``eeg_interp(…, 'spherical')``: it takes 1 - chord length for Perrin's cosine of the angle.

    The mean of the good channels is taken off, [G; 1] is inverted in the least-squares sense against [v; 0], and the
    mean is added back.
    """
    n = len(good)
    bordered = np.vstack([_spline(1 - _chords(good, good), _EEGLAB_TERMS), np.ones((1, n))])
    tolerance = max(bordered.shape) * np.spacing(np.linalg.norm(bordered, 2))
    inverse = np.linalg.pinv(bordered, rcond=tolerance / np.linalg.norm(bordered, 2))
    centring = np.eye(n) - 1 / n
    return _spline(1 - _chords(bad, good), _EEGLAB_TERMS) @ inverse[:, :n] @ centring + 1 / n


def _perrin(good: np.ndarray, bad: np.ndarray, smoothing: float) -> np.ndarray:
    """Weights of Perrin et al. 1989 (doi:10.1016/0013-4694(89)90180-6)."""
    n = len(good)
    system = np.ones((n + 1, n + 1))
    system[:n, :n] = _spline(good @ good.T, _PERRIN_TERMS) + smoothing * np.eye(n)
    system[n, n] = 0
    target = np.column_stack([_spline(bad @ good.T, _PERRIN_TERMS), np.ones(len(bad))])
    return (target @ np.linalg.pinv(system))[:, :n]


def _spline(cosine: np.ndarray, n_terms: int) -> np.ndarray:
    """g(x) = 1 / 4π Σ (2n + 1) / (n (n + 1))^m Pₙ(x) (Perrin et al. 1989, Eq 3)."""
    n = np.arange(1, n_terms + 1)
    factors = (2 * n + 1) / (n * (n + 1.0)) ** _STIFFNESS / (4 * np.pi)
    return np.polynomial.legendre.legval(cosine, [0, *factors])


def _chords(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.linalg.norm(a[:, None, :] - b[None, :, :], axis=-1)
