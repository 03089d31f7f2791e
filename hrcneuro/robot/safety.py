"""The supervisor: looks at every packet and says whether the arm may go on. It moves and unlocks nothing."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.robot.backend import EMERGENCY, NORMAL, PAUSED, PLAYING, PROTECTIVE, Cause, Packet
from hrcneuro.robot.parameters import Safety


@dataclass(frozen=True)
class Trip:
    """Why the arm must not go on."""

    cause: Cause
    problem: str
    brake: bool = True  # whether the controller still takes a stop command


class Supervisor:
    """Checks safety bits, program, speed slider and the age of the packet."""

    def __init__(self, safety: Safety, *, min_scaling: float = 0.99) -> None:
        """Fix the oldest packet allowed, of ``safety``, and the lowest speed slider, 0 … 1."""
        self.max_age = safety.max_packet_age_s
        self.min_scaling = min_scaling

    def check(self, packet: Packet, now: float) -> Trip | None:
        """Return None while the arm may move, else the reason to stop; the gravest where several hold."""
        # The half nanosecond keeps a packet of exactly the greatest age from tripping on rounding.
        if (
            packet.safety == NORMAL
            and packet.runtime == PLAYING
            and packet.scaling >= self.min_scaling
            and now - packet.stamp <= self.max_age + 5e-10
        ):
            return None
        return self._reason(packet, now)

    def _reason(self, packet: Packet, now: float) -> Trip:
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
        if now - packet.stamp > self.max_age + 5e-10:
            return Trip(
                Cause.PACKETS_LOST,
                f"the last packet is {1e3 * (now - packet.stamp):.0f} ms old; {1e3 * self.max_age:.0f} ms are safe",
            )
        if packet.runtime != PLAYING:
            what = {PAUSED: "paused"}.get(packet.runtime, "not running")
            return Trip(
                Cause.PROGRAM,
                f"the control program on the arm is {what} (runtime_state {packet.runtime}; 2 is playing)",
            )
        return Trip(
            Cause.SLIDER,
            f"the arm's speed slider stands at {100 * packet.scaling:.0f} %: moves would come late",
        )
