"""The 125 Hz loop: along paths, whatever the arm and whatever the clock.

It blocks: ``follow`` returns when the tip has arrived. Every way out (the end, Ctrl-C, an error, a trip of the
supervisor) leaves through a controlled stop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, dist, nan, sqrt

from hrcneuro.robot import record
from hrcneuro.robot.backend import PERIOD, Cause, Packet
from hrcneuro.robot.cycle import NOWHERE, ZERO, Cycle
from hrcneuro.robot.record import Track
from hrcneuro.robot.trajectory import MotionState, Trajectory

_ASTRAY = 0.1  # rad, of a joint off its path: at the greatest homing speed it trails by half of that


class Loop(Cycle):
    """Moves the arm along paths."""

    def measured(self) -> Packet:
        """Return the arm's packet after one cycle at rest."""
        now, packet = self._begin()
        self._send(now, packet, ZERO, record.REST, -1, NOWHERE)
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

    def rest(self, until: float, *, at: Sequence[float] = NOWHERE, move: int = -1) -> None:
        """Command nothing until ``until``, from the session's start; ``at`` is recorded as the place to be."""
        while self.now() < until - 1e-9:
            now, packet = self._begin()
            self._send(now, packet, ZERO, record.REST, move, at)

    def follow(
        self,
        path: Trajectory,
        *,
        phase: int,
        move: int = -1,
        settle: float = 8e-5,
        radius: float = 2e-3,
        patience: float = 0.5,
        near: Callable[[float], bool] | None = None,
    ) -> Track:
        """Move the tip along ``path`` and return once it has arrived and rests, or hands over to the next path.

        Args:
            path: Tip positions in ``base``.
            phase, move: What the record calls these cycles.
            settle: The tip has arrived within this distance of the end, metres …
            radius: … or, after ``patience`` seconds more, within this one.
            patience: How long to wait for the settling, seconds.
            near: Called with its time, seconds from the session's start, in every cycle in which the tip is within
                ``radius`` of the end, still moving. Where it returns true, the caller follows another path from
                ``Track.motion`` at once.

        Raises:
            Stopped: The tip did not arrive, a limit or the supervisor ended the move; the arm has been stopped.
        """
        first, start, onset, marked = len(self.record), nan, nan, nan
        law, lead, known = self._law, self.lead or 0.0, self.lead is not None
        goal, _ = path.at(path.duration)
        half = 0.5 * path.duration
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
                    self._send(now, packet, ZERO, phase, move, at)
                    return self._track(first, start, onset, now, marked)
                if t >= path.duration + patience:
                    self._fail(
                        Cause.TIP_ASTRAY,
                        f"the tip stands {1e3 * off:.1f} mm from its goal {patience:g} s after it should have arrived",
                    )
            if self._send(now, packet, qd, phase, move, at) and onset != onset:
                onset, marked = now, self._mark(now, move)
            if near is not None and t > half:
                x, y, z = goal[0] - at[0] + ex, goal[1] - at[1] + ey, goal[2] - at[2] + ez
                if sqrt(x * x + y * y + z * z) <= radius and near(now - self._zero):
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
                self._send(now, packet, ZERO, record.HOME, -1, NOWHERE)
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
            self._send(now, packet, qd, record.HOME, -1, NOWHERE)

    def _mark(self, now: float, move: int) -> float:
        if move >= 0 and self._on_onset is not None:
            self._on_onset(lambda: self._clock.now() - now, move)
        return self._clock.now()

    def _track(
        self, first: int, start: float, onset: float, end: float, marked: float, motion: MotionState | None = None
    ) -> Track:
        zero = self._zero
        return Track(first, len(self.record), start - zero, onset - zero, end - zero, marked - zero, motion)
