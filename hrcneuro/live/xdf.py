"""XDF, the file of LabRecorder, as bytes: each function returns one chunk, whole; nothing here touches a file.

A chunk is its length, a tag and its content; what stands in each content follows the specification of XDF 1.0
(github.com/sccn/xdf, wiki "Specifications"). Numbers are little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from xml.sax.saxutils import escape

import numpy as np

MAGIC = b"XDF:"
FILE_HEADER, STREAM_HEADER, SAMPLES, CLOCK_OFFSET, BOUNDARY, STREAM_FOOTER = range(1, 7)
# Readers that find a damaged chunk look for this to go on behind it.
_BOUNDARY_MARK = bytes.fromhex("43a546dccbf5410fb30ed5467383cbe4")
_FORMATS = {
    "float32": "<f4", "double64": "<f8", "int8": "<i1", "int16": "<i2", "int32": "<i4", "int64": "<i8", "string": "",
}  # fmt: skip
"""Name of a stream's format in its description -> NumPy's."""


def file_header(started: str) -> bytes:
    """Return the chunk at a file's beginning, behind :data:`MAGIC`; ``started`` is the time of day, ISO 8601."""
    text = f'<?xml version="1.0"?><info><version>1.0</version><datetime>{escape(started)}</datetime></info>'
    return chunk(FILE_HEADER, text.encode())


def stream_header(number: int, description: str) -> bytes:
    """Return the chunk that says what the stream ``number`` is: its description as XML, root ``info``."""
    return chunk(STREAM_HEADER, struct.pack("<I", number) + description.encode())


def samples(
    number: int, stamps: np.ndarray, values: np.ndarray | Sequence[Sequence[str]], channel_format: str
) -> bytes:
    """Return a chunk of samples, each with its stamp.

    Args:
        number: The stream's.
        stamps: ndarray, shape (n_samples,), seconds of the sender's clock.
        values: ndarray, shape (n_samples, n_channels), of the stream's unit; lists of texts where the format is string.
        channel_format: As the stream's description names it.
    """
    body = (
        _texts(stamps, values) if channel_format == "string" else _numbers(stamps, np.asarray(values), channel_format)
    )
    return chunk(SAMPLES, struct.pack("<I", number) + _length(len(stamps)) + body)


def _numbers(stamps: np.ndarray, values: np.ndarray, channel_format: str) -> bytes:
    rows = np.empty(
        len(stamps), dtype=[("has", "u1"), ("stamp", "<f8"), ("values", _FORMATS[channel_format], values.shape[1:])]
    )
    rows["has"], rows["stamp"], rows["values"] = 8, stamps, values
    return rows.tobytes()


def _texts(stamps: np.ndarray, values: np.ndarray | Sequence[Sequence[str]]) -> bytes:
    parts = []
    for stamp, row in zip(stamps, values, strict=True):
        parts.append(struct.pack("<Bd", 8, stamp))
        for text in row:
            raw = str(text).encode()
            parts += (_length(len(raw)), raw)
    return b"".join(parts)


def clock_offset(number: int, when: float, offset: float) -> bytes:
    """Return a measured difference of clocks: what to add to the stream's stamps to have the recorder's clock.

    Args:
        number: The stream's.
        when: Of the measurement, seconds of the recorder's clock.
        offset: Seconds.
    """
    # XDF wants the time at the sender.
    return chunk(CLOCK_OFFSET, struct.pack("<Idd", number, when - offset, offset))


def boundary() -> bytes:
    """Return the mark behind which a reader can go on after damage."""
    return chunk(BOUNDARY, _BOUNDARY_MARK)


def stream_footer(number: int, first: float, last: float, count: int, offsets: Sequence[tuple[float, float]]) -> bytes:
    """Return the chunk that ends a stream.

    Args:
        number: The stream's.
        first, last: Stamps of its first and last sample, seconds of the sender's clock.
        count: Number of its samples.
        offsets: (when, offset) of each measured difference of clocks, as :func:`clock_offset`.
    """
    first, last = float(first), float(last)
    clocks = "".join(
        f"<offset><time>{when - offset!r}</time><value>{offset!r}</value></offset>" for when, offset in offsets
    )
    text = (
        f'<?xml version="1.0"?><info><first_timestamp>{first!r}</first_timestamp><last_timestamp>{last!r}'
        f"</last_timestamp><sample_count>{count}</sample_count><clock_offsets>{clocks}</clock_offsets></info>"
    )
    return chunk(STREAM_FOOTER, struct.pack("<I", number) + text.encode())


def chunk(tag: int, content: bytes) -> bytes:
    """Return a chunk: length, tag, content."""
    return _length(len(content) + 2) + struct.pack("<H", tag) + content


def _length(number: int) -> bytes:
    """Return a number with the count of its bytes before it, as XDF writes lengths."""
    for size, code in ((1, "<BB"), (4, "<BI")):
        if number < 1 << (8 * size):
            return struct.pack(code, size, number)
    return struct.pack("<BQ", 8, number)
