"""What stands at the foot of the figures of erp and ersp: which test, which bands, which channel is not there."""

from __future__ import annotations

from collections.abc import Sequence

from hrcneuro.eeg.selection import ALL, nearest_channel, split_label

_STRATA = {
    "prev_error no": "after no error",
    "prev_error yes": "after an error",
    "turn no": "no turn ahead",
    "turn yes": "turn ahead",
}


def named_test(correction: str, alpha: float, *, subjects: int, found: bool = True) -> str:
    """Return what the test over so many subjects is, and whether it found nothing, short enough for a figure's foot."""
    if subjects < 2:
        return "one subject: not tested"
    how = "clusters" if correction == "cluster" else "extreme statistics"
    test = f"p < {alpha:g} by sign flips over subjects, {how}"
    return test if found else f"nothing shown is significant ({test})"


def bands(over: str, confidence: float, *, waves: bool, difference: bool, cut: bool = False) -> list[str]:
    """Return a sentence on the shades that are drawn around waveforms and around their difference; none of neither."""
    drawn = [f"standard error{over}"] if waves else []
    if difference:
        drawn.append(f"of the difference its {100 * confidence:g}% interval{' (its ends cut)' if cut else ''}")
    return [f"bands: {', '.join(drawn)}"] if drawn else []


def contrast_title(scenario: str, name: str, n: int) -> str:
    """Return what a panel of the group shows: where, which contrast, of how many subjects."""
    place, stratum = split_label(scenario)
    where = [] if place == ALL else [place]
    where += [_STRATA.get(stratum, stratum)] if stratum else []
    return f"{', '.join(where)}{': ' if where else ''}{name}, n = {n}"


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
