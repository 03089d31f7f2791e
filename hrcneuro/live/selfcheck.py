"""Reads a recording back as anybody would, with pyxdf, and holds it against what the recorder counted.

``python -m hrcneuro.live.selfcheck FOLDER`` prints the answer as JSON: the recorder runs it in a process of its own,
whose memory is not the recorder's.
"""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.eeg.stamps import segments
from hrcneuro.live import journal
from hrcneuro.live.recorder import OWN
from hrcneuro.live.watch import StreamWatch


@dataclass(frozen=True)
class Checked:
    """What a file holds of a stream.

    Attributes:
        part: Number of the part.
        stream: Its name in the configuration, or its own.
        samples: In the file.
        counted: By the recorder; none where it was killed before it could say.
        missing: Samples that never came, by the stamps.
        gaps: In how many places.
        drift_ppm: How much faster the sender's clock runs than the recorder's, parts in a million; none where that
            cannot be told.
        rate: By the stamps, Hz; 0 for a stream of irregular times.
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
    whole: bool


def check(folder: Path) -> list[Checked]:
    """Return what each part of a recording holds of each stream.

    Raises:
        Exception: What pyxdf raises of a file that it cannot read.
    """
    import pyxdf

    logging.getLogger("pyxdf").setLevel(logging.CRITICAL)
    said = journal.read(folder).get("parts", [])
    found = []
    for number, path in enumerate(sorted(folder.glob("part*.xdf"), key=part_number), start=1):
        streams, _ = pyxdf.load_xdf(path, synchronize_clocks=False, dejitter_timestamps=False, verbose=False)
        counted = said[number - 1] if number <= len(said) else {}
        found += [_checked(number, one, counted) for one in streams if one["info"]["name"][0] != OWN]
    return found


def part_number(path: Path) -> int:
    """Return the number of a part's file."""
    digits = path.stem.removeprefix("part")
    return int(digits) if digits.isdigit() else 0


def _checked(number: int, stream: Mapping[str, Any], part: Mapping[str, Any]) -> Checked:
    info = stream["info"]
    name, source = info["name"][0], (info.get("source_id") or [""])[0]
    entries = part.get("streams", {})
    same = [key for key, one in entries.items() if (one["name"], one["source_id"]) == (name, source or "")]
    key = same[0] if same else name
    ended = part.get("state") == journal.ENDED
    counted = entries[key]["samples"] if same and ended else None
    stamps, sfreq = np.asarray(stream["time_stamps"], float), float(info["nominal_srate"][0])
    watch = StreamWatch(sfreq, stall_s=np.inf)
    watch.learn(stamps)
    holes, missing = _holes(watch, stamps)
    rate = (len(stamps) - 1) / (stamps[-1] - stamps[0]) if sfreq and len(stamps) > 1 else 0.0
    return Checked(
        part=number,
        stream=key,
        samples=len(stamps),
        counted=counted,
        missing=missing,
        gaps=holes,
        drift_ppm=_drift(stream),
        rate=float(rate),
        whole=not holes and counted in (None, len(stamps)) and (len(stamps) > 0 or not sfreq),
    )


def _holes(watch: StreamWatch, stamps: np.ndarray) -> tuple[int, int]:
    """Return in how many places a stream has a gap or another clock, and how many samples are missing."""
    if watch.wavers:
        # No single step tells: what comes after a gap comes later for good.
        parts = segments(stamps, watch.sfreq)
        gaps = [stamps[start] - stamps[start - 1] for start, _ in parts[1:]]
        return len(gaps), sum(max(0, round(gap * watch.sfreq) - 1) for gap in gaps)
    events = watch.feed(stamps, 0.0)
    return sum(one.kind in ("gap", "clock") for one in events), watch.missing


def _drift(stream: Mapping[str, Any]) -> float | None:
    """Return the slope of the clocks' difference, parts in a million; None for fewer than a minute of measurements."""
    times, values = (np.asarray(stream.get(name, ()), float) for name in ("clock_times", "clock_values"))
    if len(times) < 3 or np.ptp(times) < 60:
        return None
    return float(-1e6 * np.polyfit(times - times[0], values, 1)[0])


if __name__ == "__main__":
    print(json.dumps([asdict(one) for one in check(Path(sys.argv[1]))]))
