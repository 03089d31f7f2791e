"""The session's ways, driven by the simulated arm beforehand: what a limit would stop there is refused before a start.

The numbers of a plan tell that the arm reaches a way, and that its joints are quick enough. Whether the speeds of an
approach suit the box, which is looked ahead to by a whole stop, shows only where the loop itself drives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from hrcneuro.paradigm.grid import CENTRE, Tile
from hrcneuro.robot import kinematics, record
from hrcneuro.robot.backend import ArmError, Stopped
from hrcneuro.robot.cell import Position
from hrcneuro.robot.cycle import OnStop
from hrcneuro.robot.homing import LEAD_MOVES, LEAD_T_F
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.parameters import Pace
from hrcneuro.robot.plan import PlannedMove
from hrcneuro.robot.sim import LEAD, SimArm, VirtualClock
from hrcneuro.robot.trajectory import BoundedPath, MovingStart, TileMove, Trajectory
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
    onward: tuple[Position, float] | None = None  # a move that takes over in the radius: its end, metres; seconds


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
        drive(way, workspace, make_loop=make_loop)


def drive(way: Way, workspace: Workspace, *, make_loop: MakeLoop, so: str = "nothing has moved") -> None:
    """Drive a way on the simulated arm.

    Args:
        way: From rest to rest. A move that takes over does so as early as it may, when the arm is quickest.
        workspace: Where the tiles are.
        make_loop: As of :func:`rehearse`.
        so: What the message says of the arm itself.

    Raises:
        Foreseen: With the way, and what would stop the arm on it.
    """
    clock, reasons = VirtualClock(), list[BaseException]()
    q = kinematics.inverse(pose(way.start), workspace.reach.q[workspace.tile(way.start)], tool=workspace.cell.tool)
    loop = make_loop(SimArm(clock, q.tolist()), clock, reasons.append)
    loop.lead = LEAD if way.lead_known else None
    try:
        near = None if way.onward is None else _at_once
        track = loop.follow(way.path, phase=way.phase, radius=workspace.cell.radius, near=near)
        if way.onward is not None and track.motion is not None:
            loop.follow(MovingStart(track.motion, *way.onward), phase=way.phase, radius=workspace.cell.radius)
    except Stopped as error:
        why = reasons[0] if reasons and isinstance(reasons[0], ArmError) else error
        raise Foreseen(error.cause, f"{way.name} the session would be stopped: {why}; {so}") from error


def _at_once(when: float) -> bool:
    return True


def opening(workspace: Workspace, pace: Pace, lead_given: bool) -> Iterator[Way]:
    """Return the ways of every session before its first request; without a lead given, it is not known on them."""
    # Where the arm will stand is not known yet: of its ways home, the one up from the centre stands for all.
    home, centre = workspace.home_position(), workspace.position(*CENTRE)
    up, down = BoundedPath(centre, home, pace.approach), BoundedPath(home, centre, pace.approach)
    yield Way("on the way home, up from the grid,", centre, up, record.HOME, lead_given)
    yield Way("on the way from home down to the grid", home, down, record.APPROACH, lead_given)
    if not lead_given:
        for a, b in LEAD_MOVES:
            yield tile_move(
                workspace, a, b, LEAD_T_F, when="to find the lead, ", phase=record.IDENTIFY, lead_known=False
            )


def _ways(moves: Sequence[PlannedMove], workspace: Workspace, pace: Pace, lead_given: bool) -> Iterator[Way]:
    yield from opening(workspace, pace, lead_given)
    approaches, quickest, tile = dict[tuple[Tile, Tile], None](), dict[tuple[Tile, Tile], float](), CENTRE
    flowing = dict[tuple[Tile, Tile, Tile], tuple[float, float]]()
    for before, move in pairwise(moves):
        if pace.start_next == "in_radius" and not (move.first or move.dwells or before.dwells):
            key = before.start, move.start, move.end
            known = flowing.get(key, (before.t_f, move.t_f))
            flowing[key] = min(known[0], before.t_f), min(known[1], move.t_f)
    for move in moves:
        if move.first and tile != move.start:
            approaches[tile, move.start] = None
        if not move.dwells:
            between = (move.start, move.end)
            quickest[between] = min(move.t_f, quickest.get(between, move.t_f))
        tile = move.end
    for a, b in approaches:
        yield approach(workspace, pace, a, b)
    for (a, b), t_f in quickest.items():
        yield tile_move(workspace, a, b, t_f)
    for tiles, durations in flowing.items():
        yield flowing_move(workspace, tiles, durations)


def approach(workspace: Workspace, pace: Pace, a: Tile, b: Tile) -> Way:
    """Return the way from over one tile to over another, between episodes."""
    start, end = workspace.position(*a), workspace.position(*b)
    path = BoundedPath(start, end, pace.approach)
    return Way(f"on the approach from tile {a} to {b}", start, path, record.APPROACH)


def tile_move(
    workspace: Workspace,
    a: Tile,
    b: Tile,
    t_f: float,
    *,
    when: str = "",
    phase: int = record.MOVE,
    lead_known: bool = True,
) -> Way:
    """Return the way of a move from tile to tile in ``t_f`` seconds; ``when`` begins what it is called."""
    start, end = workspace.position(*a), workspace.position(*b)
    name = f"{when}in the move from tile {a} to {b} in {t_f:g} s"
    return Way(name, start, TileMove(start, end, t_f), phase, lead_known)


def flowing_move(workspace: Workspace, tiles: tuple[Tile, Tile, Tile], durations: tuple[float, float]) -> Way:
    """Return the way of a move that takes over from the one before without rest; both have a duration, seconds."""
    a, b, c = tiles
    start, middle, end = (workspace.position(*tile) for tile in tiles)
    before, t_f = durations
    name = f"in the move from tile {b} to {c} in {t_f:g} s, on the move after that from {a} in {before:g} s,"
    return Way(name, start, TileMove(start, middle, before), record.MOVE, onward=(end, t_f))
