"""The controller: PolyScope's states, its programs, and the cycle that moves the arm. No socket, no clock.

:mod:`hrcneuro.ur10.modes` has the states' numbers; ``programs`` runs programs, ``steering`` moves the arm.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from hrcneuro.ur10.arm import CYCLE, START, Arm, Vector
from hrcneuro.ur10.memory import Memory
from hrcneuro.ur10.modes import (
    EMERGENCY,
    IDLE,
    NORMAL,
    PAUSED,
    PLAYING,
    POWER_OFF,
    POWER_ON,
    PROTECTIVE,
    RUNNING,
    SAFEGUARD,
    STOPPED,
    Notice,
    safety_bits,
)
from hrcneuro.ur10.motion import Motion
from hrcneuro.ur10.programs import Programs, Watchdog, exception
from hrcneuro.ur10.steering import Steering
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Compiled, Program

__all__ = [
    "EMERGENCY", "IDLE", "NORMAL", "PAUSED", "PLAYING", "POWER_OFF", "POWER_ON", "PROTECTIVE", "RUNNING", "SAFEGUARD",
    "STOPPED", "Controller", "Watchdog",
]  # fmt: skip

_UNLOCK_AFTER = 5.0  # s, before which PolyScope refuses to unlock a protective stop
# s: what was ordered earlier, without PolyScope, is done then. UR's client library orders it as soon as it is told of
# the stop, and wants to see it done within 5 s of that; it looks ten times a second, as often as the state is told.
_UNLOCK_ORDERED_AFTER = 4.8
_BOOT = 1.0  # s, of each step of powering up
_LOGGED = {"text": "text", "error": "error", "popup": "popup", "exception": "error"}


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
        self.listeners: list[Callable[[str, str], None]] = []  # of the log: kind, message
        self.outlets: list[Callable[[Notice], None]] = []  # of everything
        self.at_end: list[Callable[[], None]] = []  # called when the main program is over
        self.freedrive = False  # from outside a program: a hand may push the arm, but here is none
        self.warns_above: float | None = None  # the share of deviation, set by position_deviation_warning
        self._deviates = False
        self._steering = Steering(self.arm)
        self.programs = Programs(version=version, say=self.say, ended=self._program_ended)
        self._stopped_at = 0.0
        self._unlocks = False  # as soon as that is allowed
        self._steps: deque[tuple[float, int]] = deque()  # when which robot mode follows

    # --- what is read -------------------------------------------------------------------------------------------

    @property
    def now(self) -> float:
        """Seconds since the controller was started."""
        return self.cycles * CYCLE

    @property
    def program(self) -> Program | None:
        """The main program, or none."""
        return self.programs.main

    @property
    def running(self) -> Program | None:
        """The program whose turn it is: what built-in functions are called by."""
        return self.programs.running

    @property
    def runtime_state(self) -> int:
        """The program's state as RTDE gives it."""
        return self.programs.state

    @property
    def ready(self) -> bool:
        """Whether a program can move the arm."""
        return self.robot_mode == RUNNING and self.safety_mode == NORMAL

    @property
    def safety_bits(self) -> int:
        """RTDE's safety_status_bits."""
        return safety_bits(self.safety_mode)

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
        self.freedrive = self.freedrive and script.secondary
        self.programs.add(script)

    def refuse(self, error: ScriptError) -> None:
        """Say that a program cannot be run: the one that runs goes on."""
        self.say(exception(error))

    def stop_program(self) -> None:
        """End the program; the arm comes to rest."""
        self.programs.stop()

    def pause(self) -> bool:
        """Pause the program; return whether there was one to pause."""
        if self.program is None:
            return False
        self.programs.paused = True
        return True

    def resume(self) -> bool:
        """Go on with a paused program; return whether that was possible."""
        if self.program is None or not self.ready:
            return False
        self.programs.paused = False
        return True

    def begin_freedrive(self) -> None:
        """Let a hand push the arm, where no program runs: until the brakes are asked for, or a program starts."""
        self.freedrive = self.ready and self.program is None

    def power_on(self) -> None:
        """Power the arm: idle after two steps."""
        if self.robot_mode == POWER_OFF and not self._steps and self.safety_mode != EMERGENCY:
            self._steps.extend(((self.now, POWER_ON), (self.now + _BOOT, IDLE)))

    def power_off(self) -> None:
        """Take the power from the arm, at once."""
        self.stop_program()
        self._steps.clear()
        self.robot_mode, self.freedrive = POWER_OFF, False

    def release_brakes(self) -> None:
        """Release the brakes, powering the arm first where it is off; the arm follows its targets again."""
        self.freedrive = False
        self.power_on()
        if self.robot_mode == IDLE or self._steps:
            start = self._steps[-1][0] if self._steps else self.now
            if not self._steps or self._steps[-1][1] != RUNNING:
                self._steps.append((start + _BOOT, RUNNING))

    def protective_stop(self, reason: str, code: int = 0) -> None:
        """Brake hard and pause the program until someone unlocks; ``code`` is the number that port 30001 tells."""
        if self.safety_mode in (NORMAL, SAFEGUARD):
            self._change_safety(PROTECTIVE)
            self.safety_popup = f"Protective stop: {reason}"
            self._stopped_at, self._unlocks = self.now, False
            self.say(Notice("error", self.safety_popup, number=code))
            self.pause()

    def unlock_protective_stop(self, *, wait: bool = False) -> bool:
        """Return to normal; False: it is too early. With ``wait`` it is then done as soon as the time has come."""
        least = _UNLOCK_ORDERED_AFTER if wait else _UNLOCK_AFTER
        early = self.safety_mode == PROTECTIVE and self.now - self._stopped_at < least
        self._unlocks = early and wait
        if early or self.safety_mode != PROTECTIVE:
            return not early
        self._change_safety(NORMAL)
        self.safety_popup = ""
        return True

    def safeguard_stop(self, on: bool) -> None:
        """Open or close the safeguard input: the arm pauses until it is closed."""
        if on and self.safety_mode == NORMAL:
            self._change_safety(SAFEGUARD)
            self.pause()
        elif not on and self.safety_mode == SAFEGUARD:
            self._change_safety(NORMAL)

    def emergency_stop(self, on: bool) -> None:
        """Press or release the emergency stop button; pressing ends the program and takes the power."""
        if on and self.safety_mode != EMERGENCY:
            self._change_safety(EMERGENCY)
            self.stop_program()
            self.freedrive = False
            self._steps.clear()
            self.tell("error", "Emergency stop")
        elif not on and self.safety_mode == EMERGENCY:
            self._change_safety(NORMAL)

    def _change_safety(self, mode: int) -> None:
        self.safety_mode = mode
        self.say(Notice("safety", number=mode))

    def tell(self, kind: str, message: str) -> None:
        """Pass a message to the log and to the streams."""
        self.say(Notice(kind, message))

    def say(self, notice: Notice) -> None:
        """Pass a notice to the streams, and to the log where it belongs there."""
        if notice.kind in _LOGGED:
            for listener in self.listeners:
                listener(_LOGGED[notice.kind], notice.text)
        for outlet in self.outlets:
            outlet(notice)

    def wrote(self, name: str) -> None:
        """Note that a client wrote an RTDE input: what watchdogs wait for."""
        watchdog = self.programs.watchdogs.get(name)
        if watchdog is not None:
            watchdog.written_at = self.now

    # --- called by programs -------------------------------------------------------------------------------------

    def charge(self, cost: int) -> None:
        """Take ``cost`` from what the program that runs may still do in this cycle."""
        if self.running is not None:
            self.running.budget -= cost

    def drive(self, motion: Motion) -> None:
        """Let ``motion`` move the arm in this cycle; see :meth:`Steering.drive`."""
        self._steering.drive(motion, self.running)

    # --- the cycle ----------------------------------------------------------------------------------------------

    def cycle(self) -> None:
        """Compute one control cycle: what programs command, what the arm does, what is published."""
        self.cycles += 1
        while self._steps and self._steps[0][0] <= self.now:
            self.robot_mode = self._steps.popleft()[1]
        if self._unlocks:
            self.unlock_protective_stop(wait=True)
        self.programs.watch(self.now)
        self._steering.new_cycle()
        if self.safety_mode != EMERGENCY:
            self.programs.cycle(ready=self.ready)
        fault = self._steering.move(allowed=self.ready and self.runtime_state == PLAYING, slider=self.slider)
        if fault:
            self.protective_stop(fault)
        self._warn()
        if self.safety_mode == EMERGENCY and self.robot_mode != POWER_OFF and self.arm.at_rest:
            self.robot_mode = POWER_OFF

    def _warn(self) -> None:
        was, self._deviates = self._deviates, self.warns_above is not None and self.arm.deviation > self.warns_above
        if self._deviates and not was:
            self.tell("text", f"Position deviation: {self.arm.deviation:.0%} of what stops the arm")

    def _program_ended(self) -> None:
        self._steering.forget()
        self.warns_above = None
        for call in self.at_end:
            call()
