"""A session: home, find the lead, then one thing after the other as it is asked for, or as a log has it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite, nan

from hrcneuro.paradigm.grid import CENTRE, Tile, distance, inside
from hrcneuro.paradigm.timing import IN_RADIUS
from hrcneuro.robot import record
from hrcneuro.robot.backend import PERIOD
from hrcneuro.robot.events import Approach, Arrived, Finish, InRadius, Ready
from hrcneuro.robot.homing import check_lead, find_lead, go_home
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.parameters import Pace
from hrcneuro.robot.plan import PlannedMove
from hrcneuro.robot.record import Track
from hrcneuro.robot.requests import Make, Replay, Request, Source, Stays
from hrcneuro.robot.trajectory import BoundedPath, MotionState, MovingStart, TileMove, Trajectory
from hrcneuro.robot.workspace import Workspace


@dataclass(frozen=True)
class ExecutedMove:
    """One move as it was executed."""

    index: int
    move: PlannedMove
    track: Track
    flowed: bool = False  # it took over from the move before without rest, so it does not begin as Eq 2 does

    @property
    def began(self) -> float:
        """When it began, seconds from the session's start: its onset; for want of one, its first cycle."""
        return self.track.onset if isfinite(self.track.onset) else self.track.start

    @property
    def moved(self) -> bool:
        """Whether the arm went from one tile to another."""
        return not self.move.dwells and isfinite(self.track.onset)


Event = Ready | Arrived | Stays | InRadius | ExecutedMove


def approach(loop: Loop, workspace: Workspace, tile: Tile, *, pace: Pace, here: Sequence[float]) -> Track:
    """Bring the tip from ``here`` (x, y, z) over ``tile`` in a straight line."""
    # The way was checked before the session: here it would cost a cycle.
    path = BoundedPath(here, workspace.position(*tile), pace.approach)
    return loop.follow(path, phase=record.APPROACH, radius=workspace.cell.radius)


def serve(
    loop: Loop,
    workspace: Workspace,
    source: Source,
    *,
    lead: float | None,
    most_lead: float,
    pace: Pace,
    tell: Callable[[Event], None],
) -> None:
    """Bring the arm home, find its lead, and do what ``source`` asks for until it asks to finish.

    Args:
        loop: A fresh loop; it is left at rest, not stopped.
        workspace: Where the tiles are.
        source: Is asked in every cycle at rest; where ``pace.start_next`` is ``in_radius``, also in every cycle within
            the radius of a move's goal. What it asks for was looked ahead to: here that would cost cycles.
        lead: Of the feed-forward, seconds; None: measured first.
        most_lead: A measured lead above this ends the session before its first request, seconds.
        pace: Bounds, and whether moves flow into each other.
        tell: Takes what happens, at the end of the cycle in which it does; it must not wait.

    Raises:
        ArmError: The arm is not where it may start, answers too slowly, or was stopped on the way.
        ValueError: A move does not begin where the arm stands, or goes farther than a tile; or it leads off the grid.
    """
    loop.lead = lead
    go_home(loop, workspace, pace=pace)
    approach(loop, workspace, CENTRE, pace=pace, here=workspace.home_position())
    if lead is None:
        loop.lead = find_lead(loop, workspace)
        check_lead(loop.lead, most=most_lead)
        loop.resume()
    tell(Ready(loop.now() - PERIOD, loop.lead or 0.0))
    _Service(loop, workspace, source, pace, tell).run()


class _Service:
    """Does what is asked for, from one tile to the next."""

    def __init__(
        self, loop: Loop, workspace: Workspace, source: Source, pace: Pace, tell: Callable[[Event], None]
    ) -> None:
        self._loop, self._workspace, self._source, self._pace, self._tell = loop, workspace, source, pace, tell
        self._flows = pace.start_next == "in_radius"
        self._tile = CENTRE
        self._motion: MotionState | None = None  # of the move before, where the next one takes over without rest
        self._waiting: Request | None = None  # what was asked for while the arm moved

    def run(self) -> None:
        """Return once it is asked to finish."""
        while not isinstance(request := self._next(), Finish):
            if request is None:
                self._loop.rest(self._loop.now() + PERIOD, at=self._here())
            elif isinstance(request, Approach):
                self._approach(request.tile)
            else:
                self._make(request)

    def _next(self) -> Request | None:
        request, self._waiting = self._waiting or self._source(self._loop.now(), False), None
        return request

    def _here(self) -> tuple[float, float, float]:
        return self._workspace.position(*self._tile)

    def _approach(self, tile: Tile) -> None:
        when = self._loop.now()
        if not inside(tile):
            raise ValueError(f"an approach to tile {tile}, which lies off the grid")
        if tile != self._tile:
            when = approach(self._loop, self._workspace, tile, pace=self._pace, here=self._here()).end
        self._tile = tile
        self._tell(Arrived(tile, when))

    def _make(self, request: Make) -> None:
        move, index = request.move, request.index
        if move.start != self._tile or distance(move.start, move.end) > 1 or not inside(move.end):
            raise ValueError(
                f"move {index} goes from tile {move.start} to {move.end}; the arm stands over {self._tile}, and a move "
                "goes one tile"
            )
        if self._motion is None:
            self._loop.rest(request.not_before, at=self._here())
        track = self._dwell(request) if move.dwells else self._tile_move(request)
        executed = ExecutedMove(index, move, track, flowed=self._motion is not None)
        self._motion, self._tile = track.motion, move.end
        self._tell(executed)

    def _dwell(self, request: Make) -> Track:
        loop, here = self._loop, self._here()
        first, start = len(loop.record), loop.now()
        self._tell(Stays(request.index, start))
        # Keys are accepted when they would be after a move of this duration.
        for share in (IN_RADIUS, 1.0):
            loop.rest(start + share * request.move.t_f, at=here, move=request.index)
            if share == IN_RADIUS:
                self._tell(InRadius(request.index, loop.now()))
        return Track(first, len(loop.record), start, nan, loop.now())

    def _tile_move(self, request: Make) -> Track:
        index, told = request.index, False

        def near(when: float) -> bool:
            nonlocal told
            if not told:
                told = True
                self._tell(InRadius(index, when))
            return self._flows and self._takes_over()

        track = tile_move(self._loop, self._workspace, request.move, index, motion=self._motion, near=near)
        if not told:
            self._tell(InRadius(index, track.end))
        return track

    def _takes_over(self) -> bool:
        now = self._loop.now()
        self._waiting = self._waiting or self._source(now, True)
        after = self._waiting
        return isinstance(after, Make) and not after.move.dwells and now >= after.not_before - 1e-9


def run_session(
    loop: Loop,
    workspace: Workspace,
    moves: Sequence[PlannedMove],
    *,
    lead: float | None,
    most_lead: float,
    pace: Pace,
    on_executed: Callable[[ExecutedMove], None],
) -> None:
    """Execute ``moves`` and hand over each as it ends, so that a session that is stopped keeps what it has.

    Args:
        loop: A fresh loop; it is left at rest, not stopped.
        workspace: Where the tiles are.
        moves: The plan, which :func:`hrcneuro.robot.plan.check_paths` has passed.
        lead: Of the feed-forward, seconds; None: measured first.
        most_lead: A measured lead above this ends the session before its first move, seconds.
        pace: Bounds and pauses.
        on_executed: Takes every executed move.

    Raises:
        ArmError: The arm is not where it may start, answers too slowly, or was stopped on the way.
    """
    replay = Replay(moves, pace)

    def take(event: Event) -> None:
        if isinstance(event, ExecutedMove):
            replay.executed(event.began)
            on_executed(event)

    serve(loop, workspace, replay, lead=lead, most_lead=most_lead, pace=pace, tell=take)


def tile_move(
    loop: Loop,
    workspace: Workspace,
    move: PlannedMove,
    index: int,
    *,
    motion: MotionState | None = None,
    near: Callable[[float], bool] | None = None,
) -> Track:
    """Follow one tile move by Eq 1–2, or from ``motion`` where it takes over from the move before."""
    end = workspace.position(*move.end)
    path: Trajectory = TileMove(workspace.position(*move.start), end, move.t_f)
    if motion is not None:
        path = MovingStart(motion, end, move.t_f)
    return loop.follow(path, phase=record.MOVE, move=index, radius=workspace.cell.radius, near=near)
