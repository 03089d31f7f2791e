"""What moves the arm in a cycle: what programs command, what goes on while its thread lives, or coming to rest."""

from __future__ import annotations

from hrcneuro.ur10.arm import CYCLE, MAX_ANGLE, MAX_SPEED, ZERO, Arm, Vector
from hrcneuro.ur10.motion import Motion, MotionFault, ServoJ, SpeedJ, SpeedL, StopJ
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Program, Thread

_BRAKING = 20.0  # rad/s², where a safety stop, a pause or the end of a program leaves the arm in motion


class Steering:
    """What moves one arm."""

    def __init__(self, arm: Arm) -> None:
        """Bind to ``arm``, which nothing moves yet."""
        self._arm = arm
        self._driving: Motion | None = None
        self._driver: Thread | None = None
        self._kept: tuple[Motion, Thread] | None = None
        self._stop: StopJ | None = None

    def new_cycle(self) -> None:
        """Wait for what programs command in this cycle."""
        self._driving = None

    def forget(self) -> None:
        """Let nothing of a program that has ended move the arm."""
        self._driving = self._kept = None

    def drive(self, motion: Motion, program: Program | None) -> None:
        """Let ``motion`` move the arm in this cycle; speeds and servo goals stay in force while their thread lives.

        Raises:
            ScriptError: Another thread moves the arm in this cycle, or the program is a secondary one.
        """
        if program is not None and program.secondary:
            raise ScriptError("runtime error: Runtime is too much behind: a secondary program cannot move the arm")
        thread = program.current if program is not None else None
        if self._driving is not None and self._driver is not thread and self._driver is not None and self._driver.alive:
            raise ScriptError("runtime error: another thread is already controlling the robot")
        self._driving, self._driver = motion, thread
        lasting = isinstance(motion, (SpeedJ, SpeedL, ServoJ)) and thread is not None
        self._kept = (motion, thread) if lasting and thread is not None else None

    def move(self, *, allowed: bool, slider: float) -> str:
        """Move the arm by a cycle, or bring it to rest unless ``allowed``; return what went wrong, or nothing."""
        motion, arm = self._motion() if allowed else None, self._arm
        if motion is None:
            if arm.at_rest and not any(arm.target_qd):
                arm.cycle(ZERO)
                return ""
            stop = self._stop = self._stop or StopJ(_BRAKING)
            arm.cycle(stop.step(arm, 1.0))
            return ""
        self._stop = None
        try:
            qd = motion.step(arm, slider)
            self._check(qd)
        except MotionFault as fault:
            arm.cycle(StopJ(_BRAKING).step(arm, 1.0))
            return str(fault)
        arm.cycle(qd)
        return ""

    def _motion(self) -> Motion | None:
        if self._driving is not None:
            return self._driving
        if self._kept is not None and self._kept[1].alive:
            return self._kept[0]
        return None

    def _check(self, qd: Vector) -> None:
        for joint, (angle, speed, most) in enumerate(zip(self._arm.target_q, qd, MAX_SPEED, strict=True)):
            # A hundredth of tolerance: moves are planned up to the limit.
            if not abs(speed) <= 1.01 * most:
                raise MotionFault(f"joint {joint + 1} exceeds its speed limit")
            if abs(angle + CYCLE * speed) > MAX_ANGLE and angle * speed > 0.0:
                raise MotionFault(f"joint {joint + 1} exceeds its range")
