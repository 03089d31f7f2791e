"""The minimum-jerk profile of every tile move (paper Eq 1–2), for whole sets of instants.

Flash & Hogan, J. Neurosci. 1985, doi:10.1523/JNEUROSCI.05-07-01688.1985.
"""

from __future__ import annotations

import numpy as np


def minimum_jerk(u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return Eq 2 and its first three derivatives at the fraction ``u`` = t / t_f of the duration, shape of ``u``.

    Outside 0 … 1 the motion rests at 0 or 1; derivatives are per unit of ``u`` (divide by t_f, t_f², t_f³).
    """
    u = np.clip(u, 0.0, 1.0)
    inside = (u > 0.0) & (u < 1.0)
    s = u**3 * (10.0 + u * (6.0 * u - 15.0))
    return (
        s,
        30.0 * (u * (1.0 - u)) ** 2,
        60.0 * u * (1.0 - u) * (1.0 - 2.0 * u),
        (60.0 - 360.0 * u * (1.0 - u)) * inside,
    )


def minimum_jerk_cost(distance: float, t_f: float) -> float:
    """Return the integrated squared jerk of Eq 1–2 over ``distance`` metres in ``t_f`` seconds: 720 d² / t_f⁵."""
    return 720.0 * distance**2 / t_f**5
