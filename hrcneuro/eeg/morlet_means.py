"""Condition means of wavelet magnitudes without single-trial maps: the fast twin of :mod:`hrcneuro.eeg.morlet`.

Magnitudes ignore phase, so a wavelet's output may be shifted down to 0 Hz: what is left is a sum over the few bins of
the spectrum around the wavelet's centre, evaluated only at the samples that are kept. Bins at equal distance above and
below the centre share a cosine and a sine, and so do samples at equal distance before and after the epoch's middle.
Thus one block of trials costs an FFT and, a wavelet, two small real matrix products; nothing larger is ever stored.
A wavelet whose spectrum is wide (the kernel's ends cut the slowest one off) goes through an inverse FFT instead.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
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
# Trials a block: its intermediate arrays should fit the second-level cache.
BLOCK = 16


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
    shape = (len(plan.bands), data.shape[1], plan.grid.n_kept)
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
    return total.reshape(-1, *shape).transpose(0, 2, 1, 3)


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
    cosine: NDArray[np.float32]  # (side + 1, samples from the middle onwards)
    sine: NDArray[np.float32]

    @property
    def side(self) -> int:
        return len(self.weights) // 2

    def sums(
        self, spectrum: NDArray[np.complex64], zero: int, edges: Sequence[int], grid: _Grid
    ) -> NDArray[np.float32]:
        """Return the magnitudes summed over runs of trials, shape (runs, channels, kept samples).

        Args:
            spectrum: Shape (trials × channels, bins).
            zero: Where 0 Hz lies among the bins.
            edges: The first trial of each run, and the number of trials.
            grid: The samples to keep.
        """
        start, rows = zero + self.centre - self.side, len(spectrum)
        bins = spectrum[:, start : start + len(self.weights)] * self.weights
        up, down = bins[:, self.side :], bins[:, self.side :: -1]
        even = np.empty((2, rows, self.side + 1), np.float32)  # real parts, then imaginary ones
        odd = np.empty_like(even)
        np.add(up.real, down.real, out=even[0])
        np.add(up.imag, down.imag, out=even[1])
        np.subtract(up.imag, down.imag, out=odd[0])
        np.subtract(down.real, up.real, out=odd[1])
        cosines = even.reshape(2 * rows, -1) @ self.cosine
        sines = odd.reshape(2 * rows, -1) @ self.sine
        after = _over_trials(_magnitude(cosines - sines), edges)
        before = _over_trials(_magnitude(np.add(cosines, sines, out=cosines)), edges)
        return np.concatenate([before[..., :0:-1], after[..., : grid.n_kept - grid.middle]], axis=-1)


@dataclass(frozen=True)
class _Wide:
    """A wavelet of many bins: the weights of all of them, over ``step``."""

    weights: NDArray[np.float32]

    def sums(
        self, spectrum: NDArray[np.complex64], zero: int, edges: Sequence[int], grid: _Grid
    ) -> NDArray[np.float32]:
        """Return the same as :meth:`_Narrow.sums`; keeping every n-th sample folds the spectrum n times."""
        bins = spectrum[:, zero : zero + grid.length] * self.weights
        folded = bins.reshape(len(bins), grid.step, -1).sum(axis=1)
        wave = _over_trials(np.abs(scipy.fft.ifft(folded, overwrite_x=True)), edges)
        return np.concatenate(
            [wave[..., wave.shape[-1] - grid.middle :], wave[..., : grid.n_kept - grid.middle]], axis=-1
        )


@dataclass(frozen=True)
class _Plan:
    grid: _Grid
    bands: tuple[_Narrow | _Wide, ...]
    below: int  # bins repeated below 0 Hz
    above: int  # bins repeated above the sampling rate

    @classmethod
    def of(cls, wavelets: Wavelets, n_times: int, step: int) -> _Plan:
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
        bands = tuple(_band(spectrum, centre, grid) for spectrum, centre in zip(spectra, centres, strict=True))
        narrow = [band for band in bands if isinstance(band, _Narrow)]
        below = max([0, *(band.side - band.centre for band in narrow)])
        above = max([0, *(band.centre + band.side + 1 - length for band in narrow)])
        return cls(grid, bands, below, above)


def _band(spectrum: NDArray[np.float64], centre: int, grid: _Grid) -> _Narrow | _Wide:
    length = grid.length
    around = np.abs(np.roll(spectrum, -centre))
    strong = np.flatnonzero(np.maximum(around, np.roll(around[::-1], 1)) > NEGLIGIBLE * around.max())
    side = int(strong[strong <= length // 2].max())
    if side > WIDE or 2 * side + 1 > length:
        return _Wide((spectrum / grid.step).astype(np.float32))
    weights = spectrum[np.arange(centre - side, centre + side + 1) % length] / length
    weights[side] /= 2  # the centre is its own partner
    angle = 2 * np.pi / length * np.outer(np.arange(side + 1), grid.step * np.arange(grid.middle + 1))
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
        sums: Shape (patterns, wavelets, channels, kept samples).
        data: Epochs, shape (trials, channels, samples).
        trials: Which trials.
        ids: The pattern of each of them, in rising order.
        plan: What to compute.
    """
    for start in range(0, len(trials), BLOCK):
        mine = ids[start : start + BLOCK]
        spectrum = _spectrum(data, trials[start : start + BLOCK], plan)
        edges = [0, *(np.flatnonzero(np.diff(mine)) + 1), len(mine)]
        for i, band in enumerate(plan.bands):
            found = band.sums(spectrum, plan.below, edges, plan.grid)
            for pattern, values in zip(mine[edges[:-1]], found, strict=True):
                sums[pattern, i] += values


def _spectrum(data: NDArray[np.floating], block: NDArray[np.intp], plan: _Plan) -> NDArray[np.complex64]:
    """Return the block's spectra with the bins repeated beyond both ends, shape (trials × channels, bins)."""
    length, below = plan.grid.length, plan.below
    zero = plan.grid.middle * plan.grid.step
    padded = np.zeros((len(block), data.shape[1], length), np.float32)
    for row, trial in zip(padded, block, strict=True):
        row[:, : data.shape[2] - zero] = data[trial, :, zero:]
        row[:, length - zero :] = data[trial, :, :zero]
    half = scipy.fft.rfft(padded.reshape(-1, length))
    spectrum = np.empty((len(half), below + length + plan.above), np.complex64)
    one = spectrum[:, below : below + length]
    one[:, : length // 2 + 1] = half
    np.conj(half[:, (length - 1) // 2 : 0 : -1], out=one[:, length // 2 + 1 :])
    spectrum[:, :below] = one[:, length - below :]
    spectrum[:, below + length :] = one[:, : plan.above]
    return spectrum


def _over_trials(rows: NDArray[np.float32], edges: Sequence[int]) -> NDArray[np.float32]:
    """Return the sums over runs of trials of rows (trials × channels), shape (runs, channels, samples)."""
    trials = rows.reshape(edges[-1], -1, rows.shape[1])
    return np.stack([trials[start:stop].sum(axis=0) for start, stop in itertools.pairwise(edges)])


def _magnitude(parts: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the root of the sum of squares of the real (first half of the rows) and the imaginary part, in place."""
    np.multiply(parts, parts, out=parts)
    real, imaginary = np.split(parts, 2)
    np.add(real, imaginary, out=real)
    return np.sqrt(real, out=real)
