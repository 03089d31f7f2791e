"""What came out of acquire, preprocess and epoch: the recording, what was mended in it, trials by condition."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from hrcneuro.answers.words import ALL, counted, counts, indented, listed, natural, number, span, spread

Summary = Mapping[str, Any]


def acquire(summary: Summary) -> list[str]:
    """Return channels, rate, length and origin of a recording, its events, and what is marked bad."""
    kinds = summary["channels"]
    channels = listed(f"{n} {kind.upper()}" for kind, n in sorted(kinds.items()))
    found = [
        f"{channels} {'channel' if sum(kinds.values()) == 1 else 'channels'} at {summary['sfreq']:g} Hz, "
        f"{number(summary['duration_s'] / 60)} min; {_origin(summary)}",
        f"events: {_events(summary['events'])}",
    ]
    found += [f"marked bad: {listed(summary['bads'])}"] if summary["bads"] else []
    found += [f"{counted(summary['breaks'], 'break')} in the recording"] if summary["breaks"] else []
    return found


def acquire_together(summaries: Mapping[str, Summary]) -> list[str]:
    """Return rate, length and origin of all recordings, and their events."""
    ones = list(summaries.values())
    events = sorted({kind for one in ones for kind in one["events"]}, key=natural)
    said = ", ".join(f"{kind} {spread([one['events'].get(kind, 0) for one in ones])}" for kind in events)
    return [
        f"{counted(len(ones), 'recording')}: {span([one['sfreq'] for one in ones], 0)} Hz, "
        f"{span([one['duration_s'] / 60 for one in ones])} min; {listed(sorted({_origin(one) for one in ones}))}",
        f"events a subject: {said or 'none'}",
    ]


def preprocess(summary: Summary) -> list[str]:
    """Return rate and channels of the clean recording, and which channels were bad and why."""
    rate = f"{summary['sfreq']:g} Hz"
    if summary["downsampled"]:
        rate += f" (recorded at {summary['source_sfreq']:g} Hz)"
    eog = summary["eog_channels"]
    return [
        f"{counted(summary['channels'], 'EEG channel')} at {rate}, {number(summary['seconds'] / 60)} min",
        f"eye movements removed with {listed(sorted(eog, key=natural))}" if eog else "eye movements not removed",
        f"channels interpolated: {_channels(summary)}",
        *([f"noisy all the time, and kept: {kept}"] if (kept := _kept_noisy(summary)) else []),
    ]


def preprocess_together(summaries: Mapping[str, Summary]) -> list[str]:
    """Return rate and channels of all clean recordings, and how many channels were interpolated."""
    ones = list(summaries.values())
    mended = [len(one["interpolated"]) for one in ones]
    often = Counter(name for one in ones for name in one["interpolated"])
    most = sorted(often.items(), key=lambda item: (-item[1], natural(item[0])))[:5]
    return [
        f"{counted(len(ones), 'recording')}: {span([one['channels'] for one in ones], 0)} EEG channels at "
        f"{span([one['sfreq'] for one in ones], 0)} Hz",
        f"channels interpolated: {span(mended, 0)} a subject"
        + (f"; most often {', '.join(f'{name} ({n})' for name, n in most)}" if most else ""),
    ]


def epoch(summary: Summary) -> list[str]:
    """Return how many epochs are good, and trials by condition, or by event in a study of one's own."""
    rejected = f"{summary['rejected']:,} rejected" if summary["rejected"] else "none rejected"
    if summary["reasons"]:
        rejected += f" ({counts(summary['reasons'])})"
    rows = [(scenario, counts(summary["counts"][scenario])) for scenario in sorted(summary["counts"], key=natural)]
    rows += [(ALL, counts(summary["total"]))] if len(rows) > 1 else []
    found = [f"{counted(summary['epochs'], 'epoch')} at {summary['sfreq']:g} Hz, {rejected}"]
    found += [f"trials by {_counted(summary)}:", *indented(rows)]
    return found + (["an outlier: too many epochs exceed the limit"] if summary["outlier"] else [])


def epoch_together(summaries: Mapping[str, Summary]) -> list[str]:
    """Return trials by condition (or event) as mean and SD over the subjects, and what was rejected."""
    ones = list(summaries.values())
    names = sorted({name for one in ones for name in one["total"]}, key=natural)
    trials = ", ".join(f"{name} {spread([one['total'].get(name, 0) for one in ones])}" for name in names)
    found = [
        f"{counted(len(ones), 'subject')}: {spread([one['epochs'] for one in ones])} epochs, "
        f"{spread([one['rejected'] for one in ones])} rejected",
        f"trials by {_counted(ones[0])}: {trials}",
    ]
    odd = sorted(unit for unit, one in summaries.items() if one["outlier"])
    return found + ([f"outliers: {listed(odd)}"] if odd else [])


def _counted(summary: Summary) -> str:
    """Return what the counts of epoch are of: conditions, or the events of a study of one's own."""
    return str(summary.get("counted", "conditions")).removesuffix("s")


def _origin(summary: Summary) -> str:
    origin = summary["origin"]
    eeg, behaviour = origin.get("eeg", "unknown"), origin.get("behaviour", "unknown")
    if eeg == behaviour:
        return {"unknown": "origin unknown", "real": "recorded from people"}.get(eeg, eeg)
    return f"EEG {eeg}, behaviour {behaviour}"


def _events(of: Mapping[str, int]) -> str:
    return counts(of) or "none"


def _kept_noisy(summary: Summary) -> str:
    """Return which channels PREP's criteria call noisy and nothing replaced, and by which."""
    noisy = {name: why for name, why in summary["noisy"].items() if name not in summary["interpolated"]}
    return ", ".join(f"{name} ({noisy[name]})" for name in sorted(noisy, key=natural))


def _channels(summary: Summary) -> str:
    """Return which channels are interpolated, by what was wrong with them."""
    by_reason: dict[str, list[str]] = {}
    for name in sorted(summary["interpolated"], key=natural):
        by_reason.setdefault(summary["bad"].get(name, "no reason given"), []).append(name)
    return "; ".join(f"{', '.join(names)} ({reason})" for reason, names in sorted(by_reason.items())) or "none"
