"""The picture of all subjects' moves, which joins what the log has of them with what the arm made of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Of, Read


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw the moves of the subjects on whose logs an arm has moved; nothing where there is none."""
    from hrcneuro import published
    from hrcneuro.figures import moves as figure
    from hrcneuro.io.tables import read_table

    trials, moves = (
        {unit: read_table(files.path(stage, name, unit=unit)) for unit in files.units(stage)}
        for stage, name in (("acquire", "trials.parquet"), ("robot", "moves.parquet"))
    )
    if moves:
        soa_ms = {scenario: printed.value for scenario, printed in published.SOA_MS.items()}
        figure.draw(moves, trials, soa_ms, config.robot.cell.radius, out / "moves.png")


DRAWINGS = Drawings(
    name="moves",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    group=Drawing(
        captions={
            "moves.png": Caption(
                "Time from onset to onset; distance of the tip from the reference, a line a subject (dashed: the "
                "radius in which the next move is taken); arrival in that radius as a share of the move's duration; "
                "delay from marker to motion",
                "Moves of all subjects",
            )
        },
        reads=(
            Read("acquire", ("trials.parquet",), Of.INCLUDED, required=False),
            Read("robot", ("moves.parquet",), Of.INCLUDED, required=False),
        ),
        options=("robot.cell",),
        draw=draw,
    ),
    chapter="robot",
)
