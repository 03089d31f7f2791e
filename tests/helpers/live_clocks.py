"""Clocks that differ and drift, over real LSL and in files: each move on its sample, delays as planted."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from live_lab import Lab, Row

from hrcneuro.live import xdf

PPM, LATE_S, JITTER_S = 50.0, 0.02, 0.0003
AS_RECORDED = ("--set", "acquire.source=recording", "--set", "acquire.path=recordings/{subject}/*")


def clocks(lab: Lab) -> Iterator[Row]:
    """Each move lies on its sample: live with 50 ppm of drift and 20 ms of delay, and with clocks planted in a file."""
    sent = with_log(lab)
    with lab.amplifier("--replay", "--fault", f"drift={PPM:g}", "--fault", f"delay={LATE_S:g}"):
        code, _, said = lab.record("--seconds", "60" if lab.brief else "150")
    yield "recorded whole, with drift and delay", code == 0, said[-200:]
    yield from acquired(lab, sent, "by trigger edges, live")
    drifted = lab.folder / "planted"
    part = lab.parts()[0]
    _planted(part, drifted / "s01" / "one" / "part1.xdf")
    for name in ("subject01.csv", "metadata01.csv"):
        (drifted / "s01" / name).write_bytes((lab.folder / "recordings" / "s01" / name).read_bytes())
    more = ("--set", "acquire.path=planted/{subject}/*", "--set", "acquire.markers=annotations",
            "--set", f"acquire.amp_delay_ms={1e3 * LATE_S:g}")  # fmt: skip
    yield from acquired(lab, sent, "by markers and clocks planted 1000 s and 50 ppm apart", *more)


def with_log(lab: Lab) -> np.ndarray:
    """Acquire the study, put its log beside the recordings to be; return what is sent, shape (n_times, n), µV."""
    from hrcneuro.io.fif import read_raw

    out, err = lab.start("acquire", "s01", "--export", "exported").communicate()
    logs = list(lab.folder.glob("exported/s01/*01.csv"))
    assert len(logs) == 2, (out, err)
    place = lab.folder / "recordings" / "s01"
    place.mkdir(parents=True, exist_ok=True)
    for path in logs:
        (place / path.name).write_bytes(path.read_bytes())
    (path,) = lab.folder.glob("cache/acquire/s01/*/s01_raw.fif")
    return (read_raw(path).get_data(picks=["eeg", "eog"]) * 1e6).astype(np.float32).T


def acquired(lab: Lab, sent: np.ndarray, how: str, *more: str) -> Iterator[Row]:
    """Acquire what was recorded; say whether samples and onsets are those that were sent."""
    from hrcneuro.io.fif import read_raw

    whole = pd.read_parquet(next(lab.folder.glob("cache/acquire/s01/*/trials.parquet")))
    done = lab.start("acquire", "s01", "--workdir", "again", *AS_RECORDED, *more)
    _, err = done.communicate()
    yield f"acquire takes it, {how}", done.returncode == 0, err[-400:]
    if done.returncode:
        return
    entry = max(lab.folder.glob("again/cache/acquire/s01/*/record.json"), key=lambda path: path.stat().st_mtime).parent
    raw, table = read_raw(entry / "s01_raw.fif"), pd.read_parquet(entry / "trials.parquet")
    data = (raw.get_data(picks=["eeg", "eog"]) * 1e6).astype(np.float32).T
    first = next(i for i in range(len(sent)) if np.allclose(sent[i], data[0], rtol=1e-5))
    n = min(len(data), len(sent) - first)
    same = bool(np.allclose(data[:n], sent[first : first + n], rtol=1e-4, atol=1e-3))
    yield f"{n:,} samples equal those that were sent", same, ""
    found = table["onset_sample"].notna()
    away = table["onset_sample"][found].to_numpy(int) + first - whole["onset_sample"][found].to_numpy(int)
    most = int(np.abs(away).max()) if len(away) else -1
    yield f"{len(away)} onsets at most {most} samples from where they were sent", 0 <= most <= 1, str(away[:20])


def _planted(part: Path, to: Path) -> None:
    """Write a recording anew, its EEG stamped by a clock that began another time and runs 50 ppm faster."""
    import pyxdf

    streams, _ = pyxdf.load_xdf(part, synchronize_clocks=False, dejitter_timestamps=False, verbose=False)
    chosen = [one for one in streams if one["info"]["name"][0] in ("actiCHamp", "hrcneuro-moves")]
    rng = np.random.default_rng(2)
    start = float(min(one["time_stamps"][0] for one in chosen))
    to.parent.mkdir(parents=True)
    with to.open("wb") as file:
        file.write(xdf.MAGIC + xdf.file_header("2026-01-01T00:00:00+00:00"))
        for number, one in enumerate(chosen, start=1):
            eeg = one["info"]["name"][0] == "actiCHamp"
            stamps = np.asarray(one["time_stamps"], float)
            offset = (lambda t: -1000.0 - 1e-6 * PPM * (t - start)) if eeg else (lambda t: 0.0)
            own = np.array([t - offset(t) for t in stamps])
            when = np.arange(start, stamps[-1] + 5.0, 5.0)
            measured = [(t, offset(t) + JITTER_S * rng.standard_normal()) for t in when]
            file.write(xdf.stream_header(number, _header(part, one)))
            form = one["info"]["channel_format"][0]
            for at in range(0, len(own), 50):
                piece = slice(at, at + 50)
                file.write(xdf.samples(number, own[piece], one["time_series"][piece], form))
            for t, value in measured:
                file.write(xdf.clock_offset(number, t, value))
            file.write(xdf.stream_footer(number, own[0], own[-1], len(own), measured))


def _header(part: Path, stream: dict) -> str:
    """Return a stream's description as it stands in the file."""
    raw, name = part.read_bytes(), f"<name>{stream['info']['name'][0]}</name>".encode()
    begin = raw.rindex(b"<info", 0, raw.index(name))
    return raw[begin : raw.index(b"</info>", begin) + len(b"</info>")].decode()


def timing(lab: Lab) -> Iterator[Row]:
    """What ``timing`` measures contains what was planted: a delay, jitter, drift."""
    planted = ("--fault", "delay=0.037", "--fault", "jitter=0.004", "--fault", "drift=50")
    lab.start("acquire", "s01").communicate()
    with lab.amplifier("--replay", *planted):
        code, _, said = lab.record("--seconds", "60" if lab.brief else "150")
    yield "recorded whole", code == 0, said[-300:]
    out, err = lab.start("timing", "s01", "--json").communicate()
    about = json.loads(out or "{}")
    yield "timing measures it", bool(about.get("links")), err[-300:]
    edge = about["links"]["marker_edge_ms"]
    # Moves are replayed on samples, so that an edge is not half a sample late on average.
    for name, true, of in (
        ("delay", 37.0, about["amp_delay_ms"]),
        ("jitter", 4.0, edge["jitter"]),
        ("drift", 50.0, about["drift_ppm"]),
    ):
        unit = "ppm" if name == "drift" else "ms"
        text = f"{name}: {of['value']:.2f} {unit} ({of['low']:.2f} to {of['high']:.2f}), {true:g} planted"
        yield f"{text}, {edge['n']} moves", of["low"] <= true <= of["high"], ""
    yield "its picture and page are there", len(list(lab.folder.glob("timing/s01/*/timing.*"))) >= 3, ""


_SENDER = """
import sys, time
import numpy as np
from hrcneuro.live.lsl import LslOutlet
unit, first = sys.argv[1], int(sys.argv[2])
outlet = LslOutlet("amp", "EEG", list("abc"), sfreq=500, source_id="one", units=[unit] * 3)
begun, sent = outlet.clock(), 0
while True:
    due = int((outlet.clock() - begun) * 500) - sent
    if due > 0:
        numbers = np.arange(sent, sent + due)
        rows = np.random.default_rng(sent).normal(0, 10, (due, 3))
        rows[:, 0] = first + numbers
        outlet.push(begun + numbers / 500, rows)
        sent += due
    time.sleep(0.005)
"""


def other_units(lab: Lab) -> Iterator[Row]:
    """A stream that comes back under the same source id in volts: none of its samples lies under the old header."""
    import pyxdf

    def sender(unit: str, first: int) -> subprocess.Popen[str]:
        return subprocess.Popen([sys.executable, "-c", _SENDER, unit, str(first)], env=lab.environment, text=True)

    one = sender("microvolts", 0)
    try:
        recorder = lab.start("record", "s01", "--seconds", "14", "--set", 'record.streams={eeg={name="amp"}}')
        while not lab.parts():
            assert recorder.poll() is None, recorder.communicate()
            time.sleep(0.05)
        time.sleep(4)
    finally:
        one.kill()
        one.wait()
    two = sender("volts", 10**6)
    try:
        recorder.communicate()
    finally:
        two.kill()
        two.wait()
    streams, _ = pyxdf.load_xdf(lab.parts()[0], synchronize_clocks=False, dejitter_timestamps=False, verbose=False)
    rows = [
        (one["info"]["desc"][0]["channels"][0]["channel"][0]["unit"][0], one["time_series"][:, 0])
        for one in streams
        if one["info"]["name"] == ["amp"]
    ]
    told = ", ".join(f"{len(values):,} in {unit}" for unit, values in rows)
    right = [unit for unit, _ in rows] == ["microvolts", "volts"]
    right = right and rows[0][1].max() < 10**6 <= rows[1][1].min() and all((np.diff(v) == 1).all() for _, v in rows)
    yield f"samples under their own headers: {told}", right, ""
