"""One file per subcommand; each reads artifacts, calls numeric packages, writes artifacts (see contract.py)."""

from __future__ import annotations

import importlib
from types import ModuleType

NAMES = ("acquire", "preprocess", "epoch", "erp", "ersp", "decode", "simulate", "robot")


def load(name: str) -> ModuleType:
    """Return the module of a stage."""
    return importlib.import_module(f"hrcneuro.stages.{name}")
