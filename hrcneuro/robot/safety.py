"""The supervisor: looks at every packet and says whether the arm may go on. It moves and unlocks nothing."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from hrcneuro.robot.backend import EMERGENCY, NORMAL, PAUSED, PERIOD, PLAYING, PROTECTIVE, RATE, Cause, Packet
from hrcneuro.robot.parameters import Safety

# Until the lead is known, nothing makes up for the arm's lag, and the tip trails by some millimetres.
_UNKNOWN_LEAD = 3.0
# A simulated controller that tells nothing for longer is not held up, but gone.
_PATIENCE = 0.5  # s


@dataclass(frozen=True)
class Trip:
    """Why the arm must not go on."""

    cause: Cause
    problem: str
    brake: bool = True  # whether the controller still takes a stop command


@dataclass(frozen=True)
class Worst:
    """The greatest of a time."""

    age: float  # of a packet, seconds
    late: float  # by which a cycle began, seconds
    off: float  # of the tip from where it should be, metres


class Supervisor:
    """Checks safety bits, program, speed slider, the age of the packet, the loop's own lateness and the path error."""

    def __init__(self, safety: Safety, *, min_scaling: float = 0.99, keeper: Callable[[], str] = lambda: "") -> None:
        """Fix what is allowed.

        Args:
            safety: The oldest packet, and whether older ones are only counted; the latest cycle; the greatest path
                error.
            min_scaling: The lowest speed slider, 0 … 1.
            keeper: Says why the session cannot be written down any more; an empty text while it can.
        """
        self.max_age = safety.max_packet_age_s
        self.patience = max(_PATIENCE, self.max_age) if safety.patient else self.max_age
        self.late_packets, self.oldest = 0, 0.0  # cycles with a packet that was too old and borne; its age, seconds
        self._late_cycles: deque[tuple[float, float]] = deque(maxlen=round(RATE))  # when, by how much, seconds
        self.max_late = safety.max_late_s
        self.max_off = 1e-3 * safety.max_path_error_mm
        self.min_scaling = min_scaling
        self._keeper = keeper
        self._age = self._late = self._off = 0.0

    def check(self, packet: Packet, now: float, late: float = 0.0) -> Trip | None:
        """Return None while the arm may move, else the reason to stop; the gravest where several hold.

        Args:
            packet: The newest.
            now: When the cycle began.
            late: By how much it began after it should have, seconds.
        """
        if late > PERIOD / 2:
            self._late_cycles.append((now, late))
        if late > self._late:
            self._late = late
        age = now - packet.stamp
        if age > self._age:
            self._age = age
        # The half nanosecond keeps a packet of exactly the greatest age from tripping on rounding.
        if (
            packet.safety == NORMAL
            and packet.runtime == PLAYING
            and packet.scaling >= self.min_scaling
            and age <= self.max_age + 5e-10
            and late <= self.max_late
            and not self._keeper()
        ):
            return None
        return self._reason(packet, now, late)

    def late(self, late: float) -> Trip | None:
        """Return why nothing may be commanded ``late`` seconds after the cycle should have begun, None while it may."""
        if late <= self.max_late:
            return None
        return Trip(
            Cause.LATE,
            f"nobody watched the arm for {1e3 * late:.0f} ms: this session was held up; {1e3 * self.max_late:.0f} ms "
            "are safe (robot.max_late_s)",
        )

    def off_path(self, off: float, *, lead_known: bool) -> Trip | None:
        """Return why the tip may not go on, ``off`` metres from where it should be, None while it may."""
        most = self.max_off * (1.0 if lead_known else _UNKNOWN_LEAD)
        if off <= most:
            if off > self._off:
                self._off = off
            return None
        return Trip(
            Cause.OFF_PATH,
            f"the tip is {1e3 * off:.1f} mm off its path; {1e3 * most:.1f} mm are allowed (robot.max_path_error_mm)",
        )

    def worst(self) -> Worst:
        """Return the greatest packet age, lateness and allowed path error since the last call."""
        worst = Worst(self._age, self._late, self._off)
        self._age = self._late = self._off = 0.0
        return worst

    def _reason(self, packet: Packet, now: float, late: float) -> Trip | None:
        if packet.safety & EMERGENCY:
            return Trip(
                Cause.EMERGENCY_STOP,
                "the arm is in emergency stop",
                brake=False,
            )
        if packet.safety & PROTECTIVE:
            return Trip(
                Cause.PROTECTIVE_STOP,
                "the arm went into a protective stop; hrcneuro never unlocks one",
                brake=False,
            )
        if not packet.safety & NORMAL:
            return Trip(
                Cause.NOT_NORMAL,
                f"the arm's safety state is not normal (safety_status_bits {packet.safety:#x}; 0x1 is normal)",
            )
        if packet.safety != NORMAL:
            return Trip(
                Cause.SAFETY_BITS,
                f"the arm reports a restriction beside its normal mode (safety_status_bits {packet.safety:#x})",
            )
        # Before the packet's age and the program: a session that was held up finds both as its absence left them.
        if trip := self.late(late):
            return trip
        age = now - packet.stamp
        if age > self.patience + 5e-10:
            return Trip(
                Cause.PACKETS_LOST,
                f"the last packet is {1e3 * age:.0f} ms old; {1e3 * self.patience:.0f} ms are "
                f"{'borne with robot.patient' if self.patience > self.max_age else 'safe (robot.max_packet_age_s)'}; "
                f"{self._held_up(now)}",
            )
        if age > self.max_age + 5e-10:
            self.late_packets, self.oldest = self.late_packets + 1, max(self.oldest, age)
        if packet.runtime != PLAYING:
            what = {PAUSED: "paused"}.get(packet.runtime, "not running")
            return Trip(
                Cause.PROGRAM,
                f"the control program on the arm is {what} (runtime_state {packet.runtime}; 2 is playing)",
            )
        if packet.scaling < self.min_scaling:
            return Trip(
                Cause.SLIDER,
                f"the arm's speed slider stands at {100 * packet.scaling:.0f} %: moves would come late",
            )
        if fault := self._keeper():
            return Trip(Cause.NOT_KEPT, f"the session cannot be written down any more: {fault}")
        return None

    def _held_up(self, now: float) -> str:
        """Return whether this session was late itself in the last second, or what it drives was."""
        late = [by for when, by in self._late_cycles if when > now - 1.0]
        if not late:
            return "this session's own cycles began in time: the controller, the driver or the cable was held up"
        return (
            f"of this session's own cycles in the last second {len(late)} began late, by up to {1e3 * max(late):.0f} "
            "ms: this machine was busy"
        )
