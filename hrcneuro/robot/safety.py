"""The supervisor: looks at every packet and says whether the arm may go on. It moves and unlocks nothing."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.robot.backend import EMERGENCY, NORMAL, PAUSED, PLAYING, PROTECTIVE, State


@dataclass(frozen=True)
class Trip:
    """Why the arm must not go on, and what a person can do about it."""

    name: str
    problem: str
    cure: str
    brake: bool = True  # whether the controller still takes a stop command


_AGAIN = "then start the session again with the episode it stopped in (robot.episodes)"


class Supervisor:
    """Checks safety bits, program, speed slider and the age of the packet."""

    def __init__(self, *, max_age: float = 0.020, min_scaling: float = 0.99) -> None:
        """Fix the oldest packet allowed, seconds, and the lowest speed slider, 0 … 1."""
        self.max_age = max_age
        self.min_scaling = min_scaling

    def check(self, state: State, now: float) -> Trip | None:
        """Return None while the arm may move, else the reason to stop; the gravest where several hold."""
        # The half nanosecond keeps a packet of exactly the greatest age from tripping on rounding.
        if (
            state.safety == NORMAL
            and state.runtime == PLAYING
            and state.scaling >= self.min_scaling
            and now - state.stamp <= self.max_age + 5e-10
        ):
            return None
        return self._reason(state, now)

    def _reason(self, state: State, now: float) -> Trip:
        if state.safety & EMERGENCY:
            return Trip(
                "emergency_stop",
                "the arm is in emergency stop",
                f"see that the cell is safe, release the emergency stop and start the arm on its pendant, {_AGAIN}",
                brake=False,
            )
        if state.safety & PROTECTIVE:
            return Trip(
                "protective_stop",
                "the arm went into a protective stop; hrcneuro never unlocks one",
                f"find what it touched, free it, unlock the protective stop on the pendant, {_AGAIN}",
                brake=False,
            )
        if not state.safety & NORMAL:
            return Trip(
                "not_normal",
                f"the arm's safety state is not normal (safety_status_bits {state.safety:#x}; 0x1 is normal)",
                f"read the pendant, clear what it names, {_AGAIN}",
            )
        if state.safety != NORMAL:
            return Trip(
                "safety_bits",
                f"the arm reports a restriction beside its normal mode (safety_status_bits {state.safety:#x})",
                f"leave reduced or recovery mode and clear safeguard stops, {_AGAIN}",
            )
        if now - state.stamp > self.max_age + 5e-10:
            return Trip(
                "packets_lost",
                f"the last packet is {1e3 * (now - state.stamp):.0f} ms old; {1e3 * self.max_age:.0f} ms are safe",
                f"check the cable and what else loads this machine, {_AGAIN}",
            )
        if state.runtime != PLAYING:
            what = {PAUSED: "paused"}.get(state.runtime, "not running")
            return Trip(
                "program",
                f"the control program on the arm is {what} (runtime_state {state.runtime}; 2 is playing)",
                f"set the pendant to remote control and let nothing else stop the program, {_AGAIN}",
            )
        return Trip(
            "slider",
            f"the arm's speed slider stands at {100 * state.scaling:.0f} %: moves would come late",
            f"set it to 100 %, {_AGAIN}",
        )
