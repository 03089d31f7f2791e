"""A session: home, find the lead, then one move after the other at the log's pace."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite, nan

import numpy as np

from hrcneuro.errors import HardwareError
from hrcneuro.robot import kinematics, record
from hrcneuro.robot.backend import PERIOD
from hrcneuro.robot.cell import GRID
from hrcneuro.robot.identify import response_lead
from hrcneuro.robot.loop import Loop, Track
from hrcneuro.robot.plan import Move
from hrcneuro.robot.trajectory import BoundedPath, Bounds, Motion, MovingStart, Path, TileMove
from hrcneuro.robot.workspace import DOWN, Workspace

# A tool within half a degree of vertical is righted by the tracking law without a jolt.
_UPRIGHT = np.radians(0.5)


@dataclass(frozen=True)
class Pace:
    """How the session goes from move to move; seconds, metres."""

    approach: Bounds  # between episodes, m
    homing: Bounds  # rad
    pause: float = 0.5  # at the start tile, before an episode
    longest_gap: float = 5.0  # a longer gap of the log is cut to this
    in_radius: bool = False  # the next motion starts within the radius, on the move; else when this one has ended


@dataclass(frozen=True)
class Done:
    """One move as it was executed."""

    index: int
    move: Move
    track: Track
    flowed: bool = False  # it took over from the move before without rest, so it does not begin as Eq 2 does


def go_home(loop: Loop, workspace: Workspace, *, pace: Pace) -> None:
    """Bring the tip above the grid's centre, jerk-limited: up and across where the tool points down, else by joints.

    Raises:
        HardwareError: The arm stands outside the cell, or with another elbow or wrist: nothing moves.
    """
    q = np.array(loop.measured().q)
    pose = kinematics.forward(q, tool=workspace.cell.tool)
    tip, home = pose[:3, 3], workspace.home()
    if not workspace.inside(tip):
        raise HardwareError(
            f"the tool's tip stands at ({tip[0]:.3f}, {tip[1]:.3f}, {tip[2]:.3f}) m, outside the keep-inside box",
            cure="bring it above the screen with the pendant, or correct robot.cell",
        )
    if np.abs(q - home).max() > np.pi / 2:
        joint = int(np.argmax(np.abs(q - home)))
        raise HardwareError(
            f"joint {joint + 1} stands at {np.degrees(q[joint]):.0f}°, home is at {np.degrees(home[joint]):.0f}°: "
            "another elbow or wrist configuration",
            cure="bring the arm near its home position with the pendant",
        )
    tilt = float(np.linalg.norm(kinematics.rotation_vector(DOWN @ pose[:3, :3].T)))
    if tilt > _UPRIGHT:
        loop.follow_joints(BoundedPath(q.tolist(), home.tolist(), pace.homing))
        return
    goal = workspace.home_position()
    lifted = (float(tip[0]), float(tip[1]), max(float(tip[2]), goal[2]))
    for start, end in ((tip.tolist(), lifted), (lifted, goal)):
        workspace.check_way(start, end, near=q)
        loop.follow(BoundedPath(start, end, pace.approach), phase=record.HOME, radius=workspace.cell.radius)


def find_lead(loop: Loop, workspace: Workspace, *, t_f: float = 0.9, tries: int = 3) -> float:
    """Return the lead, seconds, from four tile moves around the grid's centre, which end where they began.

    A round in which a cycle came late is made again, ``tries`` times at most: the most even one counts.
    """
    middle = GRID // 2
    round_trip = [(middle, middle), (middle + 1, middle), (middle + 1, middle + 1), (middle, middle + 1)]
    rounds: list[tuple[float, record.Telemetry]] = []
    while not rounds or (rounds[-1][0] > 1.5 * PERIOD and len(rounds) < tries):
        first = len(loop.record)
        for start, end in zip(round_trip, round_trip[1:] + round_trip[:1], strict=True):
            path = TileMove(workspace.position(*start), workspace.position(*end), t_f)
            loop.follow(path, phase=record.IDENTIFY, radius=workspace.cell.radius)
        telemetry = loop.record.telemetry(first)
        rounds.append((float(np.diff(telemetry.time).max()), telemetry))
    return response_lead(min(rounds, key=lambda one: one[0])[1])


def approach(loop: Loop, workspace: Workspace, tile: tuple[int, int], *, pace: Pace, here: Sequence[float]) -> None:
    """Bring the tip from ``here`` (x, y, z) over ``tile`` in a straight line."""
    # The way was checked before the session: here it would cost a cycle.
    path = BoundedPath(here, workspace.position(*tile), pace.approach)
    loop.follow(path, phase=record.APPROACH, radius=workspace.cell.radius)


def run_session(
    loop: Loop,
    workspace: Workspace,
    moves: Sequence[Move],
    *,
    lead: float | None,
    pace: Pace,
    on_done: Callable[[Done], None],
) -> None:
    """Execute ``moves`` and hand over each as it is done, so that a session that is stopped keeps what it has.

    Args:
        loop: A fresh loop; it is left at rest, not stopped.
        workspace: Where the tiles are.
        moves: The plan, which :func:`hrcneuro.robot.plan.check_paths` has passed.
        lead: Of the feed-forward, seconds; None: measured first.
        pace: Bounds and pauses.
        on_done: Takes every executed move.

    Raises:
        HardwareError: The arm is not where it may start, or was stopped on the way.
    """
    go_home(loop, workspace, pace=pace)
    tile = (GRID // 2, GRID // 2)
    approach(loop, workspace, tile, pace=pace, here=workspace.home_position())
    loop.lead = find_lead(loop, workspace) if lead is None else lead
    due, motion = -np.inf, None
    for index, move in enumerate(moves):
        here = workspace.position(*move.start)
        if move.first:
            if tile != move.start:
                approach(loop, workspace, move.start, pace=pace, here=workspace.position(*tile))
            due = loop.now() + pace.pause
        if motion is None:
            loop.rest(due, at=here)
        gap = min(move.gap, pace.longest_gap) if isfinite(move.gap) else -np.inf
        follower = moves[index + 1] if index + 1 < len(moves) else None
        flows = pace.in_radius and follower is not None and not follower.first and not follower.dwells
        if move.dwells:
            track = dwell(loop, move, here, index)
        else:
            track = tile_move(
                loop, workspace, move, index, motion=motion, handover=loop.now() + gap if flows else np.inf
            )
        on_done(Done(index, move, track, flowed=motion is not None))
        onset = track.onset if isfinite(track.onset) else track.start
        due, motion, tile = onset + gap, track.motion, move.end


def tile_move(
    loop: Loop,
    workspace: Workspace,
    move: Move,
    index: int,
    *,
    motion: Motion | None = None,
    handover: float = np.inf,
) -> Track:
    """Follow one tile move by Eq 1–2, or from ``motion`` where it takes over from the move before."""
    end = workspace.position(*move.end)
    path: Path = TileMove(workspace.position(*move.start), end, move.t_f)
    if motion is not None:
        path = MovingStart(motion, end, move.t_f)
    return loop.follow(path, phase=record.MOVE, move=index, radius=workspace.cell.radius, handover=handover)


def dwell(loop: Loop, move: Move, here: Sequence[float], index: int) -> Track:
    """Stay for the duration of a move that was clamped at the grid's edge."""
    first, start = len(loop.record), loop.now()
    loop.rest(start + move.t_f, at=here, move=index)
    return Track(first, len(loop.record), start, nan, loop.now())
