"""URScript's built-in functions that touch the controller: moves, state, registers, inputs and outputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random
from typing import Any

from hrcneuro.ur10 import geometry
from hrcneuro.ur10.arm import CYCLE, MAX_ANGLE
from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.functions import one_liners
from hrcneuro.ur10.modes import Notice
from hrcneuro.ur10.motion import Motion, MoveC, MoveJ, MoveL, ServoJ, SpeedJ, SpeedL, StopJ, StopL
from hrcneuro.ur10.programs import Watchdog
from hrcneuro.ur10.ranges import RANGES
from hrcneuro.ur10.remote import Remote
from hrcneuro.ur10.sockets import Sockets
from hrcneuro.ur10.talk import Talk
from hrcneuro.ur10.urscript import library
from hrcneuro.ur10.urscript.arguments import Number, OneOf, checked, require
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Pose, Routine
from hrcneuro.ur10.urscript.signatures import Signatures
from hrcneuro.ur10.variables import INPUTS

Vector = Sequence[float]

_TAKE_TIME = """movej movel movep movec speedj speedl servoj servoc stopj stopl stop_conveyor_tracking sync sleep popup
teach_mode socket_open socket_read_binary_integer socket_read_byte_list socket_read_ascii_float socket_read_string
socket_read_line socket_get_var"""
BLOCKING = frozenset(_TAKE_TIME.split())
_ENDLESS = 1e9
_STOPPED_BY_PROGRAM = 209  # C209A0 in UR's list of error codes
_INVERSE = 100  # turns of a loop that the inverse kinematics weighs
_POSITIVE = Number(above=0.0)
_ACTIONS = OneOf(("ignore", "pause", "stop"))


class Commands:
    """The functions of one controller."""

    def __init__(self, controller: Controller, sockets: Sockets | None = None) -> None:
        """Bind to ``controller`` and hand it the functions; programs talk through ``sockets``, which end with them."""
        self._c = controller
        self._random = Random(1)
        functions: dict[str, Callable[..., Any]] = dict(library.FUNCTIONS)
        for name in dir(self):
            if not name.startswith("_"):
                functions[name] = getattr(self, name)
        functions.update(one_liners(controller))
        sockets = sockets or Sockets()
        functions.update(Talk(controller, sockets).functions())
        functions.update(Remote(controller, sockets).functions())
        for name, kinds in RANGES.items():
            functions[name] = checked(name, functions[name], kinds)
        # What translated code calls, but no script by name.
        functions["_label"] = lambda number, text: controller.say(Notice("label", text, number=number))
        controller.programs.functions = functions
        controller.at_end.append(sockets.close_all)

    # --- moves --------------------------------------------------------------------------------------------------

    def movej(self, q: Vector, a: float = 1.4, v: float = 1.05, t: float = 0, r: float = 0) -> Routine:
        """Move in joint space to joint angles or to a pose; a time ``t`` above 0 counts before ``a`` and ``v``."""
        _check_profile("movej", a, v, t)
        yield from self._at_rest()
        yield from self._follow(MoveJ(self._c.arm, self._joints(q), a, v, t))

    def movel(self, pose: Vector, a: float = 1.2, v: float = 0.25, t: float = 0, r: float = 0) -> Routine:
        """Move in tool space to a pose or to joint angles; a time ``t`` above 0 counts before ``a`` and ``v``."""
        _check_profile("movel", a, v, t)
        yield from self._at_rest()
        yield from self._follow(MoveL(self._c.arm, self._pose(pose), a, v, t))

    def movep(self, pose: Vector, a: float = 1.2, v: float = 0.25, r: float = 0) -> Routine:
        """Move in tool space; the blend is not simulated: the arm stops at the pose."""
        yield from self.movel(pose, a, v)

    def movec(
        self, pose_via: Vector, pose_to: Vector, a: float = 1.2, v: float = 0.25, r: float = 0, mode: int = 0
    ) -> Routine:
        """Move on a circle through two poses."""
        yield from self._at_rest()
        via, to = self._pose(pose_via), self._pose(pose_to)
        yield from self._follow(MoveC(self._c.arm, via, to, a, v, fixed=mode == 1))

    def speedj(self, qd: Vector, a: float, t: float | None = None, t_min: float | None = None) -> Routine:
        """Take joint velocities; return after ``t`` seconds, or when they are reached."""
        yield from self._keep(SpeedJ(qd, a), t if t is not None else t_min)

    def speedl(
        self, xd: Vector, a: float, t: float | None = None, aRot: float | None = None, t_min: float | None = None
    ) -> Routine:
        """Take a velocity of the tool; return after ``t`` seconds, or when it is reached."""
        yield from self._keep(SpeedL(xd, a, aRot if aRot is not None else a), t if t is not None else t_min)

    def servoj(
        self, q: Vector, a: float = 0, v: float = 0, t: float = CYCLE, lookahead_time: float = 0.1, gain: float = 300
    ) -> Routine:
        """Go towards joint angles for ``t`` seconds."""
        yield from self._keep(ServoJ(self._joints(q), lookahead_time, gain), t)

    def servoc(self, pose: Vector, a: float = 1.2, v: float = 0.25, r: float = 0) -> Routine:
        """Go towards a pose; as servoj, without the circular path."""
        yield from self._keep(ServoJ(self._joints(Pose(pose)), 0.1, 300), CYCLE)

    def stopj(self, a: float) -> Routine:
        """Decelerate the joints to rest."""
        yield from self._follow(StopJ(a))

    def stopl(self, a: float, aRot: float | None = None) -> Routine:
        """Decelerate the tool to rest."""
        yield from self._follow(StopL(a, aRot))

    def stop_conveyor_tracking(self, a: float = 20.0) -> Routine:
        """Decelerate the joints to rest."""
        yield from self._follow(StopJ(a))

    def sync(self) -> Routine:
        """Give the rest of the cycle away."""
        yield

    def sleep(self, t: float) -> Routine:
        """Wait for a number of seconds, on the controller's clock."""
        program = self._c.running
        if t > 0.0 and program is not None and program.secondary:
            yield  # however short it is, a secondary program has no time for it
        until = self._c.now + min(t, _ENDLESS)
        while self._c.now < until - 0.5 * CYCLE:
            yield

    def popup(
        self, s: Any, title: str = "Popup", warning: bool = False, error: bool = False, blocking: bool = False
    ) -> Routine:
        """Show a message; where ``blocking``, wait until someone closes it."""
        self._c.popup = library.text(s)
        self._c.tell("popup", self._c.popup)
        while blocking and self._c.popup:
            yield
        return
        yield

    def _follow(self, motion: Motion) -> Routine:
        while not motion.done:
            yield from self._drive(motion)

    def _drive(self, motion: Motion) -> Routine:
        # Others run beside a motion in a critical section: UR's external control program cancels moves so.
        self._c.drive(motion)
        program = self._c.running
        assert program is not None
        yield from program.give_way()

    def _at_rest(self) -> Routine:
        # A move starts at rest: what still moves is stopped first.
        if any(self._c.arm.target_qd):
            yield from self._follow(StopJ())

    def _keep(self, motion: Motion, t: float | None) -> Routine:
        if t is None:
            yield from self._follow(motion)
            return
        left = float(max(1, round(min(float(t), _ENDLESS) / CYCLE)))  # cycles at full speed
        while left > 1e-9:
            yield from self._drive(motion)
            # The slider slows a velocity's time, too: the way is the same. A servo goal is a place, not a way.
            left -= 1.0 if isinstance(motion, ServoJ) else self._c.slider

    # --- targets ------------------------------------------------------------------------------------------------

    def _joints(self, target: Vector) -> list[float]:
        if isinstance(target, Pose):
            return self.get_inverse_kin(target)
        if any(abs(v) > MAX_ANGLE for v in target):
            raise ScriptError("runtime error: joint angles beyond ±360°")
        return list(target)

    def _pose(self, target: Vector) -> list[float]:
        return list(target) if isinstance(target, Pose) else geometry.pose(target, self._c.arm.tcp)

    def get_inverse_kin(
        self,
        x: Vector,
        qnear: Vector | None = None,
        maxPositionError: float = 1e-10,
        maxOrientationError: float = 1e-10,
        tcp: Vector | None = None,
    ) -> list[float]:
        """Return joint angles near ``qnear`` for a pose."""
        self._c.charge(_INVERSE)
        arm = self._c.arm
        q = geometry.inverse(x, tcp or arm.tcp, qnear or arm.target_q)
        if q is None:
            raise ScriptError("runtime error: get_inverse_kin: no solution, the pose is out of reach")
        return q

    def get_inverse_kin_has_solution(
        self, pose: Vector, qnear: Vector | None = None, maxPositionError: float = 1e-10,
        maxOrientationError: float = 1e-10, tcp: Vector | None = None,
    ) -> bool:  # fmt: skip
        """Return whether :meth:`get_inverse_kin` finds joint angles."""
        self._c.charge(_INVERSE)
        arm = self._c.arm
        return geometry.inverse(pose, tcp or arm.tcp, arm.target_q) is not None

    def get_forward_kin(self, q: Vector | None = None, tcp: Vector | None = None) -> Pose:
        """Return the pose at joint angles."""
        arm = self._c.arm
        return Pose(geometry.pose(q or arm.q, tcp or arm.tcp))

    def is_within_safety_limits(self, target: Vector) -> bool:
        """Return whether joint angles, or a pose, can be reached."""
        self._c.charge(_INVERSE)
        if isinstance(target, Pose):
            return geometry.inverse(target, self._c.arm.tcp, self._c.arm.target_q) is not None
        return all(abs(v) <= MAX_ANGLE for v in target)

    def set_tcp(self, pose: Vector) -> None:
        """Set the tool centre point, in the flange's frame."""
        self._c.arm.tcp = [float(v) for v in pose]

    # --- other --------------------------------------------------------------------------------------------------

    def textmsg(self, s1: Any, s2: Any = "") -> None:
        """Write to the log."""
        self._c.tell("text", library.text(s1) + library.text(s2))

    def protective_stop(self) -> None:
        """Trigger a protective stop."""
        self._c.protective_stop("triggered by the program", _STOPPED_BY_PROGRAM)

    def powerdown(self) -> None:
        """Take the power from the arm."""
        self._c.power_off()

    def random(self) -> float:
        """Return a number between 0 and 1; the same ones on every start."""
        return self._random.random()

    def position_deviation_warning(self, enabled: bool, threshold: float = 0.8) -> None:
        """Write to the log where the joints leave their targets by more than a share of what stops the arm."""
        self._c.warns_above = float(threshold) if enabled else None

    def rtde_set_watchdog(self, variable_name: str, min_frequency: float, action: str = "pause") -> None:
        """Watch how often an RTDE input is written."""
        c = self._c
        if variable_name not in INPUTS or INPUTS[variable_name].since > c.version[:2]:
            raise ScriptError(f"runtime error: rtde_set_watchdog: RTDE has no input {variable_name[:80]!r}")
        action = action.lower()  # the script manual writes "pause"; UR's own program, "PAUSE"
        require("rtde_set_watchdog", "action", _ACTIONS, action)
        if action == "ignore" or min_frequency == 0.0:
            c.programs.watchdogs.pop(variable_name, None)
            return
        c.programs.watchdogs[variable_name] = Watchdog(variable_name, 1.0 / min_frequency, action, c.now)


def compile_names(controller: Controller) -> tuple[frozenset[str], frozenset[str], Signatures]:
    """Return the built-in functions: names of those that return at once and that take time, and the parameters."""
    functions = {name: f for name, f in controller.programs.functions.items() if not name.startswith("_")}
    return frozenset(functions) - BLOCKING, BLOCKING & frozenset(functions), Signatures(functions)


def _check_profile(function: str, a: Any, v: Any, t: float) -> None:
    # The script manual: where a time is given, a and v are ignored.
    if not t:
        require(function, "a", _POSITIVE, a)
        require(function, "v", _POSITIVE, v)
