"""The 125 Hz loop: one packet, one check, one command a cycle, whatever the arm and whatever the clock.

It blocks: ``follow`` returns when the tip has arrived. Every way out (the end, Ctrl-C, an error, a trip of the
supervisor) leaves through a controlled stop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, dist, inf, nan, sqrt
from types import TracebackType
from typing import NoReturn

from hrcneuro.robot import record
from hrcneuro.robot.backend import PERIOD, ArmError, Backend, Cause, Clock, Packet, Stopped
from hrcneuro.robot.limits import FATAL, INVALID, Limits
from hrcneuro.robot.parameters import Bounds
from hrcneuro.robot.record import Recorder, Track
from hrcneuro.robot.safety import Supervisor, Trip
from hrcneuro.robot.tracking import ResolvedRate
from hrcneuro.robot.trajectory import MotionState, Stop, Trajectory

_ZERO = [0.0] * 6
_NOWHERE = (nan, nan, nan)
_BRAKE = 4.0  # rad/s², the deceleration asked of the controller itself
_AT_REST = 1e-3  # rad/s
_APART = 0.125  # least distance of two cycles, in periods

_ASTRAY = 0.1  # rad, of a joint off its path: at the greatest homing speed it trails by half of that

OnOnset = Callable[[Callable[[], float], int], None]
OnStop = Callable[[BaseException], None]
OnRest = Callable[[bool], None]


class Loop:
    """Drives one arm; a context manager, so that leaving it stops the arm and lets go of it."""

    def __init__(
        self,
        arm: Backend,
        clock: Clock,
        *,
        law: ResolvedRate,
        limits: Limits,
        supervisor: Supervisor,
        stop: Bounds,
        on_onset: OnOnset | None = None,
        on_stop: OnStop = lambda error: None,
        on_rest: OnRest = lambda seen: None,
    ) -> None:
        """Take over an arm at rest; nothing is commanded yet.

        Args:
            arm: The backend.
            clock: Its time decides when a cycle begins.
            law, limits, supervisor: What computes, bounds and watches the commands.
            stop: Bounds of a controlled stop, rad and s; the limits look ahead by it.
            on_onset: The marker: called at the first non-zero command of every move, once that has been sent, with
                what tells how long ago that cycle began, seconds, and with the move.
            on_stop: Called with why the session ends, before anything else is done about it: it must not wait.
            on_rest: Called after such an end, with whether the arm was seen at rest.
        """
        self.lead: float | None = None  # of the feed-forward, seconds; None until it is known
        self.record = Recorder()
        self.stops = 0
        self._arm, self._clock = arm, clock
        self._law, self._limits, self._supervisor = law, limits.stopping(stop), supervisor
        self._stop_bounds, self._on_onset = stop, on_onset
        self._on_stop, self._on_rest = on_stop, on_rest
        self._zero = self._next = clock.now()
        self._last: list[float] = _ZERO
        self._before: list[float] = _ZERO
        self._stopped = False

    def __enter__(self) -> Loop:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            if not self._stopped:
                if error is not None:
                    self._announce(error)
                seen = self.halt()
                if error is not None:
                    self._on_rest(seen)
        finally:
            try:
                self._arm.stop(_BRAKE)
            finally:
                self._arm.close()

    def now(self) -> float:
        """Return the time of the cycle to come, from the session's start."""
        return self._next - self._zero

    @property
    def late_packets(self) -> tuple[int, float]:
        """In how many cycles a packet was too old and borne, and the age of the oldest, seconds."""
        return self._supervisor.late_packets, self._supervisor.oldest

    def measured(self) -> Packet:
        """Return the arm's packet after one cycle at rest."""
        now, packet = self._begin()
        self._send(now, packet, _ZERO, record.REST, -1, _NOWHERE)
        return packet

    def resume(self) -> None:
        """Go on after a computation at rest: with fresh packets, which a thread of the arm may only now get to read.

        Raises:
            Stopped: It took so long that nobody supervised the arm.
        """
        now = self._clock.now()
        late = now - self._next
        if trip := self._supervisor.late(late):
            self._trip(now, self._arm.state(), trip)
        if late > 0.0:
            self._next += PERIOD * ceil(late / PERIOD + 2.0)

    def rest(self, until: float, *, at: Sequence[float] = _NOWHERE, move: int = -1) -> None:
        """Command nothing until ``until``, from the session's start; ``at`` is recorded as the place to be."""
        while self.now() < until - 1e-9:
            now, packet = self._begin()
            self._send(now, packet, _ZERO, record.REST, move, at)

    def follow(
        self,
        path: Trajectory,
        *,
        phase: int,
        move: int = -1,
        settle: float = 8e-5,
        radius: float = 2e-3,
        patience: float = 0.5,
        handover: float = inf,
    ) -> Track:
        """Move the tip along ``path`` and return once it has arrived and rests, or hands over to the next path.

        Args:
            path: Tip positions in ``base``.
            phase, move: What the record calls these cycles.
            settle: The tip has arrived within this distance of the end, metres …
            radius: … or, after ``patience`` seconds more, within this one.
            patience: How long to wait for the settling, seconds.
            handover: From this time on, return as soon as the tip is within ``radius`` of the end, still moving: the
                caller follows another path from ``Track.motion`` at once.

        Raises:
            Stopped: The tip did not arrive, a limit or the supervisor ended the move; the arm has been stopped.
        """
        first, start, onset, marked = len(self.record), nan, nan, nan
        law, lead, known = self._law, self.lead or 0.0, self.lead is not None
        goal, _ = path.at(path.duration)
        while True:
            now, packet = self._begin()
            if start != start:
                start = now
            t = now - start
            at, _ = path.at(t)
            qd, ex, ey, ez = law(packet.q, at, path.at(t + lead)[1])
            off = sqrt(ex * ex + ey * ey + ez * ez)
            if self._supervisor.off_path(off, lead_known=known):
                # The tip is where it was when the packet was made: that is what it is held against.
                then, _ = path.at(max(t - (now - packet.stamp), 0.0))
                off_then = dist(then, (at[0] - ex, at[1] - ey, at[2] - ez))
                if trip := self._supervisor.off_path(off_then, lead_known=known):
                    self._fail(trip.cause, trip.problem)
            if t >= path.duration:
                if off <= settle or (t >= path.duration + patience and off <= radius):
                    self._send(now, packet, _ZERO, phase, move, at)
                    return self._track(first, start, onset, now, marked)
                if t >= path.duration + patience:
                    self._fail(
                        Cause.TIP_ASTRAY,
                        f"the tip stands {1e3 * off:.1f} mm from its goal {patience:g} s after it should have arrived",
                    )
            if self._send(now, packet, qd, phase, move, at) and onset != onset:
                onset, marked = now, self._mark(now, move)
            if self.now() >= handover - 1e-9:
                off = sqrt(sum((g - a + e) ** 2 for g, a, e in zip(goal, at, (ex, ey, ez), strict=True)))
                if off <= radius:
                    motion = path.state(self._next - start)
                    return self._track(first, start, onset, now, marked, motion)

    def follow_joints(self, path: Trajectory, *, patience: float = 1.0, settle: float = 1e-3) -> None:
        """Move the joints along ``path`` (radians) until each is within ``settle`` of its goal.

        Raises:
            Stopped: As in :meth:`follow`.
        """
        gain, start = self._law.gain, nan
        while True:
            now, packet = self._begin()
            if start != start:
                start = now
            t = now - start
            goal, _ = path.at(t)
            error = [a - b for a, b in zip(goal, packet.q, strict=True)]
            off = max(abs(v) for v in error)
            if t >= path.duration and off <= settle:
                self._send(now, packet, _ZERO, record.HOME, -1, _NOWHERE)
                return
            if t >= path.duration + patience:
                self._fail(
                    Cause.JOINT_ASTRAY,
                    f"a joint stands {off:.4f} rad from its goal {patience:g} s after it should have arrived",
                )
            if off > _ASTRAY:
                self._fail(Cause.JOINT_ASTRAY, f"a joint is {off:.3f} rad off its path; {_ASTRAY:g} rad are allowed")
            ahead = path.at(t + (self.lead or 0.0))[1]
            qd = [v + gain * e for v, e in zip(ahead, error, strict=True)]
            self._send(now, packet, qd, record.HOME, -1, _NOWHERE)

    def halt(self) -> bool:
        """Bring the arm to rest within the stop's bounds; a trip on the way leaves the rest to the controller.

        Returns whether the arm was seen at rest.
        """
        self._stopped = True
        # Planned for the fastest joint; the others keep in proportion, so that the arm keeps the way that the limits
        # looked along.
        way, fastest = self._last, max(map(abs, self._last))
        stop = Stop([fastest], self._stop_bounds, qdd=[-self._braking(fastest)])
        t = 0.0
        while t < stop.duration + PERIOD and any(self._last):
            now, packet, trip = self._tick()
            if trip is not None or self._supervisor.late(self._clock.now() - now) is not None:
                self._arm.stop(_BRAKE)
                break
            t += PERIOD
            share = stop.at(t)[0] / fastest
            self._send(now, packet, [share * v for v in way], record.STOP, -1, _NOWHERE)
        return self._watch_rest()

    def _braking(self, fastest: float) -> float:
        # The deceleration of the fastest joint that the stop goes on from. Speeding up ends at once, and braking is not
        # taken over beyond what leads to rest without turning back (a² = 2jv): with a low jerk, either goes far.
        along = sum((b - a) * a for a, b in zip(self._last, self._before, strict=True))
        size = sum(a * a for a in self._last)
        braking = fastest * along / size / PERIOD if size else 0.0
        bounds = self._stop_bounds
        return min(max(braking, 0.0), bounds.acceleration, sqrt(2.0 * bounds.jerk * fastest))

    def _mark(self, now: float, move: int) -> float:
        if move >= 0 and self._on_onset is not None:
            self._on_onset(lambda: self._clock.now() - now, move)
        return self._clock.now()

    def _track(
        self, first: int, start: float, onset: float, end: float, marked: float, motion: MotionState | None = None
    ) -> Track:
        zero = self._zero
        return Track(first, len(self.record), start - zero, onset - zero, end - zero, marked - zero, motion)

    def _note(self, now: float, phase: int, move: int, packet: Packet, met: int, at: Sequence[float]) -> None:
        head = (now - self._zero, phase, move, packet.safety, packet.scaling, met)
        self.record.add(head, packet.q, packet.qd, self._last, at)

    def _begin(self) -> tuple[float, Packet]:
        now, packet, trip = self._tick()
        if trip is not None:
            self._trip(now, packet, trip)
        return now, packet

    def _tick(self) -> tuple[float, Packet, Trip | None]:
        self._clock.wait_until(self._next)
        now = self._clock.now()
        late = now - self._next
        self._next += PERIOD
        if self._next - now < _APART * PERIOD:
            # What a late cycle missed is not made up for: two commands at once would jerk. The beat stays, since
            # the lead was found for this place between two of the controller's own cycles.
            self._next += PERIOD * ceil((now - self._next) / PERIOD + _APART)
        packet = self._arm.state()
        return now, packet, self._supervisor.check(packet, now, late)

    def _send(self, now: float, packet: Packet, qd: list[float], phase: int, move: int, at: Sequence[float]) -> bool:
        met = 0
        if qd is not _ZERO or self._last is not _ZERO:
            if phase != record.STOP:
                qd, met = self._limits(packet.q, qd, self._last)
            self._before, self._last = self._last, qd if any(qd) else _ZERO
        if phase != record.STOP and (trip := self._supervisor.late(self._clock.now() - now)) is not None:
            # Held up since the check above: what was computed then is no command for now.
            self._trip(now, packet, trip)
        self._arm.speed(self._last)
        self._note(now, phase, move, packet, met, at)
        if met & FATAL:
            cause = Cause.NO_NUMBER if met & INVALID else Cause.OUT_OF_BOX
            what = "is no number" if met & INVALID else "would take the tip out of the keep-inside box"
            self._fail(cause, f"a command {what}; it was not sent")
        return self._last is not _ZERO

    def _trip(self, now: float, packet: Packet, trip: Trip) -> NoReturn:
        self._stopped = True
        self._announce(ArmError(trip.cause, trip.problem))
        if trip.brake:
            self._arm.stop(_BRAKE)
        self._last = self._before = _ZERO
        self._note(now, record.STOP, -1, packet, 0, _NOWHERE)
        self._end(trip.cause, trip.problem, seen=self._watch_rest())

    def _fail(self, cause: Cause, problem: str) -> NoReturn:
        self._announce(ArmError(cause, problem))
        self._end(cause, problem, seen=self.halt())

    def _announce(self, error: BaseException) -> None:
        self.stops += 1
        self._on_stop(error)

    def _end(self, cause: Cause, problem: str, *, seen: bool) -> NoReturn:
        self._on_rest(seen)
        raise Stopped(cause, problem, rests=seen)

    def _watch_rest(self) -> bool:
        # Whether the arm was seen at rest. At most a second: an arm that tells nothing cannot be waited for.
        self._last = self._before = _ZERO
        for _ in range(125):
            now, packet, _ = self._tick()
            self._note(now, record.STOP, -1, packet, 0, _NOWHERE)
            if max(abs(v) for v in packet.qd) < _AT_REST and now - packet.stamp < 2 * PERIOD:
                return True
        return False
