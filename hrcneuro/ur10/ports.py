"""One client of a script port (30001 to 30003) or of the port for faults (29998): bytes in, programs and faults out."""

from __future__ import annotations

import codecs
from collections.abc import Callable

from hrcneuro.errors import ConfigError
from hrcneuro.ur10.faults import Schedule, parse
from hrcneuro.ur10.urscript.lexer import ScriptError, Splitter


class ScriptPort:
    """What a script port takes: programs."""

    def __init__(self, run: Callable[[str], None]) -> None:
        """Hand programs to ``run``."""
        self._splitter, self._run, self.closed = Splitter(), run, False
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")

    def feed(self, data: bytes) -> None:
        """Run the programs that ``data`` completes."""
        try:
            for script in self._splitter.feed(self._decoder.decode(data)):
                self._run(script)
        except ScriptError:
            self.closed = True


class FaultPort:
    """The port for faults: a line each, as on the command line."""

    def __init__(self, schedule: Schedule, send: Callable[[bytes], None]) -> None:
        """Answer through ``send``."""
        self._schedule, self._send, self._buffer, self.closed = schedule, send, b"", False

    def feed(self, data: bytes) -> None:
        """Bring about what the lines ask for."""
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        self.closed = len(self._buffer) > 1000
        for line in filter(None, (line.decode("utf-8", "replace").strip() for line in lines)):
            try:
                self._schedule.apply(parse(line))
                self._send(b"ok\n")
            except ConfigError as error:
                self._send(f"error: {error.problem}\n".encode())
