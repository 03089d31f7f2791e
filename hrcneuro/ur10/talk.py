"""URScript's socket functions, as threads call them: they wait from cycle to cycle, on the controller's clock."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from math import nan
from typing import Any

from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.sockets import Link, Sockets
from hrcneuro.ur10.urscript.library import decimal, text
from hrcneuro.ur10.urscript.runtime import Routine
from hrcneuro.ur10.urscript.values import whole

_CONNECT = 2.0  # s: the script manual's
_LONGEST_TEXT = 1024
_READ = 50  # turns of a loop that a read weighs: a client that sends without end must not fill a cycle
_ESCAPES = {"\\n": "\n", "\\t": "\t", "\\r": "\r"}


class Talk:
    """The socket functions of one controller."""

    def __init__(self, controller: Controller, sockets: Sockets) -> None:
        """Bind to a controller, whose clock and threads they use, and to its connections."""
        self._c, self._sockets = controller, sockets

    def functions(self) -> dict[str, Callable[..., Any]]:
        """Return the functions by their names in a script."""
        return {name: getattr(self, name) for name in dir(self) if name.startswith("socket_")}

    def socket_open(self, address: str, port: int, socket_name: str = "socket_0") -> Routine:
        """Return whether someone took the connection within two seconds."""
        try:
            link = self._sockets.open(socket_name, address, int(port))
            until = self._c.now + _CONNECT
            program = self._c.running
            if program is not None and not program.secondary:
                # Over a wire, nobody has answered in the same instant: whoever takes two connections has time between.
                yield from program.give_way()
            yield from self._wait(lambda: link.connected() or self._c.now >= until)
            taken = link.connected()
        except (OSError, ValueError, OverflowError) as error:
            self._c.tell("text", f"socket_open: {address}:{port}: {error}")
            taken = False
        if not taken:
            self._sockets.close(socket_name)
        return taken

    def socket_close(self, socket_name: str = "socket_0") -> None:
        """Hang up."""
        self._sockets.close(socket_name)

    # --- numbers ------------------------------------------------------------------------------------------------

    def socket_read_binary_integer(self, number: int, socket_name: str = "socket_0", timeout: float = 2) -> Routine:
        """Return how many integers of 32 bits were read, all or none, and each of them, or -1."""
        size = int(number)
        data = yield from self._bytes(socket_name, 4 * size, timeout)
        return [size, *struct.unpack(f">{size}i", data)] if data else [0] + [-1] * size

    def socket_read_byte_list(self, number: int, socket_name: str = "socket_0", timeout: float = 2) -> Routine:
        """Return how many bytes were read, all or none, and each of them, or -1."""
        size = int(number)
        data = yield from self._bytes(socket_name, size, timeout)
        return [size, *data] if data else [0] + [-1] * size

    def socket_read_ascii_float(self, number: int, socket_name: str = "socket_0", timeout: float = 2) -> Routine:
        """Return how many numbers stood between brackets, and each of them, or nan."""
        said = yield from self._text(socket_name, "(", ")", timeout)
        values = [float(value) for word in said.split(",") if (value := decimal(word)) is not None]
        size = int(number)
        return [size, *values] if len(values) == said.count(",") + 1 == size else [0] + [nan] * size

    # --- texts --------------------------------------------------------------------------------------------------

    def socket_read_string(
        self, socket_name: str = "socket_0", prefix: str = "", suffix: str = "", interpret_escape: bool = False,
        timeout: float = 2,
    ) -> Routine:  # fmt: skip
        """Return what stands between prefix and suffix, or all that has come; nothing after the timeout."""
        if interpret_escape is True:
            for written, meant in _ESCAPES.items():
                prefix, suffix = prefix.replace(written, meant), suffix.replace(written, meant)
        return (yield from self._text(socket_name, prefix, suffix, timeout))

    def socket_read_line(self, socket_name: str = "socket_0", timeout: float = 2) -> Routine:
        """Return the next line without its end; nothing after the timeout."""
        line = yield from self._text(socket_name, "", "\n", timeout)
        return line.removesuffix("\r")

    def socket_get_var(self, name: str, socket_name: str = "socket_0") -> Routine:
        """Ask for an integer, ``GET name``, and return it; 0 where no ``name integer`` comes."""
        self._send(socket_name, f"GET {name}\n".encode())
        line = yield from self._text(socket_name, "", "\n", 2.0)
        found = re.fullmatch(rf"{re.escape(name)} (-?[0-9]{{1,10}})\s*", line)
        return whole(float(found[1])) if found else 0

    def socket_set_var(self, name: str, value: int, socket_name: str = "socket_0") -> None:
        """Send ``SET name value``."""
        self._send(socket_name, f"SET {name} {int(value)}\n".encode())

    def socket_send_byte(self, value: int, socket_name: str = "socket_0") -> bool:
        """Return whether a byte was sent."""
        return self._send(socket_name, bytes([int(value)]))

    def socket_send_int(self, value: int, socket_name: str = "socket_0") -> bool:
        """Return whether an integer of 32 bits was sent."""
        return self._send(socket_name, struct.pack(">i", int(value)))

    def socket_send_string(self, str: Any, socket_name: str = "socket_0") -> bool:
        """Return whether a text was sent."""
        return self._send(socket_name, text(str).encode())

    def socket_send_line(self, str: Any, socket_name: str = "socket_0") -> bool:
        """Return whether a line was sent."""
        return self._send(socket_name, text(str).encode() + b"\n")

    # --- waiting ------------------------------------------------------------------------------------------------

    def _send(self, name: str, data: bytes) -> bool:
        link = self._sockets.get(name)
        return link is not None and link.send(data)

    def _wait(self, ready: Callable[[], bool]) -> Routine:
        program = self._c.running
        assert program is not None
        yield from program.wait_until(ready)

    def _await(self, name: str, complete: Callable[[bytes], bool], timeout: float) -> Routine:
        """Return the connection when what came is complete; None where it ends or takes too long."""
        self._c.charge(_READ)
        link = self._sockets.get(name)
        if link is None:
            return None
        if self._c.running is not None:
            self._c.running.current.overruns = 0  # who reads waits for others, even where all has come already
        until = self._c.now + timeout if timeout > 0.0 else float("inf")
        yield from self._wait(lambda: complete(link.take()) or link.ended or self._c.now >= until - 1e-9)
        return link if complete(link.received) else None

    def _bytes(self, name: str, size: int, timeout: float) -> Routine:
        link: Link | None = yield from self._await(name, lambda data: len(data) >= size, timeout)
        if link is None:
            return b""
        data, link.received = link.received[:size], link.received[size:]
        return data

    def _text(self, name: str, prefix: str, suffix: str, timeout: float) -> Routine:
        first, last = prefix.encode(), suffix.encode()

        def span(data: bytes) -> tuple[int, int]:
            begin = data.find(first)
            end = data.find(last, begin + len(first)) if last else len(data)
            return (begin + len(first), end) if begin >= 0 else (0, -1)

        def complete(data: bytes) -> bool:
            begin, end = span(data)
            return end > begin or (bool(last) and end == begin)

        link: Link | None = yield from self._await(name, complete, timeout)
        if link is None:
            return ""
        begin, end = span(link.received)
        said, link.received = link.received[begin:end], link.received[end + len(last) :]
        return said[:_LONGEST_TEXT].decode("utf-8", "replace")
