"""What a session is run with, each value declared once; values only, so that a configuration loads without NumPy.

The stage's Config inherits these classes, and that of the tracking law, and hands itself to what asks for one of them.
"""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.contract import option
from hrcneuro.paradigm.design import T_F_S
from hrcneuro.paradigm.params import START_NEXT


@dataclass(frozen=True)
class Bounds:
    """Largest velocity, acceleration and jerk, the same on each axis (m or rad, and seconds)."""

    velocity: float
    acceleration: float
    jerk: float


@dataclass(frozen=True)
class Selection:
    """Which moves of the log are replayed."""

    blocks: tuple[int, ...] = option((), "main blocks to replay; none: all", low=1)
    episodes: tuple[int, ...] = option((), "episodes of each block to replay; none: all", low=1)
    practice: bool = option(False, "also replay the practice blocks")


@dataclass(frozen=True)
class Durations:
    """How long the moves take (paper § 2.3.2)."""

    t_f_s: float | None = option(None, "duration of every tile move; none: the log's", unit="s", low=0.05, high=5.0)
    t_f_range_s: tuple[float, ...] = option(
        T_F_S, "where the log has onsets only, durations lie within", unit="s", low=0.05, high=5.0
    )
    t_f_default_s: float = option(0.9, "where the log has no times", unit="s", low=0.05, high=5.0)


@dataclass(frozen=True)
class Safety:
    """What bounds and stops the arm."""

    max_packet_age_s: float = option(0.020, "an older packet stops the arm", unit="s", low=0.008, high=0.5)
    patient: bool = option(
        False, "for ursim on a busy machine: packets older than max_packet_age_s are counted, up to half a second old"
    )
    max_late_s: float = option(
        0.1, "a control cycle that begins later than this stops the arm, also at rest", unit="s", low=0.02, high=0.5
    )
    max_lead_s: float = option(
        0.05, "a session whose commands take longer to act and be seen does not start", unit="s", low=0.01, high=0.2
    )
    max_path_error_mm: float = option(
        8.0, "the tip farther from its path stops the arm; three times it until the lead is known", unit="mm", low=0.5,
        high=50.0,
    )  # fmt: skip
    max_acceleration: float = option(12.0, "of every joint", unit="rad/s²", low=1.0, high=40.0)
    stop_deceleration: float = option(8.0, "of a controlled stop, every joint", unit="rad/s²", low=0.5, high=40.0)
    stop_jerk: float = option(200.0, "of a controlled stop, every joint", unit="rad/s³", low=5.0, high=2000.0)

    @property
    def stop(self) -> Bounds:
        """The bounds of a controlled stop, rad; faster than any joint of the arm runs."""
        return Bounds(4.0, self.stop_deceleration, self.stop_jerk)


@dataclass(frozen=True)
class Pace:
    """How the session goes from move to move."""

    start_next: str = option(
        "at_rest", "when the next motion starts: once this one has ended, or within the radius, on the move",
        choices=START_NEXT,
    )  # fmt: skip
    pause_s: float = option(0.5, "rest on the start tile before an episode", unit="s", low=0.0, high=60.0)
    longest_gap_s: float = option(5.0, "a longer gap between onsets is cut to this", unit="s", low=0.0, high=600.0)
    approach_speed: float = option(0.25, "between episodes, along each axis", unit="m/s", low=0.01, high=1.0)
    approach_acceleration: float = option(1.0, "between episodes", unit="m/s²", low=0.01, high=5.0)
    approach_jerk: float = option(10.0, "between episodes", unit="m/s³", low=0.1, high=100.0)
    homing_speed: float = option(0.5, "to the home position, every joint", unit="rad/s", low=0.01, high=2.0)
    homing_acceleration: float = option(1.0, "to the home position", unit="rad/s²", low=0.01, high=10.0)
    homing_jerk: float = option(10.0, "to the home position", unit="rad/s³", low=0.1, high=200.0)

    @property
    def approach(self) -> Bounds:
        """The bounds of the way to an episode's first tile, m."""
        return Bounds(self.approach_speed, self.approach_acceleration, self.approach_jerk)

    @property
    def homing(self) -> Bounds:
        """The bounds of the way to the home position, rad."""
        return Bounds(self.homing_speed, self.homing_acceleration, self.homing_jerk)
