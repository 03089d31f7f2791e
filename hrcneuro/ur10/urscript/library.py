"""URScript's built-in functions that only compute: mathematics, poses, conversions, text."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Any

from hrcneuro.ur10 import geometry
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.runtime import Pose
from hrcneuro.ur10.urscript.values import whole

Vector = Sequence[float]
_LONGEST = 1023  # characters of a string that a function makes
_INTEGER = re.compile(r"\s*[-+]?\d+\s*", re.ASCII)
_DECIMAL = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*", re.ASCII)
_HEXADECIMAL = re.compile(r"\s*[-+]?0[xX][0-9a-fA-F]{1,16}\s*")


def _pose(values: Sequence[float]) -> Pose:
    return Pose(values)


def _interpolated(a: Vector, b: Vector, alpha: float) -> Pose:
    return _pose(geometry.along(a, geometry.between(a, b), alpha))


def _pose_add(a: Vector, b: Vector) -> Pose:
    turn = geometry.times(geometry.rotation(a[3:]), geometry.rotation(b[3:]))
    return _pose([u + v for u, v in zip(a[:3], b[:3], strict=True)] + list(geometry.rotation_vector(turn)))


def _pose_sub(a: Vector, b: Vector) -> Pose:
    turn = geometry.times(geometry.transposed(geometry.rotation(b[3:])), geometry.rotation(a[3:]))
    return _pose([u - v for u, v in zip(a[:3], b[:3], strict=True)] + list(geometry.rotation_vector(turn)))


def _rpy2rotvec(rpy: Vector) -> list[float]:
    x, y, z = (geometry.rotation(v) for v in ((rpy[0], 0, 0), (0, rpy[1], 0), (0, 0, rpy[2])))
    return list(geometry.rotation_vector(geometry.times(z, geometry.times(y, x))))


def _rotvec2rpy(v: Vector) -> list[float]:
    r = geometry.rotation(v)
    return [math.atan2(r[7], r[8]), math.atan2(-r[6], math.hypot(r[0], r[3])), math.atan2(r[3], r[0])]


def _norm(value: Any) -> float:
    return math.hypot(*value) if isinstance(value, list) else abs(value)


def text(value: Any) -> str:
    """Return a value as URScript prints it."""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, float):
        shown = f"{value:.6f}"
        return shown.rstrip("0").rstrip(".") if "." in shown else shown
    if isinstance(value, list):
        return ("p" if isinstance(value, Pose) else "") + "[" + ", ".join(map(text, value)) + "]"
    return str(value)


def _bounded(string: str) -> str:
    if len(string) > _LONGEST:
        raise ScriptError(f"runtime error: a string of more than {_LONGEST} characters")
    return string


def decimal(written: str) -> float | None:
    """Return the number that a text writes, an integer unless it has a point or an exponent; None: it writes none."""
    if not _DECIMAL.fullmatch(written):
        return None
    value = float(written)
    return None if math.isinf(value) else whole(value) if _INTEGER.fullmatch(written) else value


def _number(str: str) -> float:
    value = whole(float(int(str, 16))) if _HEXADECIMAL.fullmatch(str) else decimal(str)
    if value is None:
        raise ScriptError(f"runtime error: to_num: {str[:80]!r} is no number")
    return value


def _length(obj: Any) -> int:
    if not isinstance(obj, (list, str)):
        raise ScriptError(f"runtime error: length: obj is a list or a string, not {text(obj)[:80]}")
    return len(obj)


def _list_length(obj: Any) -> int:
    if not isinstance(obj, list):
        raise ScriptError(f"runtime error: get_list_length: obj is a list, not {text(obj)[:80]}")
    return len(obj)


def _log(base: float, value: float) -> float:
    if base == 1.0:
        raise ScriptError("runtime error: log: base is a number other than 1")
    return math.log(value, base)


def _pow(x: float, y: float) -> float:
    try:
        return math.pow(x, y)
    except (ValueError, OverflowError):
        raise ScriptError(f"runtime error: pow: {x:g} to the power of {y:g} is no finite number") from None


def _character(src: str, index: int) -> str:
    return src[_place(index, len(src) - 1)]


def _part(src: str, index: int, len: int | None = None) -> str:
    # The manual cuts what goes beyond the end: str_sub("abcde", 2, 50) is "cde".
    rest = src[_place(index, src.__len__()) :]
    return rest if len is None else rest[: _place(len, 2**31 - 1)]


def _found(src: str, target: str, start_from: int = 0) -> int:
    return src.find(target, _place(start_from, len(src)))


def _place(index: Any, most: int) -> int:
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index <= most:
        raise ScriptError(f"runtime error: index out of range: {text(index)}, of 0 … {most}")
    return index


def _bits(value: int) -> list[bool]:
    return [bool(int(value) >> i & 1) for i in range(32)]


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "acos": math.acos, "asin": math.asin, "atan": math.atan, "atan2": math.atan2, "cos": math.cos, "sin": math.sin,
    "tan": math.tan, "sqrt": math.sqrt, "pow": _pow,
    "ceil": lambda x: whole(float(math.ceil(x))), "floor": lambda x: whole(float(math.floor(x))),
    "log": _log, "d2r": math.radians, "r2d": math.degrees, "norm": _norm,
    "length": _length, "get_list_length": _list_length,
    "integer_to_binary_list": _bits,
    "binary_list_to_integer": lambda bits: sum(1 << i for i, bit in enumerate(bits) if bit),
    "pose_trans": lambda a, b: _pose(geometry.pose_trans(a, b)),
    "pose_inv": lambda a: _pose(geometry.pose_inv(a)),
    "pose_add": _pose_add,
    "pose_sub": _pose_sub,
    "pose_dist": lambda a, b: math.dist(a[:3], b[:3]),
    "point_dist": lambda a, b: math.dist(a[:3], b[:3]),
    "interpolate_pose": _interpolated,
    "rpy2rotvec": _rpy2rotvec,
    "rotvec2rpy": _rotvec2rpy,
    "wrench_trans": lambda t, w: [
        *geometry.turned(geometry.rotation(t[3:]), w[:3]), *geometry.turned(geometry.rotation(t[3:]), w[3:])
    ],
    "to_str": lambda val: _bounded(text(val)), "to_num": _number,
    "str_cat": lambda op1, op2: _bounded(text(op1) + text(op2)), "str_len": len, "str_empty": lambda str: not str,
    "str_at": _character, "str_sub": _part, "str_find": _found,
}  # fmt: skip
"""What depends on nothing but the arguments; what touches the controller is in ``commands``."""
