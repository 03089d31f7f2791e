"""A stream filtered as it comes, and its last seconds kept, so that an epoch can be cut as soon as it is complete.

One code for a live stream and for a recording on disk: whatever the lengths of the chunks, the result is the same to
the last bit. Time is counted in samples that were received; what is lost between two of them is a break.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.eeg.refusals import Refusal
from hrcneuro.eeg.spans import spans


class EpochError(Refusal):
    """An epoch cannot be cut from what is kept of a stream; ``state`` says why."""


class State(enum.Enum):
    """How it stands with an epoch of a stream."""

    COMPLETE = "complete"
    COMING = "coming"  # its last sample has not been received
    GONE = "gone"  # its first sample is no longer kept
    BROKEN = "broken"  # samples in it were lost, or are no numbers


@dataclass(frozen=True)
class Design:
    """A causal filter as numbers.

    Attributes:
        sos: ndarray, shape (n_sections, 6): second-order sections, in their order.
        settled: ndarray, shape (n_sections, 2): the state in which the filter rests at a constant input of one.
    """

    sos: np.ndarray
    settled: np.ndarray


def design(sfreq: float, l_freq: float, h_freq: float) -> Design:
    """Return the first-order high-pass and fourth-order low-pass (Butterworth) that :class:`.filters.CausalFilter` has.

    Args:
        sfreq: Sampling rate, in Hz.
        l_freq, h_freq: Edges of the pass band, in Hz.

    Raises:
        BandError: The edges are not 0 < l_freq < h_freq < sfreq / 2.
    """
    from scipy.signal import sosfilt_zi

    from hrcneuro.eeg.filters import CausalFilter

    sos = CausalFilter(sfreq, l_freq, h_freq).sos
    return Design(sos, sosfilt_zi(sos))


class CausalChain:
    """A causal filter that goes on from chunk to chunk.

    It begins, and begins anew after a break, settled on its first sample, so that an electrode's offset does not ring.
    A sample that is no number on some channel is a break by itself: it is NaN in the result, and harms no later one.
    """

    def __init__(self, design: Design) -> None:
        from scipy.signal import sosfilt

        self._sosfilt = sosfilt
        self.design = design
        self._state: np.ndarray | None = None

    @property
    def memory(self) -> np.ndarray | None:
        """What it keeps of the past: ndarray, shape (n_sections, n_channels, 2); None where the next sample begins."""
        return None if self._state is None else self._state.copy()

    def go_on(self, memory: np.ndarray) -> None:
        """Go on where another one was, whose ``memory`` this is.

        Raises:
            ValueError: It is another filter's.
        """
        if memory.ndim != 3 or len(memory) != len(self.design.sos) or memory.shape[2] != 2:
            raise ValueError(f"a memory of shape {memory.shape}; allowed: ({len(self.design.sos)}, n_channels, 2)")
        self._state = np.array(memory, float)

    def reset(self) -> None:
        """Forget the past: the next sample begins a new stretch."""
        self._state = None

    def apply(self, chunk: np.ndarray) -> np.ndarray:
        """Return the next samples filtered.

        Args:
            chunk: ndarray, shape (n_channels, n_times), any unit, floating point; as many channels in every call.

        Returns:
            ndarray, shape (n_channels, n_times), in that unit; NaN on all channels where one of them is no number.
        """
        # A sum is finite only where all its terms are: one fast pass.
        if np.isfinite(chunk.sum()):
            return self._filtered(chunk)
        good = np.isfinite(chunk).all(axis=0)
        out = np.full(chunk.shape, np.nan)
        for start, stop in spans(good):
            if start > 0:
                self.reset()
            out[:, start:stop] = self._filtered(chunk[:, start:stop])
        if not good[-1]:
            self.reset()
        return out

    def _filtered(self, chunk: np.ndarray) -> np.ndarray:
        if chunk.shape[1] == 0:
            return chunk.astype(float)
        if self._state is None:
            self._state = self.design.settled[:, None, :] * chunk[None, :, :1]
        out, self._state = self._sosfilt(self.design.sos, chunk, axis=1, zi=self._state)
        return out


class CausalStream:
    """A stream that is filtered as it comes; its last samples are kept.

    Attributes:
        end: How many samples have been received: the number of the next one.
    """

    def __init__(self, design: Design, n_channels: int, *, kept: int, ignored: Sequence[int] = ()) -> None:
        """Begin a stream.

        Args:
            design: The filter.
            n_channels: Channels of every chunk.
            kept: How many of the last samples are kept; an epoch must be cut within as many.
            ignored: Rows of channels that nobody reads, as of a broken electrode: they are 0, whatever comes.
        """
        self.chain = CausalChain(design)
        self.end = 0
        self._ignored = np.array(sorted(ignored), int)
        self._last = np.zeros((n_channels, kept))
        self._breaks: list[int] = []  # first samples of new stretches
        self._holes: list[tuple[int, int]] = []  # samples that are no numbers: the first, and the first after them

    def push(self, chunk: np.ndarray) -> None:
        """Take the next samples.

        Args:
            chunk: ndarray, shape (n_channels, n_times), any length.

        Raises:
            ValueError: It has another number of channels.
        """
        n_channels, kept = self._last.shape
        if chunk.ndim != 2 or len(chunk) != n_channels:
            raise ValueError(f"a chunk of shape {chunk.shape}; the stream has {n_channels} channels × samples")
        samples = np.array(chunk, float)  # double precision, whatever comes; a copy, since rows may be set to 0
        samples[self._ignored] = 0.0
        filtered = self.chain.apply(samples)
        new = filtered.shape[1]
        # Where a sample is no number on one channel, it is none on all.
        if n_channels and np.isnan(filtered[0]).any():
            self._holes = [hole for hole in self._holes if hole[1] > self.end - kept]
            self._holes += [(self.end + a, self.end + b) for a, b in spans(np.isnan(filtered[0]))]
        if new >= kept:
            filtered = filtered[:, new - kept :]
        start = (self.end + new - filtered.shape[1]) % kept
        first = min(filtered.shape[1], kept - start)
        self._last[:, start : start + first] = filtered[:, :first]
        self._last[:, : filtered.shape[1] - first] = filtered[:, first:]
        self.end += new

    def broken(self) -> None:
        """Say that samples are missing between the last one and the next."""
        self.chain.reset()
        self._breaks = [at for at in self._breaks if at > self.end - self._last.shape[1]]
        if self.end > 0 and self.end not in self._breaks:
            self._breaks.append(self.end)

    def state(self, first: int, length: int) -> State:
        """Return how it stands with the epoch of ``length`` samples that begins with the sample ``first``."""
        if first < max(0, self.end - self._last.shape[1]):
            return State.GONE
        stop = first + length
        if any(first < at < stop for at in self._breaks) or any(a < stop and first < b for a, b in self._holes):
            return State.BROKEN
        return State.COMING if stop > self.end else State.COMPLETE

    def cut(self, first: int, length: int) -> np.ndarray:
        """Return an epoch of the filtered signal, a copy: ndarray, shape (n_channels, length).

        Raises:
            EpochError: It is not complete.
        """
        state = self.state(first, length)
        if state is not State.COMPLETE:
            raise EpochError(
                f"the epoch of samples {first} to {first + length - 1} is {state.value}; the stream has received "
                f"{self.end} samples and keeps the last {self._last.shape[1]}",
                state=state,
            )
        n_channels, kept = self._last.shape
        start = first % kept
        before = min(length, kept - start)
        out = np.empty((n_channels, length))
        out[:, :before] = self._last[:, start : start + before]
        out[:, before:] = self._last[:, : length - before]
        return out


def nearest(zero: float) -> int:
    """Return the sample with which an epoch begins whose zero lies between samples: the nearest one, ½ goes up.

    So epochs begin at most half a sample beside their zero, and the weights of features over time stay what they were
    when the decoder was made.
    """
    return math.floor(zero + 0.5)
