"""BioSemi's Status channel: 16 trigger lines, and above them what the amplifier says of itself.

The bits are those of BioSemi's own table (biosemi.com, FAQ "trigger signals").
"""

from __future__ import annotations

import numpy as np

from hrcneuro.eeg.spans import spans

TRIGGERS = 0xFFFF
_EPOCH, _CMS, _BATTERY = 1 << 16, 1 << 20, 1 << 22


def words(samples: np.ndarray) -> np.ndarray:
    """Return 24-bit words, shape (n,), int64, without sign, of their bytes, shape (n, 3), uint8, lowest first."""
    wide = samples.astype(np.int64)
    return wide[:, 0] | wide[:, 1] << 8 | wide[:, 2] << 16


def is_biosemi(status: np.ndarray) -> bool:
    """Return whether the words carry the amplifier's own bits at all: other makers' files use the same label."""
    return bool((status & ~TRIGGERS).any())


def breaks(status: np.ndarray) -> list[int]:
    """Return the samples at which the recording went on after a pause: bit 16 rises, the first sample left out."""
    return [int(at) for at in _rises(status & _EPOCH)]


def out_of_range(status: np.ndarray) -> list[tuple[int, int]]:
    """Return the stretches, (first sample, first sample after), in which the CMS electrode was out of range.

    Bit 20 is high while it is in range. Where it never is high, nothing is known.
    """
    low = (status & _CMS) == 0
    if low.all() or not low.any():
        return []
    return spans(low)


def remarks(status: np.ndarray) -> list[str]:
    """Return what else a person should know of the amplifier's state, a sentence each."""
    found = []
    if not (status & _CMS).any():
        found.append("Status says that CMS was never in range: the reference loop was open")
    if (status & _BATTERY).any():
        found.append(f"Status says that the battery was low in {np.mean((status & _BATTERY) > 0):.0%} of the recording")
    return found


def _rises(bits: np.ndarray) -> np.ndarray:
    return np.flatnonzero((bits[1:] > 0) & (bits[:-1] == 0)) + 1
