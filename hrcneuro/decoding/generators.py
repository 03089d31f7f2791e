"""Generators of random numbers, one for each name, so that nothing depends on what else is drawn."""

from __future__ import annotations

import numpy as np


def named(seed: int, *names: str) -> np.random.Generator:
    """Return the generator of what these names name, in this order."""
    return np.random.default_rng([seed, *"\0".join(names).encode()])
