"""hrcneuro: a neuro-robotics study that anyone can rerun, question and extend (Ehrlich et al., PLoS ONE 2023)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from hrcneuro.api import Study

__version__ = "0.1.0"


def open(folder: str | Path = ".") -> Study:
    """Return the study whose working folder, or whose ``results``, this is: its artifacts as MNE and pandas objects."""
    from hrcneuro.api import open as open_study

    return open_study(folder)
