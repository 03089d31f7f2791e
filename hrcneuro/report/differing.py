"""How many rows differ from the paper, and how many of these were to be expected of simulated data, and why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from hrcneuro.report.claims import PublishedRow
from hrcneuro.report.verdicts import DIFFERS

# Ground -> what of it is simulated, and why its rows need not give the printed figure.
_WHY = {
    "eeg": (
        "on simulated EEG",
        "it holds a few planted effects, whose size was chosen so that decoding comes out as printed; nobody made "
        "each map, place and time of the paper",
    ),
    "behaviour": ("on simulated behaviour", "it follows the rules of the game, not each mean that the paper prints"),
    "model": ("on rates decoded from simulated EEG", "other rates than the paper's make a robot learn otherwise"),
    "arm": ("on a simulated arm", "its controller answers as fast as the simulation does, not as the paper's"),
}


def differing(lines: Sequence[PublishedRow]) -> dict[str, Any] | None:
    """Return what the page says beside the count of rows that differ; None where none does."""
    rows = [row for row in lines if row.verdict == DIFFERS]
    if not rows:
        return None
    counts = Counter(row.simulated for row in rows if row.simulated)
    return {
        "number": len(rows),
        "expected": counts.total(),
        "reasons": [
            {"number": counts[ground], "ground": ground_words, "why": why}
            for ground, (ground_words, why) in _WHY.items()
            if counts[ground]
        ],
        "others": [f"{row.place}: {row.quantity}" for row in rows if not row.simulated],
    }
