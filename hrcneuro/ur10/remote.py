"""URScript's remote procedure calls: ``rpc_factory`` and the calls of what it returns, over XML-RPC.

Each call is a connection of its own; its thread waits from cycle to cycle, as it does for sockets.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import Any
from xmlrpc.client import Error, dumps, loads

from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.sockets import Link, Sockets
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.urscript.library import text
from hrcneuro.ur10.urscript.runtime import Pose, Routine

_CONNECT = 2.0  # s: as for sockets
_COST = 100  # turns of a loop that a call weighs
_URL = re.compile(r"http://(?P<address>[^:/]+)(?::(?P<port>\d{1,5}))?(?P<path>/[\x21-\x7e]*)?")
_LENGTH = re.compile(rb"\r\ncontent-length:\s*(\d+)\s*\r\n", re.IGNORECASE)
_POSE = ("x", "y", "z", "rx", "ry", "rz")
_HANGS_UP = "closeXMLRPCClientConnection"


@dataclass(frozen=True)
class Handle:
    """What a program calls functions of: where their server is."""

    address: str
    port: int
    path: str


class Remote:
    """The remote procedure calls of one controller."""

    def __init__(self, controller: Controller, sockets: Sockets) -> None:
        """Bind to a controller, whose clock and threads they use, and to its connections."""
        self._c, self._sockets, self._numbers = controller, sockets, count()

    def functions(self) -> dict[str, Callable[..., Any]]:
        """Return the functions: ``rpc_factory``, and what translated code calls for ``handle.function(…)``."""
        return {"rpc_factory": rpc_factory, "_remote": self.call}

    def call(self, handle: Any, function: str, *given: Any) -> Routine:
        """Return what a function of a handle's server returns.

        Raises:
            ScriptError: Nobody answers, or not with a value that a program can have.
        """
        if not isinstance(handle, Handle):
            raise ScriptError(f"runtime error: {text(handle)[:80]} has no functions: rpc_factory returns what has")
        if function == _HANGS_UP:  # there is no connection between calls
            return None
        self._c.charge(_COST)
        name = f"remote procedure call {next(self._numbers)}"
        try:
            reply = yield from self._exchange(name, handle, _request(handle, function, given))
        except (OSError, ValueError, OverflowError) as error:
            raise ScriptError(f"runtime error: {function}: {handle.address}:{handle.port}: {error}") from None
        finally:
            self._sockets.close(name)
        return _result(function, reply)

    def _exchange(self, name: str, handle: Handle, request: bytes) -> Routine:
        program = self._c.running
        assert program is not None
        link = self._sockets.open(name, handle.address, handle.port)
        until = self._c.now + _CONNECT
        yield from program.wait_until(lambda: link.connected() or self._c.now >= until)
        if not link.connected() or not link.send(request):
            raise OSError("nobody takes the call")
        yield from program.wait_until(lambda: _complete(link))
        return link.received


def rpc_factory(type: str, url: str) -> Handle:
    """Return a handle on a server; it is asked first when a function is called."""
    if type != "xmlrpc":
        raise ScriptError(f"runtime error: rpc_factory: xmlrpc is the only type, not {text(type)[:80]}")
    match = _URL.fullmatch(url) if isinstance(url, str) else None
    if match is None:
        raise ScriptError(f"runtime error: rpc_factory: http://ADDRESS:PORT/PATH is taken, not {text(url)[:80]}")
    return Handle(match["address"], int(match["port"] or 80), match["path"] or "/")


def _request(handle: Handle, function: str, given: tuple[Any, ...]) -> bytes:
    body = dumps(tuple(_sent(value) for value in given), function).encode()
    head = (
        f"POST {handle.path} HTTP/1.0\r\nHost: {handle.address}:{handle.port}\r\n"
        f"Content-Type: text/xml\r\nContent-Length: {len(body)}\r\n\r\n"
    )
    return head.encode() + body


def _complete(link: Link) -> bool:
    head, end, body = link.take().partition(b"\r\n\r\n")
    length = _LENGTH.search(head + b"\r\n")
    if link.full:
        raise OSError("the answer is too long")
    return link.ended or bool(end and length and len(body) >= int(length[1]))


def _result(function: str, reply: bytes) -> Any:
    head, _, body = reply.partition(b"\r\n\r\n")
    status = head.split(b"\r\n", 1)[0].split()[1:2]
    if status != [b"200"]:
        raise ScriptError(f"runtime error: {function}: the server answers {head[:80].decode('ascii', 'replace')!r}")
    try:
        values, _ = loads(body)
        return _taken(*values)
    except Error as error:
        raise ScriptError(f"runtime error: {function}: {str(error)[:200]}") from None
    except Exception as error:  # whatever the parsers of XML and of its values make of foreign bytes
        raise ScriptError(f"runtime error: {function}: no XML-RPC ({str(error)[:200]})") from None


def _sent(value: Any) -> Any:
    if isinstance(value, Pose):
        return dict(zip(_POSE, map(float, value), strict=True))
    if isinstance(value, list):
        return [_sent(v) for v in value]
    if isinstance(value, (bool, int, float, str)):
        return value
    raise ScriptError(f"runtime error: no remote procedure takes {text(value)[:80]}")


def _taken(value: Any) -> Any:
    if isinstance(value, dict) and sorted(value) == sorted(_POSE):
        return Pose(float(value[key]) for key in _POSE)
    if isinstance(value, list):
        return [_taken(v) for v in value]
    if isinstance(value, (bool, int, float, str)):
        return value
    raise ValueError(f"a program has no values like {value!r}")
