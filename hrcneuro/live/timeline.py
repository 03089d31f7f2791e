"""Where a moment lies among the samples of a stream, and the trigger edge beside it; what else is known of each sample.

All that is answered depends on the samples alone, not on the chunks in which they came, nor on the number that the
first of them has.
"""

from __future__ import annotations

import math

import numpy as np

_FIT_S = 1.0
RAILED, NOT_FINITE = 1, 2
"""Bits of a sample's mark: a channel is at the end of its range; a channel is no number."""


class Timeline:
    """The last samples' stamps, trigger codes and marks.

    Attributes:
        end: How many samples have come: the number of the next one.
    """

    def __init__(self, sfreq: float, *, kept_s: float) -> None:
        """Begin with no sample.

        Args:
            sfreq: Nominal rate, Hz.
            kept_s: Of so many of the last seconds, at least, everything is known.
        """
        self.end = 0
        self._sfreq, self._kept = sfreq, math.ceil(kept_s * sfreq)
        self._stamps, self._pulled = np.zeros(3 * self._kept), np.zeros(3 * self._kept)
        self._edge, self._marks = np.zeros(3 * self._kept, bool), np.zeros(3 * self._kept, np.uint8)
        self._first = 0  # number of the sample in the arrays' first place
        self._starts: list[int] = [0]  # of stretches between which samples are missing
        self._code = 0.0

    def add(self, stamps: np.ndarray, codes: np.ndarray | None, marks: np.ndarray, pulled: float) -> None:
        """Take the next samples, at most as many as are kept.

        Args:
            stamps: ndarray, shape (n_samples,), seconds of the sender's clock.
            codes: ndarray, shape (n_samples,): the trigger channel; None where there is none.
            marks: ndarray, shape (n_samples,), uint8: ``RAILED``, ``NOT_FINITE``, both or 0.
            pulled: When they were received, seconds of the receiver's clock.
        """
        n = len(stamps)
        at = self.end - self._first
        if at + n > len(self._stamps):
            keep = slice(at - self._kept, at)
            for one in (self._stamps, self._pulled, self._edge, self._marks):
                one[: self._kept] = one[keep].copy()
            self._first, at = self.end - self._kept, self._kept
        into = slice(at, at + n)
        self._stamps[into], self._pulled[into], self._marks[into] = stamps, pulled, marks
        self._edge[into] = self._edges(codes) if codes is not None else False
        self.end += n

    def broken(self) -> None:
        """Say that samples are missing before the next one."""
        self._starts = [one for one in self._starts if one > self._first][-50:] + [self.end]
        self._code = 0.0

    def _edges(self, codes: np.ndarray) -> np.ndarray:
        before = np.concatenate([[self._code], codes[:-1]])
        self._code = float(codes[-1])
        return np.asarray((codes != before) & (codes != 0) & np.isfinite(codes))

    def place(self, moment: float) -> float | None:
        """Return which sample, with a fraction, was taken at a moment; None where none was, or it is not known yet.

        Args:
            moment: Seconds of the sender's clock.
        """
        for start, stop in reversed(self._stretches()):
            stamps = self._stamps[start - self._first : stop - self._first]
            if len(stamps) < 2 or moment < stamps[0] - 1 / self._sfreq or moment > stamps[-1]:
                continue
            at = int(np.searchsorted(stamps, moment))
            # Stamps may waver: the clock of the samples is what those of the last second agree on.
            near = np.arange(max(0, at - round(_FIT_S * self._sfreq)), at + 1)
            here = float(np.median(stamps[near] + (at - near) / self._sfreq))
            return start + at + (moment - here) * self._sfreq
        return None

    def forgotten(self, moment: float) -> bool:
        """Return whether a moment of the sender's clock lies before all that is kept, of samples that have come."""
        return self._first > 0 and moment < float(self._stamps[0])

    def passed(self, moment: float) -> bool:
        """Return whether the newest sample was taken after a moment of the sender's clock."""
        return self.end > self._first and float(self._stamps[self.end - 1 - self._first]) > moment

    def edge(self, place: float, window: float) -> int | None:
        """Return the sample of the trigger edge nearest to a place, at most ``window`` samples away; None for none."""
        low, high = max(self._first, math.ceil(place - window)), min(self.end, math.floor(place + window) + 1)
        found = np.flatnonzero(self._edge[max(low - self._first, 0) : max(high - self._first, 0)]) + low
        return int(found[np.argmin(np.abs(found - place))]) if len(found) else None

    def with_stamp(self, stamp: float) -> int | None:
        """Return the newest sample that has exactly this stamp; None where it is not kept."""
        found = np.flatnonzero(self._stamps[: self.end - self._first] == stamp)
        return int(found[-1]) + self._first if len(found) else None

    def stamp(self, sample: int) -> float:
        """Return the stamp of a sample that is kept, seconds of the sender's clock."""
        return float(self._stamps[sample - self._first])

    def pulled(self, sample: int) -> float:
        """Return when a sample that is kept was received, seconds of the receiver's clock."""
        return float(self._pulled[sample - self._first])

    def marked(self, first: int, length: int) -> int:
        """Return the marks of an epoch's samples together, as far as they have come."""
        at = first - self._first
        part = self._marks[max(at, 0) : min(at + length, self.end - self._first)]
        return int(np.bitwise_or.reduce(part, initial=0))

    def _stretches(self) -> list[tuple[int, int]]:
        starts = [max(one, self._first) for one in self._starts]
        pairs = zip([self._first, *starts], [*starts, self.end], strict=True)
        return [(start, stop) for start, stop in pairs if stop > start]
