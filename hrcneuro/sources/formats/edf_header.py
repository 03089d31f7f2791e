"""The header of EDF and BDF: what it announces, and whether the file holds it.

EDF: Kemp et al. 1992, doi:10.1016/0013-4694(92)90009-7; EDF+: Kemp & Olivan 2003, doi:10.1016/s1388-2457(03)00123-8;
BDF: BioSemi's 24-bit form of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

from hrcneuro.errors import DataError

_ANNOTATIONS = ("EDF Annotations", "BDF Annotations")
_FIXED, _PER_SIGNAL = 256, 256
_CURE = "copy or download the file again; it must come whole from one saving"


@dataclass(frozen=True)
class Header:
    """What the header says of the records.

    Attributes:
        biosemi: Whether the file calls itself BioSemi's.
        kind: ``EDF+C``, ``EDF+D``, ``BDF+D`` …, as the file states it; empty for plain EDF.
        size: Bytes of the header.
        announced: Records that the header announces, −1 where it does not know.
        record_s: Duration of a record, in s.
        labels, units, counts: Each signal's label, unit and samples a record, annotations among them.
        ranges: Each signal's physical minimum and maximum, digital minimum and maximum.
        width: Bytes a sample.
        found, rest: Whole records that the file holds, and the bytes after them.
    """

    biosemi: bool
    kind: str
    size: int
    announced: int
    record_s: float
    labels: tuple[str, ...]
    units: tuple[str, ...]
    counts: tuple[int, ...]
    ranges: tuple[tuple[float, float, float, float], ...]
    width: int
    found: int
    rest: int

    @property
    def record_bytes(self) -> int:
        """Bytes of a record."""
        return sum(self.counts) * self.width

    @property
    def annotations(self) -> list[int]:
        """Indices of the signals that hold annotations."""
        return [i for i, label in enumerate(self.labels) if label in _ANNOTATIONS]

    @property
    def signals(self) -> list[int]:
        """Indices of the signals that hold samples."""
        return [i for i in range(len(self.labels)) if i not in self.annotations]

    def columns(self, signal: int) -> slice:
        """Return where a signal's bytes lie in a record."""
        ends = list(accumulate(self.counts))
        return slice((ends[signal] - self.counts[signal]) * self.width, ends[signal] * self.width)


def read_header(path: Path) -> Header:
    """Return the header of a file.

    Raises:
        DataError: It is no header of EDF or BDF, or the file holds annotations only.
    """
    with path.open("rb") as file:
        fixed = file.read(_FIXED)
        try:
            signals = int(fixed[252:256])
            rest = file.read(signals * _PER_SIGNAL)
            if len(rest) < signals * _PER_SIGNAL or signals < 1:
                raise ValueError(f"{signals} signals announced, {len(fixed) + len(rest)} bytes of header")
            header = _parsed(fixed, rest, signals, path)
        except ValueError as error:
            raise DataError(
                f"{path.name} does not begin with a header of {path.suffix[1:].upper()}: {error}", cure=_CURE
            ) from error
    if not header.signals:
        raise DataError(
            f"{path.name} holds annotations and no signal",
            cure="name the recording's own file; the annotations of a second file are not read with it",
        )
    if header.record_s <= 0:
        raise DataError(f"{path.name} announces records of {header.record_s:g} s", cure=_CURE)
    if header.width == 3 and path.suffix.lower() == ".edf":
        raise DataError(f"{path.name} is BDF by its header", cure="give it the ending .bdf")
    return header


def _parsed(fixed: bytes, rest: bytes, signals: int, path: Path) -> Header:
    biosemi = fixed[:1] == b"\xff"
    says = biosemi or fixed[192:195] in (b"BDF", b"24B")
    width = 3 if says or path.suffix.lower() == ".bdf" else 2
    counts = tuple(int(_field(rest, 216 * signals, i, 8)) for i in range(signals))
    limits = [[_number(_field(rest, start * signals, i, 8)) for start in (104, 112, 120, 128)] for i in range(signals)]
    size, record = int(fixed[184:192]), sum(counts) * width
    if record <= 0 or size != _FIXED + signals * _PER_SIGNAL:
        raise ValueError(f"a header of {size} bytes for {signals} signals, records of {record} bytes")
    found, left = divmod(max(path.stat().st_size - size, 0), record)
    return Header(
        biosemi=biosemi,
        kind=fixed[192:236].decode("latin-1").strip(),
        size=size,
        announced=int(fixed[236:244]),
        record_s=float(fixed[244:252]),
        labels=tuple(_field(rest, 0, i, 16) for i in range(signals)),
        units=tuple(_field(rest, 96 * signals, i, 8) for i in range(signals)),
        counts=counts,
        ranges=tuple((low, high, least, most) for low, high, least, most in limits),
        width=width,
        found=found,
        rest=left,
    )


def _number(text: str) -> float:
    # Some recorders write a decimal comma.
    return float(text.replace(",", "."))


def _field(rest: bytes, start: int, i: int, width: int) -> str:
    return rest[start + i * width : start + (i + 1) * width].decode("latin-1").strip()


def check_size(header: Header, name: str) -> list[str]:
    """Return notes where the file's size is not quite what the header announces.

    Raises:
        DataError: They differ by more than a record, or there is no record.
    """
    seconds = f"{header.record_s:g} s"
    if not header.found:
        raise DataError(f"{name} holds no record; its header announces {header.announced} of {seconds}", cure=_CURE)
    if header.announced == -1:
        tail = f" and {header.rest} bytes of another, left out" if header.rest else ""
        return [f"{name} was not closed by its recorder: it holds {header.found} records of {seconds}{tail}"]
    surplus = (header.found - header.announced) * header.record_bytes + header.rest
    if abs(surplus) > header.record_bytes:
        raise DataError(
            f"{name} is {'truncated' if surplus < 0 else 'too long'}: its header announces {header.announced} records "
            f"of {seconds}, the file holds {_amount(header)}: "
            f"{abs(surplus) / header.record_bytes * header.record_s:.3g} s {'are missing' if surplus < 0 else 'more'}",
            cure=f"{_CURE} (where the recorder was stopped by force, the header must say -1 records)",
        )
    if not surplus:
        return []
    return [
        f"{name} announces {header.announced} records of {seconds} and holds {_amount(header)}: {header.found} are read"
    ]


def _amount(header: Header) -> str:
    return f"{header.found} and {header.rest} bytes of another" if header.rest else f"{header.found}"
