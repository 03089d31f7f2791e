"""What comes before the first request: the way home from where the arm stands, and finding its lead."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hrcneuro.paradigm.grid import CENTRE, Tile
from hrcneuro.robot import kinematics, record
from hrcneuro.robot.backend import PERIOD, ArmError, Cause
from hrcneuro.robot.identify import response_lead
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.parameters import Pace
from hrcneuro.robot.trajectory import BoundedPath, TileMove
from hrcneuro.robot.workspace import DOWN, Flaw, WayError, Workspace

# A tool within half a degree of vertical is righted by the tracking law without a jolt.
_UPRIGHT = np.radians(0.5)
_CORNERS = [(CENTRE[0] + down, CENTRE[1] + right) for down, right in ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))]
# What finds the lead: a round trip of moves from tile to tile, and their duration, seconds.
LEAD_MOVES: tuple[tuple[Tile, Tile], ...] = tuple(pairwise(_CORNERS))
LEAD_T_F = 0.9


def go_home(loop: Loop, workspace: Workspace, *, pace: Pace) -> None:
    """Bring the tip above the grid's centre, jerk-limited: up and across where the tool points down, else by joints.

    Raises:
        ArmError: The arm stands outside the cell, or with another elbow or wrist: nothing moves.
        WayError: The way home leads out of the box or near a singularity: nothing moves.
    """
    q = np.array(loop.measured().q)
    pose = kinematics.forward(q, tool=workspace.cell.tool)
    tip, home = pose[:3, 3], workspace.home()
    if not workspace.inside(tip):
        raise ArmError(
            Cause.STARTS_OUTSIDE,
            f"the tool's tip stands at ({tip[0]:.3f}, {tip[1]:.3f}, {tip[2]:.3f}) m, outside the keep-inside box",
        )
    if np.abs(q - home).max() > np.pi / 2:
        joint = int(np.argmax(np.abs(q - home)))
        raise ArmError(
            Cause.STARTS_FOLDED,
            f"joint {joint + 1} stands at {np.degrees(q[joint]):.0f}°, home is at {np.degrees(home[joint]):.0f}°: "
            "another elbow or wrist configuration",
        )
    tilt = float(np.linalg.norm(kinematics.rotation_vector(DOWN @ pose[:3, :3].T)))
    if tilt > _UPRIGHT:
        turn = BoundedPath(q.tolist(), home.tolist(), pace.homing)
        _check_turn(turn, workspace)
        loop.resume()
        loop.follow_joints(turn)
        return
    goal = workspace.home_position()
    lifted = (float(tip[0]), float(tip[1]), max(float(tip[2]), goal[2]))
    ways = ((tip.tolist(), lifted), (lifted, goal))
    for start, end in ways:
        workspace.check_way(start, end, near=q)
    loop.resume()
    for start, end in ways:
        loop.follow(BoundedPath(start, end, pace.approach), phase=record.HOME, radius=workspace.cell.radius)


def _check_turn(turn: BoundedPath, workspace: Workspace) -> None:
    q = np.array([turn.at(t)[0] for t in np.linspace(0.0, turn.duration, 60)])
    for x, y, z in kinematics.forward(q, tool=workspace.cell.tool)[:, :3, 3]:
        if not workspace.inside((x, y, z)):
            raise WayError(
                Flaw.OUT_OF_BOX,
                f"the way home, by joints, leads through ({x:.3f}, {y:.3f}, {z:.3f}) m, outside the keep-inside box",
            )


def find_lead(loop: Loop, workspace: Workspace, *, t_f: float = LEAD_T_F, tries: int = 3) -> float:
    """Return the lead, seconds, from four tile moves around the grid's centre, which end where they began.

    A round in which a cycle came late is made again, ``tries`` times at most: the most even one counts.
    """
    rounds: list[tuple[float, record.Telemetry]] = []
    while not rounds or (rounds[-1][0] > 1.5 * PERIOD and len(rounds) < tries):
        first = len(loop.record)
        for start, end in LEAD_MOVES:
            path = TileMove(workspace.position(*start), workspace.position(*end), t_f)
            loop.follow(path, phase=record.IDENTIFY, radius=workspace.cell.radius)
        telemetry = loop.record.telemetry(first)
        rounds.append((float(np.diff(telemetry.time).max()), telemetry))
    return response_lead(min(rounds, key=lambda one: one[0])[1])


def check_lead(lead: float, *, most: float) -> None:
    """Refuse an arm whose answers are late all the time: the age of packets counts from the quickest, and shows none.

    Args:
        lead: The measured one, seconds.
        most: The greatest allowed, seconds.

    Raises:
        ArmError: It is greater.
    """
    if lead > most:
        raise ArmError(
            Cause.SLOW_ANSWER,
            f"the measured lead is {1e3 * lead:.0f} ms: so long after a command its effect is seen; "
            f"{1e3 * most:.0f} ms are allowed (robot.max_lead_s)",
        )
