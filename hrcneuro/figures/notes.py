"""What stands at the foot of the figures of erp and ersp: which test, which bands, which channel is not there."""

from __future__ import annotations

from collections.abc import Sequence

from hrcneuro.eeg.selection import nearest_channel


def named_test(correction: str, alpha: float, *, subjects: int) -> str:
    """Return what the test over so many subjects is, short enough for the foot of a figure."""
    if subjects < 2:
        return "one subject: not tested"
    how = "clusters" if correction == "cluster" else "extreme statistics"
    return f"p < {alpha:g} by sign flips over subjects, {how}"


def bands(over: str, confidence: float) -> str:
    """Return what the shades around waveforms and around their difference are."""
    return f"bands: standard error{over}, of the difference its {100 * confidence:g}% interval"


def shown_channel(wanted: str, names: Sequence[str]) -> tuple[str, list[str]]:
    """Return the channel to show, the nearest one where there is none of that name, and a sentence on that."""
    channel = nearest_channel(wanted, names)
    return channel, _missing([wanted], names, [channel])


def shown_channels(wanted: Sequence[str], names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return those of the wanted channels that are there, else the nearest to the first, and a sentence on others."""
    by_lower = {name.lower(): name for name in names}
    shown = [by_lower[name.lower()] for name in wanted if name.lower() in by_lower]
    shown = shown or [nearest_channel(wanted[0], names)]
    return shown, _missing(wanted, names, shown)


def _missing(wanted: Sequence[str], names: Sequence[str], shown: Sequence[str]) -> list[str]:
    have = {name.lower() for name in names}
    lacking = [name for name in wanted if name.lower() not in have]
    return [f"no channel {', '.join(lacking)}, so here is {', '.join(shown)}"] if lacking else []
