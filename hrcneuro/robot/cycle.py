"""A cycle at 125 Hz: one packet, one check, one command; and how every session ends, in a controlled stop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, nan, sqrt
from types import TracebackType
from typing import NoReturn, Self

from hrcneuro.robot import record
from hrcneuro.robot.backend import PERIOD, ArmError, Backend, Cause, Clock, Packet, Stopped
from hrcneuro.robot.limits import FATAL, INVALID, Limits
from hrcneuro.robot.parameters import Bounds
from hrcneuro.robot.record import Recorder
from hrcneuro.robot.safety import Supervisor, Trip, Worst
from hrcneuro.robot.tracking import ResolvedRate
from hrcneuro.robot.trajectory import Stop

ZERO = [0.0] * 6
NOWHERE = (nan, nan, nan)
_BRAKE = 4.0  # rad/s², the deceleration asked of the controller itself
_AT_REST = 1e-3  # rad/s
_APART = 0.125  # least distance of two cycles, in periods

OnOnset = Callable[[Callable[[], float], int], None]
OnStop = Callable[[BaseException], None]
OnRest = Callable[[bool], None]
OnCycle = Callable[[float], str]


class Cycle:
    """Holds one arm; a context manager, so that leaving it stops the arm and lets go of it."""

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
        on_cycle: OnCycle | None = None,
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
            on_cycle: Called in every cycle once its command has been sent, with its time, seconds from the session's
                start; it must not wait. What it returns, if anything, is why nobody asks for motions any more: the
                session then ends in a controlled stop.
        """
        self.lead: float | None = None  # of the feed-forward, seconds; None until it is known
        self.record = Recorder()
        self.stops = 0
        self._arm, self._clock = arm, clock
        self._law, self._limits, self._supervisor = law, limits.stopping(stop), supervisor
        self._stop_bounds, self._on_onset = stop, on_onset
        self._on_stop, self._on_rest, self._on_cycle = on_stop, on_rest, on_cycle
        self._zero = self._next = clock.now()
        self._last: list[float] = ZERO
        self._before: list[float] = ZERO
        self._stopped = False

    def __enter__(self) -> Self:
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

    @property
    def began(self) -> float:
        """When the session started, on the clock, seconds."""
        return self._zero

    def worst(self) -> Worst:
        """Return the greatest packet age, lateness and path error since the last call."""
        return self._supervisor.worst()

    def halt(self) -> bool:
        """Bring the arm to rest within the stop's bounds; a trip on the way leaves the rest to the controller.

        Returns whether the arm was seen at rest.
        """
        self._stopped = True
        # Planned for the fastest joint; the others keep in proportion, so that the arm keeps the way that the limits
        # looked along.
        way, fastest = self._last, max(map(abs, self._last))
        stop = Stop([fastest], self._stop_bounds, qdd=[-self._braking(fastest)])
        t, braked = 0.0, False
        while t < stop.duration + PERIOD and any(self._last):
            now, packet, trip = self._tick()
            if trip is not None or self._supervisor.late(self._clock.now() - now) is not None:
                self._arm.stop(_BRAKE)
                braked = True
                break
            t += PERIOD
            share = stop.at(t)[0] / fastest
            self._send(now, packet, [share * v for v in way], record.STOP, -1, NOWHERE)
        return self._watch_rest(again=not braked)

    def _braking(self, fastest: float) -> float:
        # The deceleration of the fastest joint that the stop goes on from. Speeding up ends at once, and braking is not
        # taken over beyond what leads to rest without turning back (a² = 2jv): with a low jerk, either goes far.
        along = sum((b - a) * a for a, b in zip(self._last, self._before, strict=True))
        size = sum(a * a for a in self._last)
        braking = fastest * along / size / PERIOD if size else 0.0
        bounds = self._stop_bounds
        return min(max(braking, 0.0), bounds.acceleration, sqrt(2.0 * bounds.jerk * fastest))

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
        if qd is not ZERO or self._last is not ZERO:
            if phase != record.STOP:
                qd, met = self._limits(packet.q, qd, self._last)
            self._before, self._last = self._last, qd if any(qd) else ZERO
        if phase != record.STOP and (trip := self._supervisor.late(self._clock.now() - now)) is not None:
            # Held up since the check above: what was computed then is no command for now.
            self._trip(now, packet, trip)
        self._arm.speed(self._last)
        self._note(now, phase, move, packet, met, at)
        if met & FATAL:
            cause = Cause.NO_NUMBER if met & INVALID else Cause.OUT_OF_BOX
            what = "is no number" if met & INVALID else "would take the tip out of the keep-inside box"
            self._fail(cause, f"a command {what}; it was not sent")
        if self._on_cycle is not None and phase != record.STOP and (problem := self._on_cycle(now - self._zero)):
            self._fail(Cause.ALONE, problem)
        return self._last is not ZERO

    def _trip(self, now: float, packet: Packet, trip: Trip) -> NoReturn:
        self._stopped = True
        self._announce(ArmError(trip.cause, trip.problem))
        if trip.brake:
            self._arm.stop(_BRAKE)
        self._last = self._before = ZERO
        self._note(now, record.STOP, -1, packet, 0, NOWHERE)
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

    def _watch_rest(self, *, again: bool = False) -> bool:
        # Whether the arm was seen at rest; it is told ``again`` to rest until then, unless the controller brakes it. At
        # most a second: an arm that tells nothing cannot be waited for.
        self._last = self._before = ZERO
        for _ in range(125):
            now, packet, _ = self._tick()
            if again:
                self._arm.speed(ZERO)
            self._note(now, record.STOP, -1, packet, 0, NOWHERE)
            if max(abs(v) for v in packet.qd) < _AT_REST and now - packet.stamp < 2 * PERIOD:
                return True
        return False
