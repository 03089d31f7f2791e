"""Stretches of samples in which something holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def spans(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return where a mask, ndarray, shape (n_times,), is true: first sample and first sample after of each stretch."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
