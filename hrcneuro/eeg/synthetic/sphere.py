"""The potential of a dipole in a head of four spherical shells: brain, cerebrospinal fluid, skull and scalp.

A series of a fixed number of Legendre terms (Zhang 1995, doi:10.1088/0031-9155/40/3/001) in sums and products alone: no
fit, no BLAS, so that every processor gives the same numbers.
"""

from __future__ import annotations

import numpy as np

RADII = (0.90, 0.92, 0.97, 1.0)
"""Outer radius of each shell over the head's; the shells and their conductivities are those of MNE's sphere model."""

CONDUCTIVITIES = (0.33, 1.0, 0.004, 0.33)
"""S/m, from the inside out."""

_TERMS = 200  # the last ones of a source at 0.85 of the radius are below 1e-12 of its potential


def potential(electrodes: np.ndarray, dipoles: np.ndarray) -> np.ndarray:
    """Return what a dipole of 1 A·m along each axis gives at each electrode, in V, reference at infinity.

    No head is a sphere: each electrode lies on one of its own, whose radius is the electrode's distance (as in MNE).

    Args:
        electrodes: Places relative to the centre, ndarray, shape (n_electrodes, 3), m.
        dipoles: Places inside the brain, ndarray, shape (n_dipoles, 3), m, none at the centre.

    Returns:
        ndarray, shape (n_electrodes, n_dipoles, 3).
    """
    radius = np.sqrt(_dot(electrodes, electrodes))[:, None]
    depth = np.sqrt(_dot(dipoles, dipoles))
    outward, inward = (electrodes / radius)[:, None], (dipoles / depth[:, None])[None]
    cosine = _dot(outward, inward)
    eccentricity = depth / radius
    radial, along = np.zeros(cosine.shape), np.zeros(cosine.shape)
    before, legendre, slope = np.ones(cosine.shape), cosine, np.ones(cosine.shape)  # P₀, P₁, P₁'
    power = np.ones(cosine.shape)
    for n, share in enumerate(_shares(), start=1):
        radial += share * power * n * legendre
        along += share * power * slope
        slope = cosine * slope + (n + 1) * legendre
        before, legendre = legendre, ((2 * n + 1) * cosine * legendre - n * before) / (n + 1)
        power = power * eccentricity
    gain: np.ndarray = radial[..., None] * inward + along[..., None] * (outward - cosine[..., None] * inward)
    return gain / (4 * np.pi * CONDUCTIVITIES[0] * radius * radius)[..., None]


def _shares() -> list[float]:
    """Return, for the terms from the first on, the scalp's potential over that of the source without any boundary.

    In each shell a term is a part that grows outward and one that decays; no current leaves the scalp, and potential
    and current are steady across every boundary.
    """
    shares = []
    for n in range(1, _TERMS + 1):
        growing, decaying = 1.0, n / (n + 1)
        scalp = growing + decaying
        outer = 1.0
        for k in range(len(RADII) - 2, -1, -1):
            step = RADII[k] / outer
            grown = shrunk = 1.0
            for _ in range(n):
                grown *= step
                shrunk /= step
            growing, decaying, outer = growing * grown, decaying * shrunk / step, RADII[k]
            value = growing + decaying
            current = CONDUCTIVITIES[k + 1] / CONDUCTIVITIES[k] * (n * growing - (n + 1) * decaying)
            growing, decaying = ((n + 1) * value + current) / (2 * n + 1), (n * value - current) / (2 * n + 1)
        source = decaying
        for _ in range(n + 1):
            source *= outer
        shares.append(scalp / source)
    return shares


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    # In a fixed order: the sums of matrix products depend on the processor.
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
