"""The pictures of robot: where the arm went and how closely, how punctual it was, and the cell it stands in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Read


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw one subject's session from its tables."""
    from hrcneuro.figures import robot, robot_cell
    from hrcneuro.io.tables import read_table

    telemetry, moves, timing, reach = (
        read_table(files.path("robot", f"{name}.parquet")) for name in ("telemetry", "moves", "timing", "reach")
    )
    limit = robot.LIMIT if config.robot.backend == "sim" else robot.LIMIT_SOCKETS
    robot.robot(telemetry, moves, config.robot.cell, out / "robot.png", limit=limit)
    robot.timing(telemetry, moves, timing, out / "timing.png")
    robot_cell.reach(reach, config.robot.cell, out / "reach.png")


DRAWINGS = Drawings(
    name="robot",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    subject=Drawing(
        captions={
            "robot.png": Caption(
                "The tip over the tiles, its distance from the reference, and when it comes into the 2 mm radius",
                "Path and tracking error",
            ),
            "timing.png": Caption(
                "Timing (§ 2.3.4), as far as the arm's clock has any: from marker to motion onset, from command to "
                "marker, control cycles, and onsets behind the log's",
                "Timing",
            ),
            "reach.png": Caption(
                "The cell, how far each of its tiles is from a singularity, and how fast the joints must turn there",
                "Cell",
            ),
        },
        reads=(Read("robot", ("telemetry.parquet", "moves.parquet", "timing.parquet", "reach.parquet")),),
        options=("robot.backend", "robot.cell"),
        draw=draw,
    ),
)
