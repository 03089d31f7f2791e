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
# Trials a block: fewer make more calls, more leave the caches.
BLOCK = 24


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
    shape = (len(plan.bands), plan.grid.n_kept, data.shape[1])
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
class _Spectra:
    """The spectra of a block of epochs; its rows are trials × channels."""

    half: NDArray[np.complex64]  # (rows, bins up to half the sampling rate); the others mirror them, the data are real
    around: NDArray[np.complex64]  # (bins from ``lowest`` onwards, rows)
    lowest: int


@dataclass(frozen=True)
class _Run:
    """Trials of a block, one after the other, that belong to the same pattern of memberships."""

    pattern: int
    trials: slice


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

    def add_to(self, sums: NDArray[np.float32], spectra: _Spectra, runs: Sequence[_Run], grid: _Grid) -> None:
        """Add the magnitudes of each run's trials to its pattern's ``sums`` (patterns, kept samples, channels)."""
        start = self.centre - self.side - spectra.lowest
        bins = spectra.around[start : start + len(self.weights)] * self.weights[:, None]
        up, down = bins[self.side :], bins[self.side :: -1]
        # Real and imaginary parts lie side by side, so that one real product serves both.
        even = self.cosine @ (up + down).view(np.float32)
        odd = self.sine @ ((up - down) * np.complex64(1j)).view(np.float32)
        after = (even + odd).view(np.complex64)
        before = np.subtract(even, odd, out=even).view(np.complex64)
        _add_runs(sums[:, grid.middle :], np.abs(after)[: grid.n_kept - grid.middle], runs)
        _add_runs(sums[:, : grid.middle], np.abs(before)[:0:-1], runs)


@dataclass(frozen=True)
class _Wide:
    """A wavelet of many bins: the weights of all of them, over ``step``."""

    weights: NDArray[np.float32]

    def add_to(self, sums: NDArray[np.float32], spectra: _Spectra, runs: Sequence[_Run], grid: _Grid) -> None:
        """Do the same as :meth:`_Narrow.add_to`; keeping every n-th sample folds the spectrum n times."""
        half = spectra.half
        bins = np.empty((len(half), grid.length), np.complex64)
        n = half.shape[1]
        np.multiply(half, self.weights[:n], out=bins[:, :n])
        np.conj(half[:, grid.length - n : 0 : -1], out=bins[:, n:])
        bins[:, n:] *= self.weights[n:]
        folded = bins.reshape(len(bins), grid.step, -1).sum(axis=1)
        size = np.abs(scipy.fft.ifft(folded, overwrite_x=True)).T
        _add_runs(sums[:, grid.middle :], size[: grid.n_kept - grid.middle], runs)
        _add_runs(sums[:, : grid.middle], size[len(size) - grid.middle :], runs)


@dataclass(frozen=True)
class _Plan:
    grid: _Grid
    bands: tuple[_Narrow | _Wide, ...]
    around: range  # the bins, of either sign, that the narrow ones among them need

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
        lowest = min((band.centre - band.side for band in narrow), default=0)
        highest = max((band.centre + band.side for band in narrow), default=-1)
        return cls(grid, bands, range(lowest, highest + 1))


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
        data: Epochs, shape (trials, channels, samples).
        trials: Which trials.
        ids: The pattern of each of them, in rising order.
        plan: What to compute.
    """
    for start in range(0, len(trials), BLOCK):
        mine = ids[start : start + BLOCK]
        edges = [0, *(np.flatnonzero(np.diff(mine)) + 1), len(mine)]
        runs = [_Run(mine[first], slice(first, stop)) for first, stop in itertools.pairwise(edges)]
        spectra = _spectra(data, trials[start : start + BLOCK], plan)
        for i, band in enumerate(plan.bands):
            band.add_to(sums[:, i], spectra, runs, plan.grid)


def _spectra(data: NDArray[np.floating], block: NDArray[np.intp], plan: _Plan) -> _Spectra:
    length = plan.grid.length
    zero = plan.grid.middle * plan.grid.step
    padded = np.zeros((len(block), data.shape[1], length), np.float32)
    for row, trial in zip(padded, block, strict=True):
        row[:, : data.shape[2] - zero] = data[trial, :, zero:]
        row[:, length - zero :] = data[trial, :, :zero]
    half = scipy.fft.rfft(padded.reshape(-1, length))
    bins = np.arange(plan.around.start, plan.around.stop) % length
    mirrored = bins > length // 2
    around = half.T[np.where(mirrored, length - bins, bins)]
    around[mirrored] = around[mirrored].conj()
    return _Spectra(half, around, plan.around.start)


def _add_runs(sums: NDArray[np.float32], sizes: NDArray[np.float32], runs: Sequence[_Run]) -> None:
    """Add sizes (samples, trials × channels), summed over each run's trials, to ``sums`` of the run's pattern."""
    channels = sums.shape[2]
    for run in runs:
        rows = slice(run.trials.start * channels, run.trials.stop * channels)
        trials = sizes[:, rows].reshape(len(sizes), run.trials.stop - run.trials.start, channels)
        sums[run.pattern] += np.einsum("stc->sc", trials)  # several times quicker than sum(axis=1)
