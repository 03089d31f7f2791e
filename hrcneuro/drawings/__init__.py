"""Which artifacts become which pictures: one file a stage, and one for each picture that joins stages.

A drawing reads files and calls ``figures/``, which turns arrays into pictures; it is a task of its own in the cache, so
that a colour, or another version of Matplotlib, computes no number anew.
"""

from __future__ import annotations

import functools
import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hrcneuro.contract import Drawings

STAGES = ("preprocess", "epoch", "erp", "ersp", "rerp", "decode", "transfer", "simulate", "robot", "calibrate")
JOINT = ("quality", "cases", "confound", "moves")
NAMES = STAGES + JOINT


@functools.cache
def load(name: str) -> Drawings:
    """Return the drawings of a stage, or of several that a picture joins."""
    drawings: Drawings = importlib.import_module(f"hrcneuro.drawings.{name}").DRAWINGS
    return drawings
