"""The header and the table of events of a GDF file: bytes in, numbers out."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hrcneuro.errors import DataError

# Bytes of each type of samples (GDF 1.x and 2.x: the same codes).
_BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 8, 8: 8, 16: 4, 17: 8}
# Kinds of tables of events: bytes of an event. The longer ones have a channel and a duration, too.
_MODES = {1: 6, 3: 12, 5: 6, 7: 12}
# Codes of physical units: those of volts; 512 has no unit, 0 says nothing. Others are other quantities.
_UNITS = {0: "", 512: "", 4256: "V", 4274: "mV", 4275: "uV", 4276: "nV"}


@dataclass(frozen=True)
class Header:
    """What the header of a file says.

    Attributes:
        version: 1.25, 2.10 …
        size: Bytes before the samples.
        records: How many records follow; −1 where the recorder has not said so.
        record_s: Length of one, in s.
        counts: Samples of each channel in a record.
        types: Type of each channel's samples, by its code.
        units: Unit of each channel; empty where none is stated.
    """

    version: float
    size: int
    records: int
    record_s: float
    counts: tuple[int, ...]
    types: tuple[int, ...]
    units: tuple[str, ...]

    @property
    def channels(self) -> int:
        """How many channels there are."""
        return len(self.counts)

    @property
    def record_bytes(self) -> int:
        """Bytes of a record."""
        return sum(n * _BYTES[kind] for n, kind in zip(self.counts, self.types, strict=True))

    def rate(self, channel: int) -> float:
        """Return the sampling rate of a channel, in Hz."""
        return self.counts[channel] / self.record_s


@dataclass(frozen=True)
class Events:
    """The table of events: ndarrays, shape (n_events,); positions count from 1, durations are in samples.

    ``rate`` is that of the positions, in Hz; 0 where the table does not state it.
    """

    positions: np.ndarray
    codes: np.ndarray
    durations: np.ndarray
    rate: float


def read_header(path: Path) -> Header:
    """Return the header of a GDF file.

    Raises:
        DataError: It is none, or it is cut.
    """
    with path.open("rb") as file:
        head = file.read(256)
        if len(head) < 256 or not head.startswith(b"GDF "):
            raise DataError(f"{path.name} is no GDF file: it does not begin with 'GDF '", cure="name another file")
        try:
            version = float(head[4:8])
            size, channels = _sizes(head, version)
            head += file.read(max(size - 256, 0))
            return _parse(head, version, size, channels)
        except (ValueError, struct.error) as error:
            raise DataError(f"{path.name}: its header cannot be read: {error}", cure="copy the file again") from error


def check_size(header: Header, path: Path) -> list[str]:
    """Return what to know of the file's size.

    Raises:
        DataError: It holds fewer records than the header announces, or the header does not say how many.
    """
    if header.records < 0:
        raise DataError(
            f"{path.name} was not closed by its recorder: its header does not say how long it is",
            cure="close it with the program that recorded it, or save it anew with BioSig",
        )
    found = path.stat().st_size - header.size
    if found < header.records * header.record_bytes:
        raise DataError(
            f"{path.name} announces {header.records} records of {header.record_s:g} s, it holds "
            f"{found // header.record_bytes}: it is truncated",
            cure="copy or download the file again",
        )
    return []


def read_events(header: Header, path: Path) -> Events:
    """Return the table of events behind the samples; without one, no events.

    Raises:
        DataError: The table is cut.
    """
    none = Events(np.zeros(0, int), np.zeros(0, int), np.zeros(0, int), 0.0)
    with path.open("rb") as file:
        file.seek(header.size + header.records * header.record_bytes)
        table = file.read()
    if len(table) < 8:
        return none
    mode = table[0]
    if header.version < 1.94:
        rate, count = float(int.from_bytes(table[1:4], "little")), struct.unpack_from("<I", table, 4)[0]
    else:
        count, rate = int.from_bytes(table[1:4], "little"), float(struct.unpack_from("<f", table, 4)[0])
    if mode not in _MODES:
        return none
    if len(table) - 8 < count * _MODES[mode]:
        raise DataError(
            f"{path.name}: its table of events announces {count} and holds fewer: the file is truncated",
            cure="copy or download the file again",
        )
    positions = np.frombuffer(table, "<u4", count, 8)
    codes = np.frombuffer(table, "<u2", count, 8 + 4 * count)
    durations = np.zeros(count, np.uint32)
    if _MODES[mode] > 6:
        durations = np.frombuffer(table, "<u4", count, 8 + 8 * count)
    return Events(positions, codes, durations, rate)


def _sizes(head: bytes, version: float) -> tuple[int, int]:
    if version < 1.9:
        return int(struct.unpack_from("<q", head, 184)[0]), int(struct.unpack_from("<I", head, 252)[0])
    return 256 * int(struct.unpack_from("<H", head, 184)[0]), int(struct.unpack_from("<H", head, 252)[0])


def _parse(head: bytes, version: float, size: int, n: int) -> Header:
    records = struct.unpack_from("<q", head, 236)[0]
    numerator, denominator = struct.unpack_from("<II", head, 244)
    record_s = (numerator or 1) / (denominator or 1)
    channels = 256 + 96 * n  # behind labels (16 bytes) and transducers (80)
    if version < 1.9:
        units = tuple(head[channels + 8 * i : channels + 8 * i + 8].decode("latin-1").strip(" \0") for i in range(n))
    else:
        codes = struct.unpack_from(f"<{n}H", head, channels + 6 * n)
        units = tuple(_UNITS.get(code, f"unit {code}") for code in codes)
    at = 256 + n * 216
    counts, types = struct.unpack_from(f"<{n}i", head, at), struct.unpack_from(f"<{n}i", head, at + 4 * n)
    if unknown := sorted({kind for kind in types if kind not in _BYTES}):
        raise ValueError(f"samples of type {unknown[0]}, which no reader here knows")
    return Header(version, size, int(records), record_s, counts, types, units)
