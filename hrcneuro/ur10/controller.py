"""The controller: PolyScope's states, programs, and the cycle that moves the arm. No socket, no clock.

Modes and values are RTDE's and the dashboard's ("RTDE guide", "Dashboard server, CB-series", Universal Robots).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from hrcneuro.ur10.arm import CYCLE, MAX_ANGLE, MAX_SPEED, START, ZERO, Arm, Vector
from hrcneuro.ur10.memory import Memory
from hrcneuro.ur10.motion import Motion, MotionFault, ServoJ, SpeedJ, SpeedL, StopJ
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Compiled, Program, Thread

POWER_OFF, POWER_ON, IDLE, RUNNING = 3, 4, 5, 7
NORMAL, PROTECTIVE, SAFEGUARD, EMERGENCY = 1, 3, 5, 7
STOPPED, PLAYING, PAUSED = 1, 2, 4

_SAFETY_BITS = {NORMAL: 1 << 0, PROTECTIVE: 1 << 2, SAFEGUARD: 1 << 4, EMERGENCY: 1 << 6 | 1 << 7}
_STOPPED_BY_SAFETY = 1 << 10
_BRAKING = 20.0  # rad/s², where a safety stop, a pause or the end of a program leaves the arm in motion
_UNLOCK_AFTER = 5.0  # s, before which PolyScope refuses to unlock a protective stop
_MOST_SECONDARIES = 10  # at a time
_BOOT = 1.0  # s, of each step of powering up


@dataclass
class Watchdog:
    """rtde_set_watchdog: what happens when an input is not written for ``period`` seconds."""

    name: str
    period: float
    action: str
    written_at: float  # s since the controller's start


class Controller:
    """A simulated robot with its control box: modes, safety, programs and the arm, a cycle at a time."""

    def __init__(
        self, *, version: tuple[int, int, int, int] = (3, 9, 1, 64192), q: Vector = START, powered: bool = True
    ) -> None:
        """Start the controller, at rest at joint angles ``q``; unless ``powered``, as after switching on the box."""
        self.version = version
        self.arm = Arm(q)
        self.memory = Memory()
        self.cycles = 0
        self.robot_mode = RUNNING if powered else POWER_OFF
        self.safety_mode = NORMAL
        self.slider = 1.0
        self.popup = ""
        self.safety_popup = ""
        self.loaded = ""
        self.program: Program | None = None
        self.listeners: list[Callable[[str, str], None]] = []  # kind ("text", "error", "popup"), message
        self.watchdogs: dict[str, Watchdog] = {}
        self.functions: dict[str, Callable[..., object]] = {}
        self.secondaries: list[Program] = []
        self.running: Program | None = None  # whose turn it is, main or secondary
        self._queue: deque[Compiled] = deque()
        self._paused = False
        self._stopped_at = 0.0
        self._steps: deque[tuple[float, int]] = deque()  # when which robot mode follows
        self._driving: Motion | None = None
        self._driver: Thread | None = None
        self._kept: tuple[Motion, Thread] | None = None
        self._stop: StopJ | None = None

    # --- what is read -------------------------------------------------------------------------------------------

    @property
    def now(self) -> float:
        """Seconds since the controller was started."""
        return self.cycles * CYCLE

    @property
    def runtime_state(self) -> int:
        """The program's state as RTDE gives it."""
        if self.program is None:
            return STOPPED
        return PAUSED if self._paused else PLAYING

    @property
    def safety_bits(self) -> int:
        """RTDE's safety_status_bits."""
        bits = _SAFETY_BITS[self.safety_mode]
        return bits if self.safety_mode == NORMAL else bits | _STOPPED_BY_SAFETY

    @property
    def status_bits(self) -> int:
        """RTDE's robot_status_bits: power on, program running."""
        return (self.robot_mode >= IDLE) | (self.program is not None) << 1

    @property
    def speed_scaling(self) -> float:
        """RTDE's speed_scaling: the slider, and 0 while a safety stop holds the arm."""
        return self.slider if self.safety_mode == NORMAL else 0.0

    # --- what is commanded --------------------------------------------------------------------------------------

    def start(self, script: Compiled) -> None:
        """Run a program with the next cycle, in place of the one that runs; a secondary one beside it."""
        if len(self._queue) < 1000:
            self._queue.append(script)

    def stop_program(self) -> None:
        """End the program; the arm comes to rest."""
        self._queue.clear()
        if self.program is not None:
            self.program.stop()
        self._forget_program()

    def pause(self) -> bool:
        """Pause the program; return whether there was one to pause."""
        if self.program is None:
            return False
        self._paused = True
        return True

    def resume(self) -> bool:
        """Go on with a paused program; return whether that was possible."""
        if self.program is None or self.safety_mode != NORMAL or self.robot_mode != RUNNING:
            return False
        self._paused = False
        return True

    def power_on(self) -> None:
        """Power the arm: idle after two steps."""
        if self.robot_mode == POWER_OFF and not self._steps and self.safety_mode != EMERGENCY:
            self._steps.extend(((self.now, POWER_ON), (self.now + _BOOT, IDLE)))

    def power_off(self) -> None:
        """Take the power from the arm, at once."""
        self.stop_program()
        self._steps.clear()
        self.robot_mode = POWER_OFF

    def release_brakes(self) -> None:
        """Release the brakes, powering the arm first where it is off."""
        self.power_on()
        if self.robot_mode == IDLE or self._steps:
            start = self._steps[-1][0] if self._steps else self.now
            if not self._steps or self._steps[-1][1] != RUNNING:
                self._steps.append((start + _BOOT, RUNNING))

    def protective_stop(self, reason: str) -> None:
        """Brake hard and pause the program until someone unlocks."""
        if self.safety_mode in (NORMAL, SAFEGUARD):
            self.safety_mode = PROTECTIVE
            self.safety_popup = f"Protective stop: {reason}"
            self._stopped_at = self.now
            self.tell("error", self.safety_popup)
            self.pause()

    def unlock_protective_stop(self) -> bool:
        """Return to normal; False: five seconds have not passed yet."""
        if self.safety_mode != PROTECTIVE:
            return True
        if self.now - self._stopped_at < _UNLOCK_AFTER:
            return False
        self.safety_mode, self.safety_popup = NORMAL, ""
        return True

    def safeguard_stop(self, on: bool) -> None:
        """Open or close the safeguard input: the arm pauses until it is closed."""
        if on and self.safety_mode == NORMAL:
            self.safety_mode = SAFEGUARD
            self.pause()
        elif not on and self.safety_mode == SAFEGUARD:
            self.safety_mode = NORMAL

    def emergency_stop(self, on: bool) -> None:
        """Press or release the emergency stop button; pressing ends the program and takes the power."""
        if on and self.safety_mode != EMERGENCY:
            self.safety_mode = EMERGENCY
            self.stop_program()
            self._steps.clear()
            self.tell("error", "Emergency stop")
        elif not on and self.safety_mode == EMERGENCY:
            self.safety_mode = NORMAL

    def tell(self, kind: str, message: str) -> None:
        """Pass a message to the log and to the streams."""
        for listener in self.listeners:
            listener(kind, message)

    def wrote(self, name: str) -> None:
        """Note that a client wrote an RTDE input: what watchdogs wait for."""
        watchdog = self.watchdogs.get(name)
        if watchdog is not None:
            watchdog.written_at = self.now

    # --- motions, called by programs ----------------------------------------------------------------------------

    def charge(self, cost: int) -> None:
        """Take ``cost`` from what the program that runs may still do in this cycle."""
        if self.running is not None:
            self.running.budget -= cost

    def drive(self, motion: Motion) -> None:
        """Let ``motion`` move the arm in this cycle; speeds and servo goals stay in force while their thread lives.

        Raises:
            ScriptError: Another thread moves the arm in this cycle.
        """
        thread = self.running.current if self.running is not None else None
        if self._driving is not None and self._driver is not thread and self._driver is not None and self._driver.alive:
            raise ScriptError("runtime error: another thread is already controlling the robot")
        self._driving, self._driver = motion, thread
        lasting = isinstance(motion, (SpeedJ, SpeedL, ServoJ)) and thread is not None
        self._kept = (motion, thread) if lasting and thread is not None else None

    # --- the cycle ----------------------------------------------------------------------------------------------

    def cycle(self) -> None:
        """Compute one control cycle: what programs command, what the arm does, what is published."""
        self.cycles += 1
        while self._steps and self._steps[0][0] <= self.now:
            self.robot_mode = self._steps.popleft()[1]
        self._watch()
        self._driving = None
        if self.safety_mode != EMERGENCY:
            self._run_programs()
        self._move()
        if self.safety_mode == EMERGENCY and self.robot_mode != POWER_OFF and self.arm.at_rest:
            self.robot_mode = POWER_OFF

    def _watch(self) -> None:
        for watchdog in list(self.watchdogs.values()):
            if self.now - watchdog.written_at > watchdog.period:
                if watchdog.action == "stop":
                    self.tell("error", f"RTDE watchdog: {watchdog.name} was not written in time")
                    self.stop_program()
                elif watchdog.action == "pause":
                    self.pause()

    def _run_programs(self) -> None:
        while self._queue:
            script = self._queue.popleft()
            program = Program(script, self.functions)
            if script.secondary:
                if len(self.secondaries) < _MOST_SECONDARIES:
                    self.secondaries.append(program)
                else:
                    self.tell("error", "Too many secondary programs: one was not started")
                continue
            if self.robot_mode != RUNNING or self.safety_mode != NORMAL:
                self.tell("error", "The robot is not running: the program was not started")
                continue
            if self.program is not None:
                self.program.stop()
            self._forget_program()
            self.program = program
            if self._queue:
                self._advance(program)
        for program in list(self.secondaries):
            self._advance(program)
            if not program.running:
                self.secondaries.remove(program)
        if self.program is not None and not self._paused:
            self._advance(self.program)

    def _advance(self, program: Program) -> None:
        self.running = program
        try:
            program.cycle()
        except ScriptError as error:
            self.tell("error", str(error))
        if program is self.program and not program.running:
            self._forget_program()

    def _forget_program(self) -> None:
        self.program, self._paused = None, False
        self._driving = self._kept = None
        self.watchdogs.clear()

    def _move(self) -> None:
        motion, arm = self._motion(), self.arm
        if motion is None:
            if arm.at_rest and not any(arm.target_qd):
                arm.cycle(ZERO)
                return
            stop = self._stop = self._stop or StopJ(_BRAKING)
            arm.cycle(stop.step(arm, 1.0))
            return
        self._stop = None
        try:
            qd = motion.step(arm, self.slider)
            self._check(qd)
        except MotionFault as fault:
            self.protective_stop(str(fault))
            arm.cycle(StopJ(_BRAKING).step(arm, 1.0))
            return
        arm.cycle(qd)

    def _motion(self) -> Motion | None:
        if self.runtime_state != PLAYING or self.safety_mode != NORMAL or self.robot_mode != RUNNING:
            return None
        if self._driving is not None:
            return self._driving
        if self._kept is not None and self._kept[1].alive:
            return self._kept[0]
        return None

    def _check(self, qd: Vector) -> None:
        for joint, (angle, speed, most) in enumerate(zip(self.arm.target_q, qd, MAX_SPEED, strict=True)):
            # A hundredth of tolerance: moves are planned up to the limit.
            if not abs(speed) <= 1.01 * most:
                raise MotionFault(f"joint {joint + 1} exceeds its speed limit")
            if abs(angle + CYCLE * speed) > MAX_ANGLE and angle * speed > 0.0:
                raise MotionFault(f"joint {joint + 1} exceeds its range")
