"""What ports 30001 and 30002 send once: the version to whoever connects, and on 30001 what the controller says.

Layouts: "Client interfaces, CB-series", Universal Robots; big-endian throughout.
"""

from __future__ import annotations

import struct

from hrcneuro.ur10.controller import Controller
from hrcneuro.ur10.modes import Notice

ROBOT_MESSAGE = 20
TEXT, LABEL, POPUP, VERSION, SAFETY_MODE, ERROR_CODE, KEY, EXCEPTION = 0, 1, 2, 3, 5, 6, 7, 10
_WARNING = 2  # how bad an error is, on a scale from 0, for debugging, to 5; protective stops are warnings
_LONGEST = 1000  # bytes of a text


def version(c: Controller) -> bytes:
    """Return what a client is sent first."""
    name, (major, minor, bugfix, build) = b"URControl", c.version
    head = struct.pack(">B9s2B2i", len(name), name, major, minor, bugfix, build)
    return _message(c, VERSION, head + b"01-01-2019, 00:00:00")


def message(c: Controller, notice: Notice) -> bytes:
    """Return a notice as port 30001 sends it; errors carry their number in UR's list, or 0."""
    text = notice.text.encode("utf-8", "replace")[:_LONGEST]
    if notice.kind == "popup":
        return _message(c, POPUP, struct.pack(">I4BB", 0, 0, 0, 0, 0, 5) + b"Popup" + text)
    if notice.kind == "label":
        return _message(c, LABEL, struct.pack(">i", notice.number) + text)
    if notice.kind == "safety":
        return _message(c, SAFETY_MODE, struct.pack(">iiBII", 0, 0, notice.number, 0, 0))
    if notice.kind == "error":
        return _message(c, ERROR_CODE, struct.pack(">iiiII", notice.number, 0, _WARNING, 0, 0) + text)
    if notice.kind == "exception":
        place, code = struct.pack(">ii", notice.line, notice.column), notice.code.encode()
        # The controller's own word is terse; what a person needs follows as a text.
        return _message(c, EXCEPTION, place + (code or text)) + (_message(c, TEXT, text) if code else b"")
    if notice.kind in ("started", "stopped"):
        title = f"PROGRAM_XXX_{notice.kind.upper()}".encode()
        return _message(c, KEY, struct.pack(">iiB", 0, 0, len(title)) + title + text)
    return _message(c, TEXT, text)


def _message(c: Controller, kind: int, body: bytes) -> bytes:
    return struct.pack(">iBQbb", 15 + len(body), ROBOT_MESSAGE, int(c.now * 1e6), -2, kind) + body
