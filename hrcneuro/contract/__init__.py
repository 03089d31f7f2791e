"""What a stage is, what a drawing is, and how both declare their options: all that the pipeline asks of either.

A stage (``hrcneuro/stages/NAME.py``) computes numbers; its file ends with ``STAGE = Stage(...)``. A drawing
(``hrcneuro/drawings/NAME.py``) makes pictures from artifacts alone, so that another colour computes nothing; its file
ends with ``DRAWINGS = Drawings(...)``. Both are handed the files that they declare, and nothing else.
"""

from __future__ import annotations

from hrcneuro.contract.drawings import Caption, Drawing, Drawings
from hrcneuro.contract.inputs import (
    ASKED_BY,
    EVIDENCE,
    GROUP,
    OF_ALL,
    SWEEP,
    Inputs,
    Of,
    Read,
    Reads,
    is_piece,
)
from hrcneuro.contract.options import chosen, option, params, plain
from hrcneuro.contract.stages import Sessions, SideResult, Stage, Summary, Work

__all__ = [
    "ASKED_BY",
    "EVIDENCE",
    "GROUP",
    "OF_ALL",
    "SWEEP",
    "Caption",
    "Drawing",
    "Drawings",
    "Inputs",
    "Of",
    "Read",
    "Reads",
    "Sessions",
    "SideResult",
    "Stage",
    "Summary",
    "Work",
    "chosen",
    "is_piece",
    "option",
    "params",
    "plain",
]
