"""Markers, channels and log side by side, as ``hrcneuro acquire SUBJECT --inspect`` shows them; nothing is written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pandas as pd

from hrcneuro.errors import HrcError
from hrcneuro.paradigm.markers import move_in
from hrcneuro.sources.matching import block_rows, histogram
from hrcneuro.sources.recording import Recording

# Bad stretches that a person is shown.
_SPANS = 20


def view_recording(recording: Recording) -> dict[str, Any]:
    """Return what a recording holds, as JSON-able values."""
    # Markers that name their move differ all; what they are is one thing.
    texts = ["move/…" if move_in(text) else text for text in recording.markers["event"]]
    markers = recording.markers.assign(event=texts)
    return {
        "sfreq": recording.sfreq,
        "duration_s": round(recording.duration_s, 3),
        "channels": [
            {"name": name, "type": kind} for name, kind in zip(recording.ch_names, recording.ch_types, strict=True)
        ],
        "markers": [
            {
                "event": name,
                "count": count,
                "first_s": round(float(markers.loc[markers["event"] == name, "onset_s"].iloc[0]), 3),
                "median_gap_s": _gap(markers.loc[markers["event"] == name, "onset_s"]),
            }
            for name, count in histogram(markers).items()
        ],
        "breaks_s": [round(at, 3) for at in recording.breaks_s],
        "bad": [
            {"event": text, "onset_s": round(at, 3), "duration_s": round(duration, 3)}
            for at, duration, text in recording.spans
        ],
        "bad_channels": recording.bads,
        "notes": [*recording.notes, *recording.warnings],
    }


def view_log(trials: pd.DataFrame) -> dict[str, Any]:
    """Return what a log holds, as JSON-able values."""
    return {
        "rows": len(trials),
        "rows_without_practice": int((~trials["practice"].astype(bool)).sum()),
        "rows_by_block": block_rows(trials),
        "actors": {str(name): int(n) for name, n in trials["actor"].value_counts().sort_index().items()},
        "errors": int(trials["error"].sum()),
    }


def attempt(view: dict[str, Any], look: Callable[[], object]) -> bool:
    """Run a part of the inspection, and return whether it went well; an error becomes part of what is shown."""
    try:
        look()
    except HrcError as error:
        view["problems"].append({"problem": error.problem, "cure": error.cure, "exit_code": error.exit_code})
        return False
    return True


def render(view: dict[str, Any]) -> str:
    """Return an inspection as text for a person."""
    lines = [f"{view['unit']}: source {view['source']}"]
    if recording := view.get("recording"):
        lines.append(f"  recording  {recording['duration_s']:.1f} s at {recording['sfreq']:g} Hz")
        kinds: dict[str, list[str]] = {}
        for channel in recording["channels"]:
            kinds.setdefault(channel["type"], []).append(channel["name"])
        lines += [f"  {kind:<9}  {len(names):3d}: {' '.join(names)}" for kind, names in kinds.items()]
        if recording["breaks_s"]:
            lines.append(f"  breaks     {len(recording['breaks_s'])}: {_times(recording['breaks_s'])}")
        if recording["bad_channels"]:
            lines.append(f"  bad        channels {', '.join(recording['bad_channels'])}")
        lines += [f"  bad        {_span(span)}" for span in recording["bad"][:_SPANS]]
        if (more := len(recording["bad"]) - _SPANS) > 0:
            lines.append(f"  bad        … and {more} stretches more (--json lists all)")
    lines += [f"  {a:<46} {b}".rstrip() for a, b in _side_by_side(view)]
    lines += [f"  note       {note}" for note in view.get("notes", []) + (recording["notes"] if recording else [])]
    for one in view["problems"]:
        lines.append(f"  problem    {one['problem']}")
        lines += [f"    cure: {one['cure']}"] if one["cure"] else []
    return "\n".join(lines)


def _side_by_side(view: dict[str, Any]) -> list[tuple[str, str]]:
    """Return lines of markers on the left and the log's blocks on the right."""
    left = [f"{'marker':<22}{'count':>6}{'first s':>9}{'gap s':>8}"] if "recording" in view else []
    for one in view.get("recording", {}).get("markers", []):
        gap = "" if one["median_gap_s"] is None else f"{one['median_gap_s']:.3f}"
        left.append(f"{one['event'][:21]:<22}{one['count']:>6}{one['first_s']:>9.2f}{gap:>8}")
    right = []
    if log := view.get("log"):
        right = [f"log: {log['rows']} rows, {log['rows_without_practice']} without practice, {log['errors']} errors"]
        right += [f"{name:<9}{count:>5}" for name, count in log["rows_by_block"].items()]
    size = max(len(left), len(right))
    return list(zip(left + [""] * (size - len(left)), right + [""] * (size - len(right)), strict=True))


def _gap(onsets: pd.Series) -> float | None:
    return round(float(onsets.diff().median()), 3) if len(onsets) > 1 else None


def _span(span: dict[str, Any]) -> str:
    start, end = span["onset_s"], span["onset_s"] + span["duration_s"]
    return f"{start:.3f} to {end:.3f} s: {span['event']}"


def _times(values: list[float]) -> str:
    return ", ".join(f"{v:.1f} s" for v in values[:6]) + (" …" if len(values) > 6 else "")
