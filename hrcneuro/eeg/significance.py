"""Where two conditions differ significantly over subjects: a map of channels, times and perhaps frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SignificanceMap:
    """The difference of two conditions over subjects, and where it is significant.

    Attributes:
        n: Subjects.
        channels: Their names.
        times: From the onset, ndarray, shape (n_times,), s.
        difference: ndarray, shape (n_channels, n_times) for potentials, (n_channels, n_frequencies, n_times) for
            magnitudes, µV.
        significant: The same shape.
        frequencies: ndarray, shape (n_frequencies,), Hz; empty for potentials.
    """

    n: int
    channels: list[str]
    times: Floats
    difference: Floats
    significant: NDArray[np.bool_]
    frequencies: Floats

    def within(
        self,
        channels: tuple[str, ...] = (),
        *,
        hz: tuple[float, float] | None = None,
        s: tuple[float, float] | None = None,
    ) -> SignificanceMap:
        """Return the part with these channels, frequencies and times (edges included)."""
        rows = [i for i, name in enumerate(self.channels) if not channels or name in channels]
        times = np.flatnonzero((self.times >= s[0]) & (self.times <= s[1])) if s else np.arange(len(self.times))
        difference, significant = self.difference[rows][..., times], self.significant[rows][..., times]
        bins = np.arange(len(self.frequencies))
        if hz:
            bins = np.flatnonzero((self.frequencies >= hz[0]) & (self.frequencies <= hz[1]))
            difference, significant = difference[:, bins], significant[:, bins]
        return SignificanceMap(
            self.n,
            [self.channels[i] for i in rows],
            self.times[times],
            difference,
            significant,
            self.frequencies[bins],
        )

    def of_channels(self, channels: Sequence[str]) -> SignificanceMap:
        """Return the part with these channels, in this order."""
        rows = [self.channels.index(name) for name in channels]
        return replace(
            self, channels=list(channels), difference=self.difference[rows], significant=self.significant[rows]
        )

    @property
    def tested(self) -> bool:
        """Whether there was a test: the difference of one subject is descriptive."""
        return self.n > 1

    @property
    def any(self) -> bool:
        """Whether anything is significant."""
        return bool(self.significant.any())

    @property
    def first_s(self) -> float:
        """The first significant time, s; NaN where there is none."""
        return float(self.times[self._when().argmax()]) if self.any else float("nan")

    def describe(self) -> str:
        """Return where and when the map is significant, in a few words."""
        if not self.any:
            return f"nothing significant (n = {self.n})"
        when = np.flatnonzero(self._when())
        rows = np.flatnonzero(self.significant.reshape(len(self.channels), -1).any(axis=1))
        names = [self.channels[i] for i in rows]
        where = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        first, last = (f"{1000 * self.times[i]:.0f}" for i in (when[0], when[-1]))
        text = f"{where}, {first} to {last} ms" if first != last else f"{where}, {first} ms"
        if len(self.frequencies):
            bins = self.frequencies[self.significant.any(axis=(0, 2))]
            text += f", {bins.min():g} to {bins.max():g} Hz" if len(bins) > 1 else f", {bins[0]:g} Hz"
        return text

    def _when(self) -> NDArray[np.bool_]:
        """Return at which times anything is significant, shape (n_times,)."""
        return np.asarray(self.significant.reshape(-1, len(self.times)).any(axis=0))


@dataclass(frozen=True)
class ContrastWaves:
    """One channel of a contrast over subjects; each ndarray, shape (n_times,), µV.

    Attributes:
        plus, plus_error, minus, minus_error: Means of the two conditions and their standard errors.
        difference, sd: Mean and SD of the subjects' differences. SD and errors are NaN with one subject.
    """

    plus: Floats
    plus_error: Floats
    minus: Floats
    minus_error: Floats
    difference: Floats
    sd: Floats
