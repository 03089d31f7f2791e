"""What a session was like: tool poses, a row of measures a move, and the timing that § 2.3.4 asks for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hrcneuro.robot import kinematics
from hrcneuro.robot.backend import PERIOD
from hrcneuro.robot.minimum_jerk import minimum_jerk, minimum_jerk_cost
from hrcneuro.robot.record import Telemetry
from hrcneuro.robot.session import ExecutedMove
from hrcneuro.robot.workspace import DOWN, Workspace

_CHUNK = 8192  # cycles at a time: the chain of frames takes 900 bytes a cycle
_WINDOW = 13  # cycles of the polynomial that smooths the tip's velocity before its jerk is taken


@dataclass(frozen=True)
class Tip:
    """The tool's tip in ``base``: arrays over cycles."""

    position: np.ndarray  # (n, 3), metres
    velocity: np.ndarray  # (n, 3), m/s
    rotation: np.ndarray  # (n, 3), rotation vector, radians, on the branch of (0, π, 0)
    tilt: np.ndarray  # (n,), angle to the orientation that is to be kept, radians


def tip(telemetry: Telemetry, *, tool: float) -> Tip:
    """Return the measured tip of every cycle, from the measured joints."""
    parts = [
        _tip(telemetry.q[i : i + _CHUNK], telemetry.qd[i : i + _CHUNK], tool)
        for i in range(0, len(telemetry.q), _CHUNK)
    ]
    return Tip(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _tip(q: np.ndarray, qd: np.ndarray, tool: float) -> tuple[np.ndarray, ...]:
    pose, jacobian = kinematics.pose_and_jacobian(q, tool=tool)
    velocity = np.einsum("nij,nj->ni", jacobian[:, :3], qd)
    rotation = kinematics.rotation_vector(pose[:, :3, :3])
    # Angles near π jump between an axis and its opposite; one branch is kept.
    angle = np.linalg.norm(rotation, axis=1, keepdims=True)
    flip = rotation[:, 1:2] < 0
    rotation = np.where(flip & (angle > 0), rotation - 2 * np.pi * rotation / np.maximum(angle, 1e-12), rotation)
    turn = kinematics.rotation_vector(DOWN @ np.swapaxes(pose[:, :3, :3], 1, 2))
    return pose[:, :3, 3], velocity, rotation, np.linalg.norm(turn, axis=1)


def fit_onset(time: np.ndarray, progress: np.ndarray, t_f: float) -> float:
    """Return when Eq 2 of duration ``t_f`` begins that fits a measured motion best, seconds on the axis of ``time``.

    A threshold on speed would come 24 to 68 ms late, the more the slower the move; the fit does not.

    Args:
        time: Instants, shape (n,), seconds.
        progress: Share of the way covered at those instants, shape (n,).
        t_f: The duration, seconds.
    """
    onset = float(np.interp(0.5, progress, time)) - 0.5 * t_f
    for _ in range(20):
        s, rate, _, _ = minimum_jerk((time - onset) / t_f)
        slope = -rate / t_f
        step = float(slope @ (progress - s)) / float(slope @ slope)
        onset += step
        if abs(step) < 1e-9:
            break
    return onset


def measure_moves(
    executed: Sequence[ExecutedMove], telemetry: Telemetry, tool_tip: Tip, workspace: Workspace
) -> dict[str, np.ndarray]:
    """Return each of :data:`MEASURES`: name -> ndarray, shape (n_moves,); nan where the grid's edge stopped it."""
    jerk = _squared_jerk(tool_tip.velocity)
    rows = [_measure(one, telemetry, tool_tip, jerk, workspace) for one in executed]
    return {name: np.array([row[name] for row in rows], float) for name in MEASURES}


def _measure(
    one: ExecutedMove, telemetry: Telemetry, tool_tip: Tip, jerk: np.ndarray, workspace: Workspace
) -> dict[str, float]:
    if not one.moved:
        return dict.fromkeys(MEASURES, np.nan)
    rows = slice(one.track.first, one.track.last)
    start, goal = (np.array(workspace.position(*tile)) for tile in (one.move.start, one.move.end))
    time, at = telemetry.time[rows] - one.track.onset, tool_tip.position[rows]
    off = np.linalg.norm(at - telemetry.reference[rows], axis=1)
    way = goal - start
    progress = (at - start) @ way / (way @ way)
    qdd = np.abs(np.diff(telemetry.qd[rows], axis=0)) / PERIOD
    return {
        "max_error_mm": 1e3 * off.max(),
        "end_error_mm": 1e3 * float(np.linalg.norm(at[-1] - goal)),
        "height_error_mm": 1e3 * np.abs(at[:, 2] - goal[2]).max(),
        "tilt_deg": float(np.degrees(tool_tip.tilt[rows].max())),
        "t_2mm_s": _arrival(time, np.linalg.norm(at - goal, axis=1), workspace.cell.radius),
        "peak_speed_m_s": float(np.linalg.norm(tool_tip.velocity[rows], axis=1).max()),
        "peak_qd_rad_s": float(np.abs(telemetry.qd[rows]).max()),
        "peak_qdd_rad_s2": float(qdd.max()) if len(qdd) else np.nan,
        "jerk_cost": PERIOD * jerk[rows].sum() / minimum_jerk_cost(float(np.linalg.norm(way)), one.move.t_f),
        "trigger_latency_ms": np.nan if one.flowed else 1e3 * fit_onset(time, progress, one.move.t_f),
    }


MEASURES = (
    "max_error_mm",
    "end_error_mm",
    "height_error_mm",
    "tilt_deg",
    "t_2mm_s",
    "peak_speed_m_s",
    "peak_qd_rad_s",
    "peak_qdd_rad_s2",
    "jerk_cost",
    "trigger_latency_ms",
)


def _arrival(time: np.ndarray, distance: np.ndarray, radius: float) -> float:
    outside = np.flatnonzero(distance > radius)
    if not len(outside):
        return float(time[0])
    last = int(outside[-1])
    if last + 1 == len(time):
        return float("nan")
    # Between the last cycle outside and the first inside, by the distance.
    share = (distance[last] - radius) / (distance[last] - distance[last + 1])
    return float(time[last] + share * (time[last + 1] - time[last]))


def _squared_jerk(velocity: np.ndarray) -> np.ndarray:
    # m²/s⁶ of every cycle; differences of single cycles would show rounding and quantisation, not the motion.
    from scipy.signal import savgol_filter

    if len(velocity) < _WINDOW:
        return np.full(len(velocity), np.nan)
    jerk = savgol_filter(velocity, _WINDOW, 4, deriv=2, delta=PERIOD, axis=0)
    return np.asarray(np.sum(jerk**2, axis=1))


def marker_timing(executed: Sequence[ExecutedMove], *, rate: float) -> dict[str, np.ndarray]:
    """Return when each move's marker was there, and how far its onset lies behind the log's pace.

    Name -> ndarray, shape (n_moves,), of marker_latency_ms, stim_sample, stim_latency_ms and behind_log_ms; nan where
    unknown.

    Args:
        executed: The moves.
        rate: Of the recording whose stim channel takes the markers, Hz; nan where unknown.
    """
    onset = np.array([one.began for one in executed], float)
    marked = np.array([one.track.marked for one in executed], float)
    sample = stim_sample(marked, rate)
    gap = np.array([one.move.gap for one in executed[:-1]], float)
    same = np.array([not one.move.first for one in executed[1:]], bool)
    behind = np.where(same, 1e3 * (np.diff(onset) - gap), np.nan)
    return {
        "marker_latency_ms": 1e3 * (marked - onset),
        "stim_sample": sample,
        "stim_latency_ms": 1e3 * (sample / rate - onset),
        "behind_log_ms": np.r_[np.nan, behind][: len(executed)],
    }


def commanded_angles(telemetry: Telemetry) -> np.ndarray:
    """Return the joint angles that the commands since the phase began add up to, shape (n_cycles, 6), radians."""
    sent = np.zeros_like(telemetry.command)
    sent[1:] = np.cumsum(telemetry.command[:-1] * np.diff(telemetry.time)[:, None], axis=0)
    # The sum starts anew from the measured angles with every phase and move: over a session it would drift.
    change = np.r_[True, (np.diff(telemetry.phase) != 0) | (np.diff(telemetry.move) != 0)]
    begin = np.maximum.accumulate(np.where(change, np.arange(len(change)), 0))
    return np.asarray(telemetry.q[begin] + sent - sent[begin])


def summarise(telemetry: Telemetry, moves: pd.DataFrame, *, stops: int, lead: float) -> dict[str, float | int | None]:
    """Return the session in a few numbers: the largest errors, the median time into the radius, the loop's rate.

    Args:
        telemetry: The session.
        moves: Rows of moves.parquet.
        stops: How often the arm was stopped.
        lead: Of the feed-forward, seconds.
    """
    period = np.diff(telemetry.time)
    real = moves[~moves["clamped"].astype(bool)] if len(moves) else moves
    known = {
        "max_error_mm": real["max_error_mm"].max(),
        "end_error_mm": real["end_error_mm"].max(),
        "t_2mm_s": real["t_2mm_s"].median(),
        "loop_hz": 1.0 / period.mean() if len(period) else np.nan,
        "jitter_p99_ms": np.percentile(np.abs(period - PERIOD), 99) * 1e3 if len(period) else np.nan,
        "lead_ms": 1e3 * lead,
    }
    rounded = {name: round(float(v), 6) if np.isfinite(v) else None for name, v in known.items()}
    return {"moves": len(moves), **rounded, "stops": stops}


_STATISTICS: dict[str, Callable[[np.ndarray], float]] = {
    "mean": np.mean,
    "sd": lambda x: float(np.std(x, ddof=1)) if len(x) > 1 else 0.0,
    "median": np.median,
    "p1": lambda x: float(np.percentile(x, 1)),
    "p99": lambda x: float(np.percentile(x, 99)),
    "low": np.min,
    "high": np.max,
}


def stim_sample(marked: np.ndarray, rate: float) -> np.ndarray:
    """Return in which sample a recording's stim channel first shows markers; nan where either is unknown.

    Args:
        marked: When the markers went out, seconds from the recording's first sample.
        rate: The recording's, Hz.
    """
    # A line that rises between two samples is seen in the later one; a thousandth keeps rounding from costing one.
    return np.asarray(np.ceil(marked * rate - 1e-3))


def timing(
    telemetry: Telemetry, latencies: Mapping[str, np.ndarray], behind: np.ndarray
) -> dict[str, dict[str, float]]:
    """Return the distributions that tell whether the markers can be trusted, quantity -> statistic -> milliseconds.

    Each latency's jitter is its distance from the median.

    Args:
        telemetry: The session.
        latencies: Name -> a value a move, ms; nan where there was none.
        behind: By how much onsets came later than the log has them, ms; nan where the log has none.
    """
    quantities: dict[str, np.ndarray] = {}
    for name, values in latencies.items():
        known = values[np.isfinite(values)]
        quantities[f"{name}_latency"] = known
        quantities[f"{name}_jitter"] = np.abs(known - np.median(known)) if len(known) else known
    period = 1e3 * np.diff(telemetry.time)
    quantities |= {"cycle": period, "cycle_jitter": np.abs(period - 1e3 * PERIOD), "behind_log": behind}
    out: dict[str, dict[str, float]] = {}
    for name, values in quantities.items():
        known = values[np.isfinite(values)]
        if len(known):
            out[name] = {"n": float(len(known))} | {k: float(f(known)) for k, f in _STATISTICS.items()}
    return out
