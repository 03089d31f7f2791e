"""URScript's built-in functions that touch the controller: moves, state, registers, inputs and outputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite
from random import Random
from typing import Any

from hrcneuro.ur10 import geometry
from hrcneuro.ur10.arm import CYCLE, MAX_ANGLE, ZERO
from hrcneuro.ur10.controller import Controller, Watchdog
from hrcneuro.ur10.motion import Motion, MoveC, MoveJ, MoveL, ServoJ, SpeedJ, SpeedL, StopJ, StopL
from hrcneuro.ur10.urscript import library
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Pose, Routine

Vector = Sequence[float]

BLOCKING = frozenset(
    [
        "movej",
        "movel",
        "movep",
        "movec",
        "speedj",
        "speedl",
        "servoj",
        "servoc",
        "stopj",
        "stopl",
        "sync",
        "sleep",
        "popup",
        "teach_mode",
        "move_process",
    ]
)
_ENDLESS = 1e9


class Commands:
    """The functions of one controller."""

    def __init__(self, controller: Controller) -> None:
        """Bind to ``controller`` and hand it the functions."""
        self._c = controller
        self._random = Random(1)
        functions: dict[str, Callable[..., Any]] = dict(library.FUNCTIONS)
        for name in dir(self):
            if not name.startswith("_"):
                functions[name] = getattr(self, name)
        functions.update(_plain(controller))
        controller.functions = functions

    # --- moves --------------------------------------------------------------------------------------------------

    def movej(self, q: Vector, a: float = 1.4, v: float = 1.05, t: float = 0, r: float = 0) -> Routine:
        """Move in joint space to joint angles or to a pose."""
        yield from self._at_rest()
        yield from self._follow(MoveJ(self._c.arm, self._joints(q), _positive(a), _positive(v), t))

    def movel(self, pose: Vector, a: float = 1.2, v: float = 0.25, t: float = 0, r: float = 0) -> Routine:
        """Move in tool space to a pose or to joint angles."""
        yield from self._at_rest()
        yield from self._follow(MoveL(self._c.arm, self._pose(pose), _positive(a), _positive(v), t))

    def movep(self, pose: Vector, a: float = 1.2, v: float = 0.25, r: float = 0) -> Routine:
        """Move in tool space; the blend is not simulated: the arm stops at the pose."""
        yield from self.movel(pose, a, v)

    def movec(
        self, pose_via: Vector, pose_to: Vector, a: float = 1.2, v: float = 0.25, r: float = 0, mode: int = 0
    ) -> Routine:
        """Move on a circle through two poses."""
        yield from self._at_rest()
        via, to = self._pose(pose_via), self._pose(pose_to)
        yield from self._follow(MoveC(self._c.arm, via, to, _positive(a), _positive(v), fixed=mode == 1))

    def speedj(self, qd: Vector, a: float = 1.4, t: float | None = None, t_min: float | None = None) -> Routine:
        """Take joint velocities; return after ``t`` seconds, or when they are reached."""
        yield from self._keep(SpeedJ(_six(qd), _positive(a)), t if t is not None else t_min)

    def speedl(self, xd: Vector, a: float = 1.2, t: float | None = None, aRot: float | None = None) -> Routine:
        """Take a velocity of the tool; return after ``t`` seconds, or when it is reached."""
        turn = _positive(aRot) if aRot is not None else _positive(a)
        yield from self._keep(SpeedL(_six(xd), _positive(a), turn), t)

    def servoj(
        self, q: Vector, a: float = 0, v: float = 0, t: float = CYCLE, lookahead_time: float = 0.1, gain: float = 300
    ) -> Routine:
        """Go towards joint angles for ``t`` seconds."""
        yield from self._keep(ServoJ(self._joints(q), lookahead_time, gain), t)

    def servoc(self, pose: Vector, a: float = 1.2, v: float = 0.25, r: float = 0) -> Routine:
        """Go towards a pose; as servoj, without the circular path."""
        yield from self._keep(ServoJ(self._joints(Pose(pose)), 0.1, 300), CYCLE)

    def stopj(self, a: float = 2.0, t: float = 0) -> Routine:
        """Decelerate the joints to rest."""
        yield from self._follow(StopJ(a))

    def stopl(self, a: float = 1.2, aRot: float = 0) -> Routine:
        """Decelerate the tool to rest."""
        yield from self._follow(StopL(a, aRot))

    def sync(self) -> Routine:
        """Give the rest of the cycle away."""
        yield

    def sleep(self, t: float) -> Routine:
        """Wait."""
        until = self._c.now + min(max(t, 0.0), _ENDLESS)
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
            self._c.drive(motion)
            yield

    def _at_rest(self) -> Routine:
        # A move starts at rest: what still moves is stopped first.
        if any(self._c.arm.target_qd):
            yield from self._follow(StopJ())

    def _keep(self, motion: Motion, t: float | None) -> Routine:
        if t is None:
            yield from self._follow(motion)
            return
        for _ in range(max(1, round(min(float(t), _ENDLESS) / CYCLE))):
            self._c.drive(motion)
            yield

    # --- targets ------------------------------------------------------------------------------------------------

    def _joints(self, target: Vector) -> list[float]:
        values = _six(target)
        if not isinstance(target, Pose):
            return _in_range(values)
        q = geometry.inverse(values, self._c.arm.tcp, self._c.arm.target_q)
        if q is None:
            raise ScriptError("runtime error: get_inverse_kin: no solution, the pose is out of reach")
        return q

    def _pose(self, target: Vector) -> list[float]:
        values = _six(target)
        return values if isinstance(target, Pose) else geometry.pose(values, self._c.arm.tcp)

    def get_inverse_kin(
        self,
        x: Vector,
        qnear: Vector | None = None,
        maxPositionError: float = 1e-10,
        maxOrientationError: float = 1e-10,
        tcp: Vector | None = None,
    ) -> list[float]:
        """Return joint angles near ``qnear`` for a pose."""
        arm = self._c.arm
        q = geometry.inverse(_six(x), _six(tcp) if tcp else arm.tcp, _six(qnear) if qnear else arm.target_q)
        if q is None:
            raise ScriptError("runtime error: get_inverse_kin: no solution, the pose is out of reach")
        return q

    def get_inverse_kin_has_solution(
        self, pose: Vector, qnear: Vector | None = None, maxPositionError: float = 1e-10,
        maxOrientationError: float = 1e-10, tcp: Vector | None = None,
    ) -> bool:  # fmt: skip
        """Return whether :meth:`get_inverse_kin` finds joint angles."""
        arm = self._c.arm
        return geometry.inverse(_six(pose), _six(tcp) if tcp else arm.tcp, arm.target_q) is not None

    def get_forward_kin(self, q: Vector | None = None, tcp: Vector | None = None) -> Pose:
        """Return the pose at joint angles."""
        arm = self._c.arm
        return Pose(geometry.pose(_six(q) if q else arm.q, _six(tcp) if tcp else arm.tcp))

    def is_within_safety_limits(self, target: Vector) -> bool:
        """Return whether joint angles, or a pose, can be reached."""
        values = _six(target)
        if isinstance(target, Pose):
            return geometry.inverse(values, self._c.arm.tcp, self._c.arm.target_q) is not None
        return all(abs(v) <= MAX_ANGLE for v in values)

    def set_tcp(self, pose: Vector) -> None:
        """Set the tool centre point, in the flange's frame."""
        self._c.arm.tcp = _six(pose)

    # --- other --------------------------------------------------------------------------------------------------

    def textmsg(self, s1: Any, s2: Any = "") -> None:
        """Write to the log."""
        self._c.tell("text", library.text(s1) + library.text(s2))

    def protective_stop(self) -> None:
        """Trigger a protective stop."""
        self._c.protective_stop("triggered by the program")

    def powerdown(self) -> None:
        """Take the power from the arm."""
        self._c.power_off()

    def random(self) -> float:
        """Return a number between 0 and 1; the same ones on every start."""
        return self._random.random()

    def rtde_set_watchdog(self, variable_name: str, min_frequency: float, action: str = "pause") -> None:
        """Watch how often an RTDE input is written."""
        c = self._c
        if action == "ignore" or min_frequency <= 0.0:
            c.watchdogs.pop(variable_name, None)
            return
        if action not in ("pause", "stop"):
            raise ScriptError(f"runtime error: rtde_set_watchdog: no action {action!r}")
        c.watchdogs[variable_name] = Watchdog(variable_name, 1.0 / min_frequency, action, c.now)


def compile_names(controller: Controller) -> tuple[frozenset[str], frozenset[str]]:
    """Return the names of a controller's built-in functions: those that return at once, those that take time."""
    return frozenset(controller.functions) - BLOCKING, BLOCKING & frozenset(controller.functions)


def _plain(c: Controller) -> dict[str, Callable[..., Any]]:
    """Return the functions of a line each."""
    arm, memory, io = c.arm, c.memory, c.memory.io
    given, taken = memory.inputs, memory.outputs

    def set_payload(m: float, cog: Vector = ()) -> None:
        memory.payload = float(m)
        memory.cog = list(cog or memory.cog)

    def tip() -> list[float]:
        return arm.pose()[:3]

    def bit(word: str, first: int, last: int) -> Callable[[int], bool]:
        return lambda n: bool(getattr(io, word) >> _index(n, last) + first & 1)

    def out(first: int, last: int) -> Callable[[int, bool], None]:
        return lambda n, b: io.set_out(_index(n, last) + first, bool(b))

    def put(bank: list[Any], kind: Callable[[Any], Any]) -> Callable[[int, Any], None]:
        def write(address: int, value: Any) -> None:
            bank[_index(address, len(bank))] = kind(value)

        return write

    def take(bank: list[Any]) -> Callable[[int], Any]:
        return lambda address: bank[_index(address, len(bank))]

    def set_analog(n: int, f: float) -> None:
        # A share of the range: 4 … 20 mA or 0 … 10 V.
        share = min(max(float(f), 0.0), 1.0)
        voltage = io.analog_types >> 2 + _index(n, 2) & 1
        io.analog_out[n] = 10.0 * share if voltage else 0.004 + 0.016 * share

    nothing: Callable[..., None] = lambda *_, **__: None  # noqa: E731
    return {
        "get_actual_joint_positions": lambda: list(arm.q), "get_joint_positions": lambda: list(arm.q),
        "get_actual_joint_speeds": lambda: list(arm.qd), "get_joint_speeds": lambda: list(arm.qd),
        "get_target_joint_positions": lambda: list(arm.target_q),
        "get_target_joint_speeds": lambda: list(arm.target_qd),
        "get_target_joint_accelerations": lambda: list(arm.target_qdd),
        "get_actual_tcp_pose": lambda: Pose(arm.pose()), "get_tcp_pose": lambda: Pose(arm.pose()),
        "get_target_tcp_pose": lambda: Pose(arm.target_pose()),
        "get_target_waypoint": lambda: Pose(arm.target_pose()),
        "get_actual_tool_flange_pose": lambda: Pose(geometry.pose(arm.q, ZERO)),
        "get_actual_tcp_speed": lambda: geometry.twist(arm.q, arm.qd, tip()),
        "get_target_tcp_speed": lambda: geometry.twist(arm.target_q, arm.target_qd, arm.target_pose()[:3]),
        "get_tcp_offset": lambda: Pose(arm.tcp),
        "get_tcp_force": lambda: list(ZERO), "get_joint_torques": lambda: list(ZERO), "force": lambda: 0.0,
        "get_joint_temp": lambda j: 30.0, "get_controller_temp": lambda: 35.0, "get_tool_current": lambda: 0.0,
        "get_steptime": lambda: CYCLE,
        "is_steady": lambda: arm.at_rest,
        "set_payload": set_payload,
        "set_payload_mass": lambda m: set_payload(m), "set_payload_cog": lambda cog: set_payload(memory.payload, cog),
        "get_target_payload": lambda: memory.payload, "get_target_payload_mass": lambda: memory.payload,
        "get_target_payload_cog": lambda: list(memory.cog),
        "set_gravity": nothing, "set_tool_voltage": lambda v: setattr(io, "tool_voltage", int(v)),
        # The arm cannot be pushed: these are taken, and it holds still.
        "force_mode": nothing, "end_force_mode": nothing, "force_mode_set_damping": nothing,
        "force_mode_set_gain_scaling": nothing, "zero_ftsensor": nothing, "enable_external_ft_sensor": nothing, "end_teach_mode": nothing,
        "teach_mode": _nothing_takes_time, "freedrive_mode": nothing, "end_freedrive_mode": nothing,
        "read_input_integer_register": take(given.ints), "read_input_float_register": take(given.doubles),
        "read_input_boolean_register": take(given.bits), "read_output_integer_register": take(taken.ints),
        "read_output_float_register": take(taken.doubles), "read_output_boolean_register": take(taken.bits),
        "write_output_integer_register": put(taken.ints, _int32),
        "write_output_float_register": put(taken.doubles, float),
        "write_output_boolean_register": put(taken.bits, bool),
        "get_standard_digital_in": bit("digital_in", 0, 8), "get_standard_digital_out": bit("digital_out", 0, 8),
        "get_configurable_digital_in": bit("digital_in", 8, 8),
        "get_configurable_digital_out": bit("digital_out", 8, 8),
        "get_tool_digital_in": bit("digital_in", 16, 2), "get_tool_digital_out": bit("digital_out", 16, 2),
        "get_digital_in": bit("digital_in", 0, 18), "get_digital_out": bit("digital_out", 0, 18),
        "set_standard_digital_out": out(0, 8), "set_configurable_digital_out": out(8, 8),
        "set_tool_digital_out": out(16, 2), "set_digital_out": out(0, 18),
        "get_standard_analog_in": lambda n: io.analog_in[_index(n, 2)],
        "get_standard_analog_out": lambda n: io.analog_out[_index(n, 2)],
        "get_tool_analog_in": lambda n: io.tool_analog_in[_index(n, 2)],
        "set_standard_analog_out": set_analog, "set_analog_out": set_analog,
    }  # fmt: skip


def _nothing_takes_time() -> Routine:
    return
    yield


def _index(value: Any, size: int) -> int:
    if not 0 <= int(value) < size:
        raise ScriptError(f"runtime error: no channel {value}; 0 … {size - 1} exist")
    return int(value)


def _int32(value: Any) -> int:
    return (int(value) + 2**31) % 2**32 - 2**31


def _six(values: Any) -> list[float]:
    if not isinstance(values, list) or len(values) != 6 or not all(isfinite(v) for v in values):
        raise ScriptError(f"runtime error: expected six numbers, got {library.text(values)[:80]}")
    return [float(v) for v in values]


def _in_range(q: list[float]) -> list[float]:
    if any(abs(v) > MAX_ANGLE for v in q):
        raise ScriptError("runtime error: joint angles beyond ±360°")
    return q


def _positive(value: Any) -> float:
    number = abs(float(value))
    if not number > 0.0 or not isfinite(number):
        raise ScriptError(f"runtime error: acceleration and speed are positive, got {library.text(value)}")
    return number
