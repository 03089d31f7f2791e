"""A writer of small EDF and BDF files, with everything in it that their specifications allow and recorders do wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

_LIST_BYTES = 120


def tal(onset: str, *texts: str | bytes, duration: str = "") -> bytes:
    """Return one time-stamped list of annotations."""
    parts = [text.encode() if isinstance(text, str) else text for text in texts]
    return f"{onset}{chr(21) + duration if duration else ''}".encode() + b"\x14" + b"\x14".join(parts) + b"\x14\x00"


def save_edf(
    path: Path,
    signals: Sequence[tuple[str, str, np.ndarray]],
    *,
    record_s: float = 1.0,
    times: Sequence[str] | None = None,
    lists: Mapping[int, bytes] | None = None,
    second: Mapping[int, bytes] | None = None,
    kind: str = "EDF+C",
    announced: int | None = None,
    biosemi: bool = False,
) -> Path:
    """Write a file of 16-bit (``.edf``) or 24-bit (``.bdf``) samples.

    Args:
        path: Where to.
        signals: (label, unit, values); values ndarray, shape (n_records, samples a record). A step is 0.1 units, in
            24 bits 1/32; a label ``Status`` has whole words.
        record_s: Duration of a record.
        times: What the first list of each record says of its time; without it the file has no annotations.
        lists: Record -> further lists in it.
        second: Record -> lists of a second annotation signal.
        kind: The header's words for continuous or not.
        announced: Records that the header announces, where it is not how many there are.
        biosemi: Whether the header begins as BioSemi's do.
    """
    records = len(signals[0][2])
    width = 3 if path.suffix.lower() == ".bdf" else 2
    top = 2 ** (8 * width - 1)
    rows = [(label, unit, values.shape[1], _range(label, top)) for label, unit, values in signals]
    own = ("BDF" if width == 3 else "EDF") + " Annotations"
    rows += [(own, "", _LIST_BYTES // width, (-1, 1))] * ((times is not None) + (second is not None))
    path.write_bytes(_header(rows, top, kind, biosemi, records if announced is None else announced, record_s))
    with path.open("ab") as file:
        for i in range(records):
            for label, _, values in signals:
                low, high = _range(label, top)
                steps = np.round((values[i] - low) / (high - low) * (2 * top - 1) - top)
                file.write(_packed(steps.astype(np.int64), width))
            if times is not None:
                file.write((tal(times[i], "") + (lists or {}).get(i, b"")).ljust(_LIST_BYTES, b"\x00"))
            if second is not None:
                file.write(second.get(i, b"").ljust(_LIST_BYTES, b"\x00"))
    return path


def _range(label: str, top: int) -> tuple[float, float]:
    if label == "Status":
        return (-top, top - 1)
    # BioSemi's range has a 32nd of a microvolt a step; the header's fields hold eight characters.
    return (-top / 10, (top - 1) / 10) if top < 1 << 16 else (-262144.0, 262143.0)


def _header(rows: list[tuple], top: int, kind: str, biosemi: bool, announced: int, record_s: float) -> bytes:
    def field(value: object, size: int) -> bytes:
        return (f"{value:.8g}" if isinstance(value, float) else str(value)).encode("latin-1").ljust(size)[:size]

    count = len(rows)
    columns = [[row[0] for row in rows], [""] * count, [row[1] for row in rows]]
    columns += [[float(row[3][0]) for row in rows], [float(row[3][1]) for row in rows]]
    columns += [[-top] * count, [top - 1] * count, [""] * count, [row[2] for row in rows], [""] * count]
    sizes = (16, 80, 8, 8, 8, 8, 8, 80, 8, 32)
    return (
        (b"\xffBIOSEMI" if biosemi else field("0", 8)) + field("X X X X", 80) + field("Startdate 01-JAN-2020 X X X", 80)
        + field("01.01.20", 8) + field("00.00.00", 8) + field(256 * (count + 1), 8) + field(kind, 44)
        + field(announced, 8) + field(record_s, 8) + field(count, 4)
        + b"".join(field(value, size) for column, size in zip(columns, sizes, strict=True) for value in column)
    )  # fmt: skip


def _packed(steps: np.ndarray, width: int) -> bytes:
    return steps.astype("<i4").view(np.uint8).reshape(-1, 4)[:, :width].tobytes()
