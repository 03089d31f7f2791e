"""Small recordings in the formats of several makers, byte by byte as their descriptions have them."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

Event = tuple[int, int]
"""Sample, counted from 0, and code."""


def save_gdf(
    path: Path,
    signals: Sequence[tuple[str, str, np.ndarray]],
    events: Sequence[tuple[int, int, int]] = (),
    *,
    version: float = 2.1,
    rate: int = 100,
    event_rate: float = 0,
    records: int | None = None,
) -> Path:
    """Write GDF 1.25 or 2.x, in records of a second, 16-bit samples of 0.1 units.

    Args:
        path: Where to.
        signals: (label, unit, values); values ndarray, shape (n_times,), whole seconds of samples.
        events: (sample from 0, code, duration in samples).
        version: Below 1.9 it is a 1.x.
        rate: Samples a second of the first signal.
        event_rate: That of the events' positions; 0: not stated.
        records: How many the header announces, where that is not what there is.
    """
    n, old = len(signals), version < 1.9
    counts = [rate * len(values) // len(signals[0][2]) for _, _, values in signals]
    found = len(signals[0][2]) // rate
    head = bytearray(256)
    head[:8] = f"GDF {version:4.2f}".encode()
    struct.pack_into("<q" if old else "<H", head, 184, 256 * (n + 1) if old else n + 1)
    struct.pack_into("<q", head, 236, found if records is None else records)
    struct.pack_into("<II", head, 244, 1, 1)
    struct.pack_into("<I" if old else "<H", head, 252, n)
    labels = b"".join(label.encode().ljust(16) for label, _, _ in signals) + b" " * 80 * n
    if old:
        units = b"".join(unit.encode().ljust(8) for _, unit, _ in signals)
        limits = np.array([[-3276.8] * n, [3276.7] * n]).tobytes() + np.array([[-32768] * n, [32767] * n]).tobytes()
    else:
        codes = {"uV": 4275, "mV": 4274, "nV": 4276, "V": 4256, "": 0, "degC": 6048}
        units = b" " * 6 * n + struct.pack(f"<{n}H", *(codes[unit] for _, unit, _ in signals))
        limits = np.array([[-3276.8] * n, [3276.7] * n, [-32768.0] * n, [32767.0] * n]).tobytes()
    middle = b" " * 80 * n if old else b" " * 68 * n + np.zeros(3 * n, "<f4").tobytes()
    kinds = struct.pack(f"<{n}i", *counts) + struct.pack(f"<{n}i", *[3] * n)
    body = b"".join(
        np.rint(values[k * count : (k + 1) * count] * 10).astype("<i2").tobytes()
        for k in range(found)
        for count, (_, _, values) in zip(counts, signals, strict=True)
    )
    variable = labels + units + limits + middle + kinds
    path.write_bytes(bytes(head) + variable + bytes(256 * n - len(variable)) + body + _table(events, old, event_rate))
    return path


def _table(events: Sequence[tuple[int, int, int]], old: bool, rate: float) -> bytes:
    at, codes, lasts = (np.array([event[i] for event in events]) for i in range(3)) if events else [np.zeros(0)] * 3
    size = len(events)
    if old:
        start = struct.pack("<B", 3) + int(rate).to_bytes(3, "little") + struct.pack("<I", size)
    else:
        start = struct.pack("<B", 3) + size.to_bytes(3, "little") + struct.pack("<f", rate)
    columns = ((at + 1, "<u4"), (codes, "<u2"), (np.zeros(size), "<u2"), (lasts, "<u4"))
    return start + b"".join(values.astype(kind).tobytes() for values, kind in columns)


def save_neuroscan(
    path: Path,
    data_uv: np.ndarray,
    names: Sequence[str],
    events: Sequence[tuple[int, int, int]] = (),
    *,
    rate: int = 100,
    wide: bool = False,
    counted: bool = True,
    bads: Sequence[str] = (),
) -> Path:
    """Write Neuroscan's .cnt; a step is 0.1 µV.

    Args:
        path: Where to.
        data_uv: ndarray, shape (n_channels, n_times).
        names: Of the channels.
        events: (sample, code, upper half of the byte of acceptance: 0, or 14 where time was lost).
        rate: Sampling rate.
        wide: 32 bits instead of 16.
        counted: Whether the header counts the samples; else the next file in it tells how wide they are.
        bads: Channels that are marked as bad.
    """
    n, width = len(names), 4 if wide else 2
    start, samples = 900 + 75 * n, np.rint(data_uv.T * 10).astype("<i4" if wide else "<i2")
    table_at = start + samples.size * width
    rows = b"".join(
        struct.pack("<HBBi", code, 0, accept << 4, start + at * n * width) + bytes(11) for at, code, accept in events
    )
    table = struct.pack("<Bii", 2, len(rows), 0) + rows
    head = bytearray(900)
    head[:12] = b"Version 3.0\0"
    struct.pack_into("<i", head, 12, table_at + len(table))
    struct.pack_into("<HH", head, 370, n, 0)
    struct.pack_into("<H", head, 376, rate)
    struct.pack_into("<i", head, 864, len(samples) if counted else 0)
    struct.pack_into("<i", head, 886, table_at)
    channels = b""
    for i, name in enumerate(names):
        one = bytearray(75)
        one[: len(name)] = name.encode()
        one[14] = name in bads
        struct.pack_into("<ff", one, 19, 10.0 * np.cos(i), 10.0 * np.sin(i))
        struct.pack_into("<f", one, 59, 20.48)
        struct.pack_into("<f", one, 71, 1.0)
        channels += bytes(one)
    later = bytearray(60)
    later[52] = wide
    path.write_bytes(bytes(head) + channels + samples.tobytes() + table + bytes(later))
    return path


def save_egi(
    path: Path,
    data: np.ndarray,
    lines: Sequence[tuple[str, Sequence[int]]] = (),
    *,
    rate: int = 100,
    bits: int = 0,
    span: int = 0,
    version: int = 4,
) -> Path:
    """Write EGI's simple binary format in single precision.

    Args:
        path: Where to.
        data: ndarray, shape (n_channels, n_times): µV, or steps of ``span`` µV / 2 ** ``bits``.
        lines: (code of four letters, samples in which it is high).
        rate: Sampling rate.
        bits, span: Of the amplifier; 0: the numbers are microvolts.
        version: 4, single precision; 5 has segments.
    """
    n, samples = data.shape
    head = struct.pack(">i6hi", version, 2020, 1, 2, 3, 4, 5, 6) + struct.pack(">5h", rate, n, 1, bits, span)
    head += struct.pack(">ih", samples, len(lines)) + b"".join(code.encode() for code, _ in lines)
    high = np.zeros((len(lines), samples))
    for row, (_, at) in zip(high, lines, strict=True):
        row[list(at)] = 1
    path.write_bytes(head + np.concatenate([data, high]).T.astype(">f4").tobytes())
    return path


def save_nedf(path: Path, data_uv: np.ndarray, names: Sequence[str], triggers: Sequence[Event] = ()) -> Path:
    """Write NEDF 1.3 at 500 Hz, in blocks of five samples, each with one of the accelerometer."""
    n, samples = data_uv.shape
    montage = "".join(f"<Channel_{i + 1}>{name}</Channel_{i + 1}>" for i, name in enumerate(names))
    head = (
        "<EEGSession><NEDFversion>1.3</NEDFversion><NumberOfChannelsOfAccelerometer>3</NumberOfChannelsOfAccelerometer>"
        f"<EEGSettings><TotalNumberOfChannels>{n}</TotalNumberOfChannels><EEGSamplingRate>500</EEGSamplingRate>"
        f"<NumberOfRecordsOfEEG>{samples}</NumberOfRecordsOfEEG><EEGMontage>{montage}</EEGMontage></EEGSettings>"
        "<StepDetails><StartDate_firstEEGTimestamp>1000000</StartDate_firstEEGTimestamp></StepDetails></EEGSession>"
    )
    steps = np.rint(data_uv.T * 1e-6 * 6 * 8388607 / 2.4).astype(np.int64) & 0xFFFFFF
    codes = np.zeros(samples, ">i4")
    for at, code in triggers:
        codes[at : at + 5] = code
    body = b"".join(
        bytes(6) * (i % 5 == 0) + b"".join(int(one).to_bytes(3, "big") for one in row) + code.tobytes()
        for i, (row, code) in enumerate(zip(steps, codes, strict=True))
    )
    path.write_bytes(head.encode().ljust(10240, b"\0") + body)
    return path


def save_bci2000(
    path: Path,
    raw: np.ndarray,
    states: dict[str, np.ndarray],
    *,
    names: Sequence[str] = (),
    gains: Sequence[str] = (),
    offsets: Sequence[float] = (),
    rate: str = "100Hz",
    form: str = "int32",
) -> Path:
    """Write BCI2000's .dat.

    Args:
        path: Where to.
        raw: ndarray, shape (n_channels, n_times), in steps.
        states: Name -> ndarray, shape (n_times,), values of a byte.
        names, gains, offsets: Of the channels.
        rate: As the header has it.
        form: ``int16``, ``int32`` or ``float32``.
    """
    n = len(raw)
    lists = {"ChannelNames": names, "SourceChGain": gains, "SourceChOffset": offsets}
    parameters = "".join(
        f"Source list {name}= {len(values)} {' '.join(map(str, values))} // of it\r\n" for name, values in lists.items()
    )
    described = "".join(f"{name} 8 0 {i} 0\r\n" for i, name in enumerate(states))
    text = (
        f"[ State Vector Definition ]\r\n{described}[ Parameter Definition ]\r\n{parameters}"
        f"Source int SamplingRate= {rate} 256Hz 1 % // rate\r\n\r\n"
    )
    first = f"BCI2000V= 1.1 HeaderLen= {{:6d}} SourceCh= {n} StatevectorLen= {len(states)} DataFormat= {form}\r\n"
    head = first.format(len(first.format(0)) + len(text)) + text
    kind = {"int16": "<i2", "int32": "<i4", "float32": "<f4"}[form]
    rows = np.stack([*states.values()]).T.astype(np.uint8) if states else np.zeros((raw.shape[1], 0), np.uint8)
    body = b"".join(
        sample.tobytes() + row.tobytes() for sample, row in zip(raw.T.astype(kind).copy(), rows, strict=True)
    )
    path.write_bytes(head.encode() + body)
    return path


def save_curry(
    path: Path,
    data: np.ndarray,
    names: Sequence[str],
    events: Sequence[Event] = (),
    *,
    rate: int = 100,
    unit: str = "uV",
    remarks: Sequence[str] = (),
) -> Path:
    """Write a recording of Curry 8: ``.cdt``, ``.cdt.dpa`` and ``.cdt.ceo``; ``remarks`` are its events' words."""
    n, samples = data.shape
    numbers = {"NumSamples": samples, "NumChannels": n, "NumTrials": 1, "SampleFreqHz": rate, "TriggerOffsetUsec": 0}
    more = {"SampleTimeUsec": 1e6 / rate, "StartYear": 2020, "StartMonth": 1, "StartDay": 2, "StartHour": 3}
    more |= {"StartMin": 4, "StartSec": 5, "StartMillisec": 6, "FileVersion": 804}
    words = {"DataFormat": "FLOAT", "DataSampOrder": "SAMP", "DataByteOrder": "INTEL", "AmplifierInfo": ""}
    keys = "".join(f"   {name:<20}= {value}\n" for name, value in (numbers | more | words).items())
    places = "".join(f"{30 * np.cos(i):.4f}\t{30 * np.sin(i):.4f}\t60\n" for i in range(n))
    text = (
        f"DATA_PARAMETERS START\n{keys}DATA_PARAMETERS END\n"
        f"DEVICE_PARAMETERS START\n   DataUnit             = {unit}\n   NumChanThisGroup     = {n}\n"
        "DEVICE_PARAMETERS END\n"
        + _list("LABELS", "\n".join(names) + "\n")
        + _list("SENSORS", places)
        + _list("IMPEDANCE_VALUES", "-1 " * n + "\n")
    )
    path.with_suffix(".cdt.dpa").write_text(text)
    if events:
        rows = "".join(f"{at} 0 {code} 0 {at} {at} 0 0 0 0 0\n" for at, code in events)
        words = "".join(f"{one}\n" for one in remarks or [f"event {code}" for _, code in events])
        text = _list("NUMBER_LIST", rows) + _list("REMARK_LIST", words)
        path.with_suffix(".cdt.ceo").write_text(text)
    path.write_bytes(data.T.astype("<f4").tobytes())
    return path


def _list(name: str, content: str) -> str:
    return f"\n{name} START\n\n{name} END\n\n{name} START_LIST\n{content}{name} END_LIST\n"
