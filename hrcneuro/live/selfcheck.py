"""Reads a recording back as anybody would, with pyxdf, and holds it against what the recorder counted.

``python -m hrcneuro.live.selfcheck FOLDER`` prints the answer as JSON: the recorder runs it in a process of its own,
whose memory is not the recorder's.
"""

from __future__ import annotations

import json
import logging
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.eeg.stamps import segments
from hrcneuro.live import journal
from hrcneuro.live.part import number_of
from hrcneuro.live.recorder import OWN
from hrcneuro.live.transport import PORTS
from hrcneuro.live.watch import StreamWatch
from hrcneuro.paradigm import markers

_RATE = 0.005  # by this share a clock does not run wrong: samples are lost
_LATE_S = 3.0
_COMPARED_S = 60.0  # clocks are compared each five seconds


@dataclass(frozen=True)
class Checked:
    """What a file holds of a stream.

    Attributes:
        part: Number of the part.
        stream: Its name in the configuration, or its own.
        samples: In the file.
        counted: By the recorder; none where it was killed before it could say.
        missing: Samples that never came, by the stamps or by what the recorder has marked.
        gaps: In how many places.
        drift_ppm: How much faster the sender's clock runs than the recorder's, parts in a million; none where that
            cannot be told.
        rate: By the stamps, Hz; 0 for a stream of irregular times.
        flaws: What else is wrong with it, in words.
        whole: Whether all is there that was sent, as far as can be told.
    """

    part: int
    stream: str
    samples: int
    counted: int | None
    missing: int
    gaps: int
    drift_ppm: float | None
    rate: float
    flaws: list[str]
    whole: bool


def check(folder: Path) -> list[Checked]:
    """Return what each part of a recording holds of each stream; a part that cannot be read has a flaw that says so."""
    logging.getLogger("pyxdf").setLevel(logging.CRITICAL)
    said = {one.get("file"): one for one in journal.parts(folder)}
    paths = sorted(folder.glob("part*.xdf"), key=number_of)
    return [one for path in paths for one in _part(path, said.get(path.name, {}))]


def _part(path: Path, about: Mapping[str, Any]) -> list[Checked]:
    import pyxdf

    number = number_of(path)
    try:
        # pyxdf leaves open what it opens and cannot read.
        with path.open("rb") as file:
            streams, _ = pyxdf.load_xdf(file, synchronize_clocks=False, dejitter_timestamps=False, verbose=False)
    except Exception as error:
        # pyxdf raises whatever a damaged chunk leads to; the other parts are judged all the same.
        return [_nothing(number, path.name, f"it cannot be read: {error}")]
    told, ours = _told(streams), [one for one in streams if not _is_own(one)]
    found = [_checked(number, one, about, told) for one in ours]
    numbers = [one["info"]["stream_id"] for one in ours]
    found += [
        _nothing(number, key, "it is not in the file", counted=noted.get("samples"))
        for key, noted in about.get("streams", {}).items()
        if noted.get("number") not in numbers
    ]
    # Without session.json it is not known which stream was meant.
    found += [
        _nothing(number, key, f"the recorder has marked {told[key][1]} missing samples of it")
        for key in told.keys() - {one.stream for one in found}
    ]
    return found or [_nothing(number, path.name, "it holds no stream")]


def _nothing(number: int, stream: str, flaw: str, *, counted: int | None = None) -> Checked:
    return Checked(number, stream, 0, counted, 0, 0, None, 0.0, [flaw], whole=False)


def _is_own(stream: Mapping[str, Any]) -> bool:
    return (stream["info"].get("source_id") or [""])[0] == OWN


def _told(streams: Sequence[Mapping[str, Any]]) -> dict[str, tuple[int, int]]:
    """Return the gaps that the recorder has marked: in how many places, and how many samples, of each stream."""
    told: dict[str, tuple[int, int]] = {}
    for text in (str(row[0]) for one in streams if _is_own(one) for row in one["time_series"]):
        if mark := re.match(r"(gap|late)/stream=(.*)/samples=(\d+)/", text):
            places, samples = told.get(mark[2], (0, 0))
            # What came late was told to be missing before.
            gap = mark[1] == "gap"
            told[mark[2]] = places + gap, samples + (int(mark[3]) if gap else -int(mark[3]))
    return {key: (places, samples) for key, (places, samples) in told.items() if samples}


def _checked(
    number: int, stream: Mapping[str, Any], part: Mapping[str, Any], told: Mapping[str, tuple[int, int]]
) -> Checked:
    info = stream["info"]
    entries: Mapping[str, Any] = part.get("streams", {})
    same = [key for key, one in entries.items() if one.get("number") == info["stream_id"]]
    key = same[0] if same else info["name"][0]
    about = entries[key] if same and part.get("state") == journal.ENDED else {}
    counted = about.get("samples")
    stamps, sfreq = np.asarray(stream["time_stamps"], float), float(info["nominal_srate"][0])
    watch = StreamWatch(sfreq, stall_s=np.inf)
    watch.learn(stamps)
    # What was seen as it came, by how the stamps wavered then, may show in no step of the whole.
    seen = zip(_holes(watch, stamps), told.get(key, (0, 0)), strict=True)
    holes, missing = (max(pair) for pair in seen)
    rate = (len(stamps) - 1) / (stamps[-1] - stamps[0]) if sfreq and len(stamps) > 1 else 0.0
    if not sfreq and len(stamps) and markers.is_end(str(stream["time_series"][-1][0])):
        about = {**about, "gone": False}  # it said so
    flaws = [
        *_flaws(about, stamps, sfreq, rate),
        *_never_compared(stream),
        *_cut_short(stream, entries.get(key, {}) if same else {}, part),
    ]
    return Checked(
        part=number,
        stream=key,
        samples=len(stamps),
        counted=counted,
        missing=missing,
        gaps=holes,
        drift_ppm=_drift(stream),
        rate=float(rate),
        flaws=flaws,
        whole=not holes and not flaws and counted in (None, len(stamps)),
    )


def _flaws(about: Mapping[str, Any], stamps: np.ndarray, sfreq: float, rate: float) -> Iterator[str]:
    """Yield what is wrong with a stream and no gap shows: it came late, ended early, or at another rate."""
    if sfreq and not len(stamps):
        yield "no samples came"
    elif sfreq and len(stamps) > sfreq and abs(rate / sfreq - 1) > _RATE:
        yield f"{rate:.4g} Hz, where {sfreq:g} Hz are stated"
    if sfreq and about.get("waited_s", 0) > _LATE_S:
        yield f"its first samples came after {about['waited_s']:.1f} s"
    if about.get("garbled"):
        yield f"{about['garbled']} texts were not in UTF-8 and are left out"
    if about.get("gone"):
        yield "it had ended before the recording did"
    elif sfreq and about.get("silent_s", 0) > _LATE_S:
        yield f"it had been silent for {about['silent_s']:.1f} s in the end"


def _never_compared(stream: Mapping[str, Any]) -> Iterator[str]:
    """Yield that a stream's clock was not compared with the recorder's: nothing can be placed on its samples."""
    stamps, times = (np.asarray(stream.get(name, ()), float) for name in ("time_stamps", "clock_times"))
    if not len(stamps):
        return
    if not len(times):
        yield (
            "its clock was never compared with the recorder's: does a firewall stand in the way of LSL's ports "
            f"({PORTS})?"
        )
        return
    if (np.diff(stamps) < 0).any() or (np.diff(times) < 0).any():
        return  # a clock that was set is told as such
    # Within what was recorded: a stream of markers may be silent for long.
    inside = np.clip(times, stamps[0], stamps[-1])
    longest = float(np.diff(np.concatenate([stamps[:1], inside, stamps[-1:]])).max())
    if longest > _COMPARED_S:
        yield f"its clock was not compared with the recorder's for {longest:.0f} s"


def _cut_short(stream: Mapping[str, Any], noted: Mapping[str, Any], part: Mapping[str, Any]) -> Iterator[str]:
    """Yield what tells that a stream in a file is not all that was taken: the recorder was killed, or the file is cut.

    Args:
        stream: As pyxdf has it.
        noted: What ``session.json`` says of it; nothing where it does not.
        part: What it says of the part.
    """
    there = len(stream["time_stamps"])
    footer = ((stream.get("footer") or {}).get("info") or {}).get("sample_count")
    if not footer:
        yield "it has no end mark: the recorder was killed, or the file is cut short"
    elif there < int(footer[0]):
        yield f"its end mark counts {footer[0]} samples"
    if part.get("state") in (journal.FULL, journal.FAILED):
        yield f"its part was {part['state']}"
    # Of a part that ended, the count says so; of one that was killed, this is from some seconds before that.
    if part.get("state") != journal.ENDED and there < (noted.get("samples") or 0):
        yield f"{noted['samples'] - there} fewer than the recorder had noted"


def _holes(watch: StreamWatch, stamps: np.ndarray) -> tuple[int, int]:
    """Return in how many places a stream has a gap or another clock, and how many samples are missing."""
    if watch.wavers:
        # No single step tells: what comes after a gap comes later for good.
        parts = segments(stamps, watch.sfreq)
        gaps = [stamps[start] - stamps[start - 1] for start, _ in parts[1:]]
        return len(gaps), sum(max(0, round(gap * watch.sfreq) - 1) for gap in gaps)
    events = watch.feed(stamps, 0.0)
    odd = ("gap", "clock") if watch.missing else ("clock",)
    return sum(one.kind in odd for one in events), watch.missing


def _drift(stream: Mapping[str, Any]) -> float | None:
    """Return the slope of the clocks' difference, parts in a million; None for fewer than a minute of measurements."""
    times, values = (np.asarray(stream.get(name, ()), float) for name in ("clock_times", "clock_values"))
    if len(times) < 3 or np.ptp(times) < 60:
        return None
    return float(-1e6 * np.polyfit(times - times[0], values, 1)[0])


if __name__ == "__main__":
    print(json.dumps([asdict(one) for one in check(Path(sys.argv[1]))]))
