"""One file per subcommand; each reads artifacts, calls numeric packages, writes artifacts (see contract/)."""

from __future__ import annotations

import functools
import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hrcneuro.contract import Stage

NAMES = (
    "acquire",
    "preprocess",
    "epoch",
    "erp",
    "ersp",
    "rerp",
    "decode",
    "transfer",
    "simulate",
    "robot",
    "calibrate",
)


@functools.cache
def load(name: str) -> Stage:
    """Return the stage of that name, without what it needs to run."""
    stage: Stage = importlib.import_module(f"hrcneuro.stages.{name}").STAGE
    return stage
