"""A recording in pieces: where on its samples lies an instant of the clock that ran on while nothing was recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.sources.recording import Recording


@dataclass(frozen=True)
class Pieces:
    """Stretches of samples that follow each other in memory.

    Attributes:
        starts_s: ndarray, shape (n_pieces,), when the first sample of each was recorded, in s from the recording's.
        firsts: ndarray, shape (n_pieces,), int: which sample that is; the first is 0.
        breaks: ndarray, shape (n_pieces,), bool: whether something is missing before the piece.
        samples: Samples in all.
        sfreq: Sampling rate, in Hz.
    """

    starts_s: np.ndarray
    firsts: np.ndarray
    breaks: np.ndarray
    samples: int
    sfreq: float

    @classmethod
    def whole(cls, samples: int, sfreq: float) -> Pieces:
        """Return the pieces of a recording without gaps."""
        return cls(np.zeros(1), np.zeros(1, int), np.zeros(1, bool), samples, sfreq)

    @classmethod
    def joined(cls, firsts: Sequence[int], samples: int, sfreq: float) -> Pieces:
        """Return pieces of which each begins a segment, and between which no time is known to be lost.

        Args:
            firsts: The first sample of each, 0 among them.
            samples: Samples in all.
            sfreq: Sampling rate, in Hz.
        """
        at = np.array([first for first in firsts if 0 <= first < max(samples, 1)], int)
        return cls(at / sfreq, at, at > 0, samples, sfreq)

    @property
    def breaks_s(self) -> list[float]:
        """Where a new segment begins, in s of samples, the first one left out."""
        return [int(first) / self.sfreq for first in self.firsts[self.breaks] if first > 0]

    def place(self, at_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where instants lie among the samples, in s, and whether one was recorded then.

        An instant in a gap is placed at the gap.

        Args:
            at_s: ndarray, shape (n,), s of the clock.

        Returns:
            Two ndarrays, shape (n,): s, and bool.
        """
        half = 0.5 / self.sfreq
        at_s = np.asarray(at_s, float)
        k = np.searchsorted(self.starts_s, at_s + half, side="right") - 1
        piece = np.maximum(k, 0)
        long_s = np.diff(np.append(self.firsts, self.samples))[piece] / self.sfreq
        into_s = at_s - self.starts_s[piece]
        open_end = np.append(~self.breaks[1:], False)[piece]  # the next piece follows without a gap
        inside = (k >= 0) & ((into_s < long_s - half) | open_end)
        return self.firsts[piece] / self.sfreq + np.clip(into_s, 0, long_s), inside


def cut_out(recording: Recording, gaps: Sequence[tuple[int, int]]) -> Pieces:
    """Take stretches in which nothing was recorded out of the samples; return the pieces that are left.

    Args:
        recording: Its data lose the samples.
        gaps: Each as (first sample, first sample after), in any order.
    """
    samples = recording.data.shape[1]
    keep = np.ones(samples, bool)
    for start, stop in gaps:
        keep[max(start, 0) : max(stop, 0)] = False
    starts = np.flatnonzero(keep & ~np.append(False, keep[:-1]))
    if not keep.all():
        recording.data = recording.data[:, keep]
    if not len(starts):
        return Pieces.whole(0, recording.sfreq)
    firsts = np.cumsum(keep)[starts] - 1
    return Pieces(starts / recording.sfreq, firsts, starts > 0, int(keep.sum()), recording.sfreq)
