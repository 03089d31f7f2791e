"""Condition means of wavelet magnitudes without single-trial maps: the fast twin of :mod:`hrcneuro.eeg.morlet`.

Magnitudes ignore phase, so a wavelet's output may be shifted down to 0 Hz: what is left is a sum over the few bins of
the spectrum around the wavelet's centre, evaluated only at the samples that are kept. Bins at equal distance above and
below the centre share a cosine and a sine, and so do samples at equal distance before and after the epoch's middle.
Thus one block of trials costs an FFT and, a wavelet, two small real matrix products; nothing larger is ever stored.
Their results lie samples × (trials × channels), for complex numbers can then be read from them without a copy.
A wavelet whose spectrum is wide (the kernel's ends cut the slowest one off) goes through an inverse FFT instead.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from hrcneuro.eeg.morlet import Wavelets, trial_counts

# Bins weaker than this share of a wavelet's peak are left out of the products (a Gaussian at 5.3 SD).
NEGLIGIBLE = 1e-6
# Beyond this number of bins on a side the inverse FFT is quicker than the products.
WIDE = 80
# Sets of memberships held at a time: 40 MB of the paper's maps.
PATTERNS = 64
# Points of the maps that are shared out at a time, for the cache's sake as well.
COLUMNS = 4096
# Trials a block: fewer make more calls, more leave the caches.
BLOCK = 24
# Trials that are transformed at a time.
FEW = 8


def mean_magnitudes(
    data: NDArray[np.floating], masks: NDArray[np.bool_], wavelets: Wavelets, *, step: int = 1
) -> NDArray[np.float64]:
    """Return the mean magnitude over the trials of each condition, in single precision.

    Equals :func:`hrcneuro.eeg.morlet.mean_magnitudes` (same arguments, shapes and errors) to about 1e-6.
    """
    counts = trial_counts(data, masks)
    plan = _Plan.of(wavelets, data.shape[2], step)
    # Trials with the same memberships are summed once, whatever the number of conditions they serve.
    patterns, pattern_of = np.unique(masks.T, axis=0, return_inverse=True)
    order = np.argsort(pattern_of, axis=None, kind="stable")
    order = order[np.isin(order, np.flatnonzero(masks.any(axis=0)))]
    ids = pattern_of.ravel()[order]
    shape = (len(wavelets.frequencies), plan.grid.n_kept, data.shape[1])
    total = np.zeros((len(masks), int(np.prod(shape))))
    for first in range(0, len(patterns), PATTERNS):
        some = slice(*np.searchsorted(ids, [first, first + PATTERNS]))
        sums = np.zeros((len(patterns[first : first + PATTERNS]), *shape), np.float32)
        _add_magnitudes(sums, data, order[some], ids[some] - first, plan)
        members, flat = patterns[first : first + PATTERNS].T.astype(np.float32), sums.reshape(len(sums), -1)
        for start in range(0, flat.shape[1], COLUMNS):
            part = slice(start, start + COLUMNS)
            total[:, part] += members @ flat[:, part]
    total /= counts[:, None]
    return total.reshape(-1, *shape).transpose(0, 3, 1, 2)


@dataclass(frozen=True)
class _Grid:
    """The FFT of an epoch that keeps every ``step``-th of its samples; time zero is a kept sample in the middle."""

    n_times: int
    step: int
    length: int

    @property
    def n_kept(self) -> int:
        return -(-self.n_times // self.step)

    @property
    def middle(self) -> int:
        return self.n_kept // 2


@dataclass(frozen=True)
class _Narrow:
    """A wavelet of few bins: ``weights`` around the bin ``centre``, and what each pair of bins adds at each sample."""

    centre: int
    weights: NDArray[np.float32]  # (2 side + 1,)
    cosine: NDArray[np.float32]  # (samples from the middle onwards, side + 1)
    sine: NDArray[np.float32]

    @property
    def side(self) -> int:
        return len(self.weights) // 2

    def add_to(
        self, sums: NDArray[np.float32], near: NDArray[np.complex64], ids: NDArray[np.intp], grid: _Grid
    ) -> None:
        """Add the magnitudes of trials to the sums of their patterns.

        Args:
            sums: Shape (patterns, kept samples, channels).
            near: The bins from ``centre - side`` onwards, shape (bins, trials × channels).
            ids: The pattern of each trial, in rising order.
            grid: The samples to keep.
        """
        bins = near[: len(self.weights)] * self.weights[:, None]
        up, down = bins[self.side :], bins[self.side :: -1]
        # Real and imaginary parts lie side by side, so that one real product serves both.
        even = self.cosine @ (up + down).view(np.float32)
        odd = self.sine @ ((up - down) * np.complex64(1j)).view(np.float32)
        after = (even + odd).view(np.complex64)
        before = np.subtract(even, odd, out=even).view(np.complex64)
        _add_trials(sums[:, grid.middle :], np.abs(after)[: grid.n_kept - grid.middle], ids)
        _add_trials(sums[:, : grid.middle], np.abs(before)[:0:-1], ids)


@dataclass(frozen=True)
class _Wide:
    """A wavelet of many bins: the weights of all of them, over ``step``."""

    weights: NDArray[np.float32]

    def add_to(
        self, sums: NDArray[np.float32], half: NDArray[np.complex64], ids: NDArray[np.intp], grid: _Grid
    ) -> None:
        """Do the same as :meth:`_Narrow.add_to` with ``half`` of the spectra, shape (trials × channels, bins)."""
        n = half.shape[1]
        bins = np.empty((len(half), grid.length), np.complex64)
        np.multiply(half, self.weights[:n], out=bins[:, :n])
        np.conj(half[:, grid.length - n : 0 : -1], out=bins[:, n:])
        bins[:, n:] *= self.weights[n:]
        # Keeping every n-th sample folds the spectrum n times.
        folded = bins.reshape(len(bins), grid.step, -1).sum(axis=1)
        sizes = np.abs(scipy.fft.ifft(folded, overwrite_x=True)).T
        _add_trials(sums[:, grid.middle :], sizes[: grid.n_kept - grid.middle], ids)
        _add_trials(sums[:, : grid.middle], sizes[len(sizes) - grid.middle :], ids)


@dataclass(frozen=True)
class _Plan:
    grid: _Grid
    narrow: dict[int, _Narrow]  # by number of the wavelet
    wide: dict[int, _Wide]

    @classmethod
    def of(cls, wavelets: Wavelets, n_times: int, step: int) -> _Plan:
        """Return what to compute of epochs of ``n_times`` samples, of which every ``step``-th is kept."""
        half = wavelets.half
        # Half a kernel of zeros suffices: what wraps around meets only samples that "same" convolution drops.
        length = scipy.fft.next_fast_len(-(-(n_times + half) // step)) * step
        kernels = np.zeros((len(wavelets.frequencies), length), complex)
        kernels[:, : half + 1] = wavelets.kernels[:, half:]
        kernels[:, length - half :] += wavelets.kernels[:, :half]
        # A kernel centred on time zero is Hermitian, so its spectrum is real.
        spectra = np.fft.fft(kernels).real * (2 / wavelets.peaks(n_times))[:, None]
        grid = _Grid(n_times, step, length)
        centres = [round(f * length / wavelets.sfreq) for f in wavelets.frequencies]
        bands = [_band(spectrum, centre, grid) for spectrum, centre in zip(spectra, centres, strict=True)]
        return cls(
            grid,
            {i: band for i, band in enumerate(bands) if isinstance(band, _Narrow)},
            {i: band for i, band in enumerate(bands) if isinstance(band, _Wide)},
        )


def _band(spectrum: NDArray[np.float64], centre: int, grid: _Grid) -> _Narrow | _Wide:
    length = grid.length
    around = np.abs(np.roll(spectrum, -centre))
    strong = np.flatnonzero(np.maximum(around, np.roll(around[::-1], 1)) > NEGLIGIBLE * around.max())
    side = int(strong[strong <= length // 2].max())
    if side > WIDE or 2 * side + 1 > length:
        return _Wide((spectrum / grid.step).astype(np.float32))
    weights = spectrum[np.arange(centre - side, centre + side + 1) % length] / length
    weights[side] /= 2  # the centre is its own partner
    angle = 2 * np.pi / length * np.outer(grid.step * np.arange(grid.middle + 1), np.arange(side + 1))
    return _Narrow(centre, *(part.astype(np.float32) for part in (weights, np.cos(angle), np.sin(angle))))


def _add_magnitudes(
    sums: NDArray[np.float32],
    data: NDArray[np.floating],
    trials: NDArray[np.intp],
    ids: NDArray[np.intp],
    plan: _Plan,
) -> None:
    """Add each trial's magnitudes to the sum of its pattern.

    Args:
        sums: Shape (patterns, wavelets, kept samples, channels).
        data: Epochs, ndarray, shape (n_epochs, n_channels, n_times).
        trials: Which trials.
        ids: The pattern of each of them, in rising order.
        plan: What to compute.
    """
    channels, length = data.shape[1], plan.grid.length
    lowest = min((band.centre - band.side for band in plan.narrow.values()), default=0)
    highest = max((band.centre + band.side for band in plan.narrow.values()), default=-1)
    bins = np.arange(lowest, highest + 1) % length
    mirrored = bins > length // 2
    source = np.where(mirrored, length - bins, bins)
    for start in range(0, len(trials), BLOCK):
        block, mine = trials[start : start + BLOCK], ids[start : start + BLOCK]
        near = np.empty((len(bins), len(block) * channels), np.complex64)
        for first in range(0, len(block), FEW):
            few = slice(first, first + FEW)
            half = _half_spectra(data, block[few], plan.grid)
            near[:, first * channels : (first + FEW) * channels] = half.T[source]
            for i, wide in plan.wide.items():
                wide.add_to(sums[:, i], half, mine[few], plan.grid)
        near[mirrored] = near[mirrored].conj()
        for i, narrow in plan.narrow.items():
            narrow.add_to(sums[:, i], near[narrow.centre - narrow.side - lowest :], mine, plan.grid)


def _half_spectra(data: NDArray[np.floating], block: NDArray[np.intp], grid: _Grid) -> NDArray[np.complex64]:
    """Return the block's spectra up to half the sampling rate, shape (trials × channels, bins)."""
    zero = grid.middle * grid.step
    padded = np.zeros((len(block), data.shape[1], grid.length), np.float32)
    for row, trial in zip(padded, block, strict=True):
        row[:, : data.shape[2] - zero] = data[trial, :, zero:]
        row[:, grid.length - zero :] = data[trial, :, :zero]
    half: NDArray[np.complex64] = scipy.fft.rfft(padded.reshape(-1, grid.length))
    return half


def _add_trials(sums: NDArray[np.float32], sizes: NDArray[np.float32], ids: NDArray[np.intp]) -> None:
    """Add sizes (samples, trials × channels) to the ``sums`` (patterns, samples, channels) of the trials' patterns."""
    trials = sizes.reshape(len(sizes), len(ids), sums.shape[2])
    edges = [0, *(np.flatnonzero(np.diff(ids)) + 1), len(ids)]
    for start, stop in itertools.pairwise(edges):
        sums[ids[start]] += np.einsum("stc->sc", trials[:, start:stop])  # several times quicker than sum(axis=1)
