"""Standard streams that outlive their readers: closed, full, or without a character, they never end the work under way.

What standard output cannot take is dropped from there on; :func:`ended` says so at the end. A reader that left
(``| head``) and a stream that was closed from the start (``>&-``) are what somebody asked for, and no failure.
"""

from __future__ import annotations

import codecs
import errno
import io
import os
import re
import select
import sys
from collections.abc import Callable
from typing import Any, TextIO

# What repr() makes of a byte of a name that could not be read as text.
_QUOTED_BYTE = re.compile(r"\\udc([89a-f][0-9a-f])")
_GONE = (errno.EPIPE, errno.EIO)  # the reader of a pipe, or the terminal


class _Sink(io.FileIO):
    """A stream's file, whose writes never fail; the first fault is kept."""

    fault: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all that the stream takes; the rest is gone."""
        rest = memoryview(data)
        while rest and self.fault is None:
            try:
                written = super().write(rest)
            except OSError as error:
                self.fault = error
            else:
                rest = rest[written or 0 :]
                if written is None:
                    # Somebody made the pipe answer "not now" instead of letting its writers wait.
                    select.select([], [self], [])
        return len(data)


def prepare() -> None:
    """Put streams in the place of this process's own that take whatever is written to them."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # Else the next file that is opened becomes standard output, for this process or its children.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    if sys.stdin is None:
        sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stdout = _stream(1, sys.stdout, "hrcneuro.output")
    sys.stderr = _stream(2, sys.stderr, "hrcneuro.talk")


def ended(code: int) -> int:
    """Return the exit code of a command that ends with ``code``: 1 where all went well but its output is lost."""
    sys.stdout.flush()
    fault = getattr(getattr(sys.stdout.buffer, "raw", sys.stdout.buffer), "fault", None)
    if fault is None or fault.errno in _GONE:
        return code
    print(f"error: standard output cannot be written: {fault.strerror}", file=sys.stderr)
    print("  cure: free space there, or send the output elsewhere; then run the same command again", file=sys.stderr)
    return code or 1


class _Talk(io.TextIOWrapper):
    """Standard error: for people, also where a message quotes a name as Python writes it."""

    def write(self, text: str) -> int:
        super().write(_QUOTED_BYTE.sub(r"\\x\1", text))
        return len(text)


def _stream(number: int, given: TextIO | None, errors: str) -> TextIO:
    encoding = getattr(given, "encoding", None) or "utf-8"
    # Unbuffered (python -u) stays unbuffered; whoever looks on sees each line as it comes.
    through = bool(getattr(given, "write_through", False))
    sink = _Sink(number, "w", closefd=False)
    binary: Any = sink if through else io.BufferedWriter(sink)
    lines = number == 2 or sink.isatty()
    kind = _Talk if number == 2 else io.TextIOWrapper
    return kind(binary, encoding, errors, line_buffering=lines, write_through=through)


def _encoder(of_byte: Callable[[int], bytes]) -> Callable[[UnicodeError], tuple[bytes, int]]:
    """Return what encodes what an encoding lacks: a byte of a file's name as told, the rest as ``\\uXXXX``."""

    def encode(error: UnicodeError) -> tuple[bytes, int]:
        assert isinstance(error, UnicodeEncodeError)
        text = error.object[error.start : error.end]
        return b"".join(of_byte(ord(c) - 0xDC00) if _is_byte(c) else _escape(c) for c in text), error.end

    return encode


def _is_byte(character: str) -> bool:
    """Return whether a character stands for a byte that could not be read as text (PEP 383)."""
    return "\udc80" <= character <= "\udcff"


def _escape(character: str) -> bytes:
    number = ord(character)
    return b"\\u%04x" % number if number < 0x10000 else b"\\U%08x" % number


# JSON and TOML read such an escape back; a name that is not in UTF-8 stays one that the system finds.
codecs.register_error("hrcneuro.output", _encoder(lambda byte: bytes([byte])))
# For people, each byte is shown.
codecs.register_error("hrcneuro.talk", _encoder(lambda byte: b"\\x%02x" % byte))
