"""The session's ways, driven by the simulated arm beforehand: what a limit would stop there is refused before a start.

The numbers of a plan tell that the arm reaches a way, and that its joints are quick enough. Whether the speeds of an
approach suit the box, which is looked ahead to by a whole stop, shows only where the loop itself drives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from hrcneuro.paradigm.grid import CENTRE, Tile
from hrcneuro.robot import kinematics, record
from hrcneuro.robot.backend import ArmError, Stopped
from hrcneuro.robot.cell import Position
from hrcneuro.robot.cycle import OnStop
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.parameters import Pace
from hrcneuro.robot.plan import PlannedMove
from hrcneuro.robot.session import LEAD_MOVES, LEAD_T_F
from hrcneuro.robot.sim import LEAD, SimArm, VirtualClock
from hrcneuro.robot.trajectory import BoundedPath, TileMove, Trajectory
from hrcneuro.robot.workspace import Workspace, pose

MakeLoop = Callable[[SimArm, VirtualClock, OnStop], Loop]


class Foreseen(ArmError):
    """A way on which the session would be stopped."""


@dataclass(frozen=True)
class Way:
    """A path that the session follows, or may follow."""

    name: str  # for the message
    start: Position  # tip position (x, y, z) in ``base``, metres
    path: Trajectory
    phase: int
    lead_known: bool = True  # when it is followed


def rehearse(
    moves: Sequence[PlannedMove], workspace: Workspace, *, pace: Pace, lead_given: bool, make_loop: MakeLoop
) -> None:
    """Drive each distinct way of a session once on the simulated arm, at its quickest.

    Args:
        moves: What is about to be replayed, in order.
        workspace: Where the tiles are.
        pace: Bounds of approaches and of the way home.
        lead_given: Whether the session begins with a lead: without one, the arm trails on the first ways.
        make_loop: Returns the session's loop over a simulated arm, its clock and who is told of a stop.

    Raises:
        Foreseen: With the way, and what would stop the arm on it.
    """
    for way in _ways(moves, workspace, pace, lead_given):
        clock, reasons = VirtualClock(), list[BaseException]()
        q = kinematics.inverse(pose(way.start), workspace.reach.q[workspace.tile(way.start)], tool=workspace.cell.tool)
        loop = make_loop(SimArm(clock, q.tolist()), clock, reasons.append)
        loop.lead = LEAD if way.lead_known else None
        try:
            loop.follow(way.path, phase=way.phase, radius=workspace.cell.radius)
        except Stopped as error:
            why = reasons[0] if reasons and isinstance(reasons[0], ArmError) else error
            problem = f"{way.name} the session would be stopped: {why}; nothing has moved"
            raise Foreseen(error.cause, problem) from error


def _ways(moves: Sequence[PlannedMove], workspace: Workspace, pace: Pace, lead_given: bool) -> Iterator[Way]:
    # Where the arm will stand is not known yet: of its ways home, the one up from the centre stands for all.
    home, centre = workspace.home_position(), workspace.position(*CENTRE)
    up, down = BoundedPath(centre, home, pace.approach), BoundedPath(home, centre, pace.approach)
    yield Way("on the way home, up from the grid,", centre, up, record.HOME, lead_given)
    yield Way("on the way from home down to the grid", home, down, record.APPROACH, lead_given)
    if not lead_given:
        for a, b in LEAD_MOVES:
            yield _tile_move("to find the lead, ", workspace, a, b, LEAD_T_F, record.IDENTIFY, lead_known=False)
    approaches, quickest, tile = dict[tuple[Tile, Tile], None](), dict[tuple[Tile, Tile], float](), CENTRE
    for move in moves:
        if move.first and tile != move.start:
            approaches[tile, move.start] = None
        if not move.dwells:
            between = (move.start, move.end)
            quickest[between] = min(move.t_f, quickest.get(between, move.t_f))
        tile = move.end
    for a, b in approaches:
        start, end = workspace.position(*a), workspace.position(*b)
        path = BoundedPath(start, end, pace.approach)
        yield Way(f"on the approach from tile {a} to {b}", start, path, record.APPROACH)
    for (a, b), t_f in quickest.items():
        yield _tile_move("", workspace, a, b, t_f, record.MOVE)


def _tile_move(
    when: str, workspace: Workspace, a: Tile, b: Tile, t_f: float, phase: int, *, lead_known: bool = True
) -> Way:
    start, end = workspace.position(*a), workspace.position(*b)
    name = f"{when}in the move from tile {a} to {b} in {t_f:g} s"
    return Way(name, start, TileMove(start, end, t_f), phase, lead_known)
