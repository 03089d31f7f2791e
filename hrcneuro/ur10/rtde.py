"""One client of port 30004, RTDE versions 1 and 2: bytes in, bytes out ("RTDE guide", Universal Robots)."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from math import floor, isfinite
from typing import Any, ClassVar, TypeVar

from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.variables import FORMATS, INPUTS, OUTPUTS, Input, Output

_Field = TypeVar("_Field", Output, Input)

RATE = 125.0
_SLOWEST = 1.0  # packages a second
_LONGEST = 4096  # bytes of a package from a client; a recipe's names may fill 2048
_MOST_RECIPES = 255
ERROR, WARNING = 1, 2


class ProtocolError(Exception):
    """The client does not speak RTDE: the connection is closed."""


class _Layout:
    """The fields of one kind of data package, and how they are packed."""

    def __init__(self, names: list[str], types: list[str]) -> None:
        self.names = names
        self.types = types
        self.format = struct.Struct(">" + "".join(FORMATS[t] for t in types))
        self.counts = [int(f[:-1] or 1) if f[0].isdigit() else 1 for f in (FORMATS[t] for t in types)]


class RtdeSession:
    """The state of one connection."""

    def __init__(self, controller: Controller, taken: dict[str, RtdeSession], send: Callable[[bytes], None]) -> None:
        """Begin; ``taken`` is shared by all sessions and tells which inputs have an owner."""
        self._c = controller
        self._taken = taken
        self._send = send
        self._buffer = b""
        self._version = 1
        self._outputs: _Layout | None = None
        self._readers: list[Callable[[Controller], Any]] = []
        self._inputs: dict[int, _Layout] = {}
        self._every = 1  # cycles between packages
        self._due = 0  # cycles until the next one
        self.started = False

    def close(self) -> None:
        """Let other connections write the inputs that this one has taken."""
        for name in [name for name, owner in self._taken.items() if owner is self]:
            del self._taken[name]
        self.started = False

    def feed(self, data: bytes) -> None:
        """Take what the client sent.

        Raises:
            ProtocolError: It is no RTDE.
        """
        self._buffer += data
        while len(self._buffer) >= 3:
            size, command = struct.unpack_from(">HB", self._buffer)
            if not 3 <= size <= _LONGEST:
                raise ProtocolError(f"a package of {size} bytes")
            if len(self._buffer) < size:
                return
            payload, self._buffer = self._buffer[3:size], self._buffer[size:]
            handler = self._HANDLERS.get(command)
            if handler is None:
                self._message(f"unknown package type {command}", ERROR)
            else:
                handler(self, payload)

    def tick(self) -> None:
        """Send a data package where one is due."""
        if not self.started or self._outputs is None:
            return
        self._due -= 1
        if self._due > 0:
            return
        self._due = self._every
        c, values = self._c, []
        for read, count in zip(self._readers, self._outputs.counts, strict=True):
            value = read(c)
            values.extend(value) if count > 1 else values.append(value)
        body = self._outputs.format.pack(*values)
        self._answer(b"U", body if self._version == 1 else b"\x01" + body)

    def _request_version(self, payload: bytes) -> None:
        (version,) = _unpack(">H", payload)
        accepted = version in (1, 2) and not self.started
        if accepted:
            self._version = version
        self._answer(b"V", bytes([accepted]))

    def _controller_version(self, payload: bytes) -> None:
        self._answer(b"v", struct.pack(">4I", *self._c.version))

    def _text(self, payload: bytes) -> None:
        # The robot logs what clients say.
        text = payload[1:] if self._version == 1 else payload[1 : 1 + payload[0]] if payload else b""
        self._c.tell("text", text.decode("utf-8", "replace"))

    def _setup_outputs(self, payload: bytes) -> None:
        rate = RATE
        if self._version == 2:
            (rate,) = _unpack(">d", payload[:8])
            payload = payload[8:]
        names = _names(payload)
        fields = [self._field(OUTPUTS, name) for name in names]
        types = [field.type if field else "NOT_FOUND" for field in fields]
        good = all(fields) and _SLOWEST <= rate <= RATE and not self.started
        if good:
            self._outputs = _Layout(names, types)
            self._readers = [field.read for field in fields if field]
            # The guide's floor: 50 Hz are a package every second cycle, and packages are even at any rate.
            self._every = floor(RATE / rate)
        answer = ",".join(types).encode()
        self._answer(b"O", answer if self._version == 1 else bytes([bool(good)]) + answer)

    def _field(self, table: Mapping[str, _Field], name: str) -> _Field | None:
        """Return a field that the controller's software has."""
        field = table.get(name)
        return field if field is not None and field.since <= self._c.version[:2] else None

    def _setup_inputs(self, payload: bytes) -> None:
        names = _names(payload)
        types = []
        for name in names:
            field = self._field(INPUTS, name)
            if field is None:
                types.append("NOT_FOUND")
            else:
                types.append("IN_USE" if self._taken.get(name, self) is not self else field.type)
        number = 0
        if not self.started and len(self._inputs) < _MOST_RECIPES and all(t in FORMATS for t in types):
            number = len(self._inputs) + 1
            self._inputs[number] = _Layout(names, types)
            self._taken.update((name, self) for name in names)
        self._answer(b"I", bytes([number]) + ",".join(types).encode())

    def _start(self, payload: bytes) -> None:
        self.started, self._due = True, 0
        self._answer(b"S", b"\x01")

    def _pause(self, payload: bytes) -> None:
        self.started = False
        self._answer(b"P", b"\x01")

    def _data(self, payload: bytes) -> None:
        recipe = self._inputs.get(payload[0]) if payload else None
        # What a package has beyond its recipe is left unread: ur_rtde's getForwardKinematics sends too much.
        if recipe is None or len(payload) - 1 < recipe.format.size:
            self._message("a data package fits no input recipe", ERROR)
            return
        # Inputs are taken before the start, too: ur_rtde's I/O interface never starts.
        values, at = recipe.format.unpack_from(payload, 1), 0
        fields = []
        for name, count in zip(recipe.names, recipe.counts, strict=True):
            fields.append((name, values[at] if count == 1 else values[at : at + count]))
            at += count
        # Masks first: the order in the recipe is the client's.
        for name, value in sorted(fields, key=lambda field: not field[0].endswith("_mask")):
            if isinstance(value, float) and not isfinite(value):
                self._message(f"{name} is not a number", WARNING)
                continue
            INPUTS[name].write(self._c, value)
            self._c.wrote(name)

    def _message(self, text: str, level: int) -> None:
        body = text.encode()[:255]
        if self._version == 1:
            self._answer(b"M", bytes([level]) + body)
        else:
            self._answer(b"M", bytes([len(body)]) + body + b"\x04RTDE" + bytes([level]))

    def _answer(self, command: bytes, payload: bytes) -> None:
        self._send(struct.pack(">H", 3 + len(payload)) + command + payload)

    _HANDLERS: ClassVar[dict[int, Callable[[RtdeSession, bytes], None]]] = {
        ord("V"): _request_version, ord("v"): _controller_version, ord("M"): _text, ord("O"): _setup_outputs,
        ord("I"): _setup_inputs, ord("S"): _start, ord("P"): _pause, ord("U"): _data,
    }  # fmt: skip


def _names(payload: bytes) -> list[str]:
    # Clients end the list with a comma, and some with a zero byte.
    return payload.decode("utf-8", "replace").rstrip("\0").removesuffix(",").split(",")


def _unpack(form: str, payload: bytes) -> tuple[Any, ...]:
    if len(payload) != struct.calcsize(form):
        raise ProtocolError("a package of the wrong length")
    return struct.unpack(form, payload)
