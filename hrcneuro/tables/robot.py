"""The tables of the stage robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.io.tables import Column, Table
from hrcneuro.paradigm.design import T_F_S
from hrcneuro.paradigm.grid import SIZE
from hrcneuro.robot import measure
from hrcneuro.robot.record import PHASES, Telemetry
from hrcneuro.robot.session import ExecutedMove
from hrcneuro.robot.workspace import Workspace

_JOINTS = ("base", "shoulder", "elbow", "wrist 1", "wrist 2", "wrist 3")


def _joint_columns(name: str, unit: str, text: str) -> dict[str, Column]:
    suffix = unit.replace("/", "_")
    return {f"{name}_{i}_{suffix}": Column("float32", unit, f"{text}, {joint}") for i, joint in enumerate(_JOINTS, 1)}


TELEMETRY = Table(
    1,
    "one row a control cycle (125 Hz); frame: the controller's base",
    {
        "time_s": Column("float", "s", "start of the cycle, from the session's start"),
        "phase": Column("category", "", "home, approach, identify, move, rest or stop"),
        "move": Column("int", "", "index of the move, a row of moves.parquet; -1 between moves"),
        **_joint_columns("q", "rad", "measured angle"),
        **_joint_columns("q_command", "rad", "angle that the commands since the phase began add up to"),
        **_joint_columns("qd", "rad/s", "measured velocity"),
        **_joint_columns("qd_command", "rad/s", "velocity sent in this cycle"),
        **{f"tool_{a}_m": Column("float32", "m", f"measured tip, {a}") for a in "xyz"},
        **{f"tool_r{a}_rad": Column("float32", "rad", f"measured rotation vector of the tool, {a}") for a in "xyz"},
        **{f"reference_{a}_m": Column("float32", "m", f"where the tip should be, {a}; null where none") for a in "xyz"},
        "safety_bits": Column("int", "", "safety_status_bits: 1 normal, 4 protective stop, 128 emergency stop"),
        "limit_bits": Column("int", "", "1 speed, 2 acceleration, 4 joint range, 8 keep-inside box, 16 no number"),
        "speed_scaling": Column("float32", "", "the speed slider, 0..1"),
    },
)

MOVES = Table(
    1,
    "one row a move; figures are null where the grid's edge stopped it",
    {
        "move": Column("int", "", "index, as in telemetry.parquet"),
        "scenario": Column("category", "", "sC or iC"),
        "practice": Column("bool", "", "move of a practice block"),
        "block": Column("int", "", "block"),
        "episode": Column("int", "", "episode in the block"),
        "trial": Column("int", "", "move in the episode, from 0"),
        "start_row": Column("int", "tiles", "tile before the move"),
        "start_col": Column("int", "tiles", "tile before the move"),
        "row": Column("int", "tiles", "tile after the move"),
        "col": Column("int", "tiles", "tile after the move"),
        "flowed": Column("bool", "", "took over from the move before within the radius, without rest"),
        "clamped": Column("bool", "", "the grid's edge stopped the move: the arm dwelt"),
        "t_f_s": Column("float", "s", "duration asked for"),
        "onset_s": Column("float", "s", "t = 0: cycle of the first non-zero command, from the session's start"),
        "marker_s": Column("float", "s", "when the marker had gone out, from the session's start; null without motion"),
        "marker_latency_ms": Column("float", "ms", "onset to marker; zero on a virtual clock, which stands in a cycle"),
        "stim_sample": Column("int", "samples", "first sample with the marker, of a recording begun with the session"),
        "stim_latency_ms": Column("float", "ms", "onset to that sample; null where the recording's rate is unknown"),
        "lsl_s": Column("float", "s", "stamp of the marker on LSL's clock: of the onset; null without LSL"),
        "duration_s": Column("float", "s", "onset to arrival: the tip rests at its goal"),
        "max_error_mm": Column("float", "mm", "greatest distance from the reference"),
        "end_error_mm": Column("float", "mm", "distance from the tile's centre on arrival"),
        "height_error_mm": Column("float", "mm", "greatest departure from the height above the screen"),
        "tilt_deg": Column("float", "degree", "greatest departure from the orientation"),
        "t_2mm_s": Column("float", "s", "onset to the last entry into the radius in which a command is accepted"),
        "peak_speed_m_s": Column("float", "m/s", "greatest speed of the tip"),
        "peak_qd_rad_s": Column("float", "rad/s", "greatest joint velocity"),
        "peak_qdd_rad_s2": Column("float", "rad/s^2", "greatest joint acceleration"),
        "jerk_cost": Column("float", "", "integrated squared jerk of the tip over Eq 1-2's own, 720 d^2 / t_f^5"),
        "trigger_latency_ms": Column(
            "float", "ms", "onset_s to the onset of the measured motion (Eq 2 fitted); null in a flow"
        ),
        "behind_log_ms": Column("float", "ms", "onset interval from the move before, less the log's"),
    },
)

TIMING = Table(
    1,
    "one row a quantity: its distribution (paper 2.3.4)",
    {
        "quantity": Column("category", "", "trigger_, marker_, stim_latency, cycle, each with its jitter; behind_log"),
        "n": Column("int", "", "number of values"),
        "mean_ms": Column("float", "ms", "mean"),
        "sd_ms": Column("float", "ms", "standard deviation"),
        "median_ms": Column("float", "ms", "median"),
        "p1_ms": Column("float", "ms", "1st percentile"),
        "p99_ms": Column("float", "ms", "99th percentile"),
        "low_ms": Column("float", "ms", "least"),
        "high_ms": Column("float", "ms", "greatest"),
    },
)


REACH = Table(
    1,
    "one row a tile: how well the arm reaches it with the tool pointing down; frame: the controller's base",
    {
        "row": Column("int", "tiles", "row, 0 nearest to the arm"),
        "col": Column("int", "tiles", "column, 0 at the subject's left"),
        **{f"tool_{a}_m": Column("float", "m", f"tip over the tile's centre, {a}") for a in "xyz"},
        **{f"q_{i}_rad": Column("float", "rad", f"angle there, {joint}") for i, joint in enumerate(_JOINTS, 1)},
        "singular_value": Column("float", "", "smallest of the Jacobian at the tip (m and rad); 0 at a singularity"),
        "condition": Column("float", "", "greatest over smallest singular value"),
        "speed_share": Column("float", "", "of its greatest speed, the quickest joint in a move from there in 0.6 s"),
    },
)


def reach(workspace: Workspace) -> pd.DataFrame:
    """Return the rows of reach.parquet."""
    reach, share = workspace.reach, workspace.speed_share(T_F_S[0])
    rows = []
    for tile in np.ndindex(SIZE, SIZE):
        place = dict(zip(("tool_x_m", "tool_y_m", "tool_z_m"), workspace.position(*tile), strict=True))
        angles = {f"q_{i}_rad": angle for i, angle in enumerate(reach.q[tile], 1)}
        worth = {"singular_value": reach.singular_value[tile], "condition": reach.condition[tile]}
        rows.append({"row": tile[0], "col": tile[1]} | place | angles | worth | {"speed_share": share[tile]})
    return pd.DataFrame(rows)


def telemetry(record: Telemetry, tip: measure.Tip, q_command: np.ndarray) -> dict[str, Any]:
    """Return the columns of telemetry.parquet.

    Args:
        record: Every cycle.
        tip: Of :func:`hrcneuro.robot.measure.tip`.
        q_command: Of :func:`hrcneuro.robot.measure.commanded_angles`.
    """
    columns: dict[str, Any] = {
        "time_s": record.time,
        "phase": np.array(PHASES, dtype=object)[record.phase],
        "move": record.move,
    }
    for name, unit, values in (
        ("q", "rad", record.q),
        ("q_command", "rad", q_command),
        ("qd", "rad_s", record.qd),
        ("qd_command", "rad_s", record.command),
    ):
        columns |= {f"{name}_{i + 1}_{unit}": values[:, i] for i in range(6)}
    for i, axis in enumerate("xyz"):
        columns[f"tool_{axis}_m"] = tip.position[:, i]
        columns[f"tool_r{axis}_rad"] = tip.rotation[:, i]
        columns[f"reference_{axis}_m"] = record.reference[:, i]
    return columns | {
        "safety_bits": record.safety,
        "limit_bits": record.limits,
        "speed_scaling": record.scaling,
    }


def moves(
    executed: Sequence[ExecutedMove], measures: Mapping[str, np.ndarray], stamps: Mapping[int, float]
) -> pd.DataFrame:
    """Return the rows of moves.parquet.

    Args:
        executed: The moves.
        measures: Of :func:`hrcneuro.robot.measure.measure_moves` and :func:`hrcneuro.robot.measure.marker_timing`.
        stamps: Move -> its marker's stamp on LSL's clock, seconds.
    """
    rows = [
        {
            "move": one.index,
            "scenario": one.move.scenario,
            "practice": one.move.practice,
            "block": one.move.block,
            "episode": one.move.episode,
            "trial": one.move.trial,
            "start_row": one.move.start[0],
            "start_col": one.move.start[1],
            "row": one.move.end[0],
            "col": one.move.end[1],
            "flowed": one.flowed,
            "clamped": one.move.dwells,
            "t_f_s": one.move.t_f,
            "onset_s": one.began,
            "marker_s": one.track.marked,
            "lsl_s": stamps.get(one.index, np.nan),
            "duration_s": one.track.end - one.began,
        }
        for one in executed
    ]
    table = pd.DataFrame(rows, columns=[name for name in MOVES.columns if name not in measures]).assign(**measures)
    return table.assign(stim_sample=pd.array(measures["stim_sample"], dtype="Int64"))


def timing(spread: Mapping[str, Mapping[str, float]]) -> pd.DataFrame:
    """Return the rows of timing.parquet."""
    rows = [
        {"quantity": name, "n": int(v["n"])} | {f"{k}_ms": x for k, x in v.items() if k != "n"}
        for name, v in spread.items()
    ]
    return pd.DataFrame(rows, columns=list(TIMING.columns))
