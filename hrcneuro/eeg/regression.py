"""Regression of EEG on what is known of every trial, one model for all channels and times of an epoch.

Each trial adds to the recording the sum of some responses, one a predictor, times its own values of the predictors.
The least-squares responses are regression ERPs (Smith & Kutas 2015, doi:10.1111/psyp.12317). Onsets follow each other
faster than an epoch is long; with :func:`deconvolved` the responses of neighbours are part of the same model, so that
none is left in another's (doi:10.1111/psyp.12320; Ehinger & Dimigen 2019, doi:10.7717/peerj.7838).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from hrcneuro.eeg.refusals import Refusal

Floats = NDArray[np.float64]

# Keeps the system solvable where onsets are too regular to tell two lags apart; far below the noise.
RIDGE = 1e-6
APART = 0.02
"""The least that neighbours may leave of a response: below, its variance is over fifty times that without overlap."""


class RegularOnsetsError(Refusal):
    """Onsets follow each other so regularly that responses cannot be told apart.

    What can least of all is that of predictor number ``column`` at ``sample`` of the epoch.
    """

    column: int
    sample: int


@dataclass(frozen=True)
class OtherOnsets:
    """Onsets without an epoch, whose responses reach into the epochs of others all the same.

    Attributes:
        onsets: Sample of each in the recording, ndarray, shape (n_onsets,).
        spans: Which part of an epoch around it would lie in the same stretch of the recording, as (first sample, first
            sample after), ndarray, shape (n_onsets, 2): no response goes on behind a discontinuity.
        predictors: What is known of them, as of trials, ndarray, shape (n_onsets, n_predictors); None: nothing.
    """

    onsets: NDArray[np.integer]
    spans: NDArray[np.integer]
    predictors: Floats | None = None


def of_epochs(data: Floats, predictors: Floats) -> Floats:
    """Return the least-squares coefficients at every channel and time, neighbours' responses left in them.

    Args:
        data: Epochs, ndarray, shape (n_epochs, n_channels, n_times), µV.
        predictors: A column each, of full rank, ndarray, shape (n_epochs, n_predictors); trials with a NaN are left
            out.

    Returns:
        ndarray, shape (n_predictors, n_channels, n_times), µV a unit of the predictor.
    """
    known = np.isfinite(predictors).all(axis=-1)
    inverse = np.linalg.pinv(predictors[known])
    coefficients: Floats = (inverse @ data[known].reshape(int(known.sum()), -1)).reshape(-1, *data.shape[1:])
    return coefficients


def deconvolved(
    data: Floats,
    onsets: NDArray[np.integer],
    predictors: Floats,
    others: OtherOnsets | None = None,
    *,
    apart: float = 0.0,
) -> Floats:
    """Return the least-squares coefficients at every channel and time, without what neighbours leave in them.

    Every onset has the responses of what is known of it. Those of which something is unknown, a NaN, have one more that
    all of them share. The samples fitted are those within any epoch.

    Args:
        data: Epochs without baseline correction, ndarray, shape (n_epochs, n_channels, n_times), µV.
        onsets: The sample of each trial's onset in the recording, ndarray, shape (n_epochs,).
        predictors: A column each, ndarray, shape (n_epochs, n_predictors).
        others: The recording's other onsets.
        apart: The least share that neighbours may leave of a response at any sample, such as :data:`APART`; below it
            the response would be as good as arbitrary. 0: whatever they leave.

    Returns:
        ndarray, shape (n_predictors, n_channels, n_times), µV a unit of the predictor.

    Raises:
        ValueError: Two trials share an onset.
        RegularOnsetsError: Neighbours leave less of a response than ``apart``.
        LinAlgError: The responses cannot be told apart.
    """
    from scipy import linalg

    if len(np.unique(onsets)) < len(onsets):
        raise ValueError("two trials have their onset at the same sample: their responses cannot be told apart")
    system = _Normal(data, onsets, predictors, others)
    diagonal = np.diag_indices_from(system.matrix)
    # What no fitted sample holds, as parts of the response of onsets far from all epochs, is set to zero.
    held = system.matrix[diagonal]
    system.matrix[diagonal] = np.where(held > 0, held * (1 + RIDGE), 1.0)
    # The transpose is in the order of LAPACK, which needs no copy of it; only its lower triangle is filled, and read.
    factor = linalg.cho_factor(system.matrix.T, lower=True, overwrite_a=True, check_finite=False)
    n_channels, n_times = data.shape[1:]
    _require_apart(factor[0].diagonal()[: predictors.shape[1] * n_times], held, n_times, apart)
    solved = linalg.cho_solve(factor, system.right, overwrite_b=True, check_finite=False)
    every: Floats = solved.reshape(-1, n_times, n_channels).transpose(0, 2, 1)
    return every[: predictors.shape[1]]


def _require_apart(diagonal: Floats, held: Floats, n_times: int, least: float) -> None:
    """Refuse onsets whose neighbours leave too little of a response; ``diagonal`` is that of the Cholesky factor."""
    # Its square is what the columns before leave of one. Predictors that go together have less at every sample alike,
    # regular onsets from the sample on at which the next response begins.
    left = (np.square(diagonal) / np.where(held > 0, held, 1.0)[: len(diagonal)]).reshape(-1, n_times)
    left /= left.max(axis=1, keepdims=True)
    if left.min() < least:
        column, sample = np.unravel_index(int(left.argmin()), left.shape)
        raise RegularOnsetsError(
            f"neighbours leave {left.min():.1g} of predictor {column}'s response at sample {sample}",
            column=int(column),
            sample=int(sample),
        )


class _Normal:
    """The normal equations of the samples within any epoch, a column a predictor and sample of its response.

    Where every sample of two responses is fitted, their product depends on the difference of the two samples alone:
    with predictors x of two trials at onsets a and b, x_a x_b is added at all pairs of samples that are b - a apart. So
    nothing as long as the recording is ever made. An onset without an epoch is fitted in part only, and added by
    itself.

    Attributes:
        matrix: Its upper triangle, ndarray, shape (n_columns · n_times, n_columns · n_times).
        right: ndarray, shape (n_columns · n_times, n_channels), µV.
    """

    def __init__(
        self, data: Floats, onsets: NDArray[np.integer], predictors: Floats, others: OtherOnsets | None
    ) -> None:
        self._order = np.argsort(onsets)
        self._data, self._onsets = data, onsets[self._order]
        reaching = None if others is None else _reaching(others, self._onsets, data.shape[-1])
        rows = (
            predictors if reaching is None else np.concatenate([predictors, _of_others(reaching, predictors.shape[1])])
        )
        unknown = np.isnan(rows).any(axis=-1)
        values = np.nan_to_num(rows)
        if unknown.any():
            values = np.column_stack([values, unknown])
        n_times, n_columns = data.shape[-1], values.shape[1]
        self._values = values[self._order]
        self._others = values[len(data) :]
        products = (values[: len(data)].T @ data.reshape(len(data), -1)).reshape(n_columns, *data.shape[1:])
        self._right = np.ascontiguousarray(products.transpose(0, 2, 1))
        self._blocks = np.empty((n_columns, n_times, n_columns, n_times))
        self._add_trials()
        if reaching is not None:
            self._add_others(reaching)
        self.matrix = self._blocks.reshape(n_columns * n_times, -1)
        self.right = self._right.reshape(n_columns * n_times, -1)

    def _add_trials(self) -> None:
        """Write the products of trials with trials."""
        n_columns, n_times = self._values.shape[1], self._data.shape[-1]
        by_lag = np.zeros((2 * n_times - 1, n_columns, n_columns))
        for apart, first, second in _neighbours(self._onsets, n_times):
            product = np.einsum("np,nq->npq", self._values[first], self._values[second])
            np.add.at(by_lag, n_times - 1 + apart, product)
            if first is not second:
                np.add.at(by_lag, n_times - 1 - apart, product.transpose(0, 2, 1))
        for p in range(n_columns):
            for q in range(p, n_columns):
                self._blocks[p, :, q] = sliding_window_view(by_lag[:, p, q], n_times)[:, ::-1]

    def _add_others(self, others: OtherOnsets) -> None:
        """Add the products of onsets without an epoch with trials and with each other, where a sample is fitted."""
        n_times = self._data.shape[-1]
        held: list[tuple[int, NDArray[np.integer], Floats]] = []
        for onset, (start, stop), values in zip(others.onsets, others.spans, self._others, strict=True):
            lags = np.arange(start, stop)
            epoch, sample = self._holder(onset + lags)
            inside = sample < n_times
            lags, epoch, sample = lags[inside], epoch[inside], sample[inside]
            signal = self._data[self._order[epoch], :, sample]
            for column in np.flatnonzero(values):
                self._right[column, lags] += values[column] * signal
            for trial in np.flatnonzero(np.abs(self._onsets - onset) < n_times):
                there = onset + lags - self._onsets[trial]
                both = (there >= 0) & (there < n_times)
                self._add(there[both], self._values[trial], lags[both], values)
            self._add(lags, values, lags, values / 2)
            for other, theirs, their_values in held:
                if abs(other - onset) < n_times:
                    both = np.intersect1d(onset + lags, other + theirs, assume_unique=True)
                    self._add(both - onset, values, both - other, their_values)
            held.append((onset, lags, values))

    def _add(self, first: NDArray[np.integer], x: Floats, second: NDArray[np.integer], y: Floats) -> None:
        """Add the product of two onsets at samples of their responses that coincide, and its transpose."""
        for p in np.flatnonzero(x):
            for q in np.flatnonzero(y):
                if p <= q:
                    self._blocks[p, first, q, second] += x[p] * y[q]
                if q <= p:
                    self._blocks[q, second, p, first] += x[p] * y[q]

    def _holder(self, samples: NDArray[np.integer]) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
        """Return the last epoch that begins at or before each sample, and the sample's place in it."""
        epoch = np.maximum(np.searchsorted(self._onsets, samples, side="right") - 1, 0)
        place = samples - self._onsets[epoch]
        return epoch, np.where(place < 0, self._data.shape[-1], place)


def _of_others(others: OtherOnsets, n_predictors: int) -> Floats:
    nothing = np.full((len(others.onsets), n_predictors), np.nan)
    return nothing if others.predictors is None else others.predictors


def _neighbours(
    onsets: NDArray[np.integer], n_times: int
) -> Iterator[tuple[NDArray[np.integer], NDArray[np.integer], NDArray[np.integer]]]:
    """Yield how far apart two trials lie, and both, for all pairs whose epochs overlap; first each with itself."""
    every = np.arange(len(onsets))
    yield np.zeros(len(onsets), int), every, every
    for ahead in range(1, len(onsets)):
        apart = onsets[ahead:] - onsets[:-ahead]
        near = np.flatnonzero(apart < n_times)
        if not len(near):
            return
        yield apart[near], near, near + ahead


def _reaching(others: OtherOnsets, onsets: NDArray[np.integer], n_times: int) -> OtherOnsets | None:
    """Return the onsets that reach into an epoch; ``onsets`` in order."""
    after = np.searchsorted(onsets, others.onsets)
    distance = np.full(len(others.onsets), n_times)
    for neighbour in (after - 1, after):
        inside = (neighbour >= 0) & (neighbour < len(onsets))
        apart = np.abs(others.onsets[inside] - onsets[neighbour[inside]])
        distance[inside] = np.minimum(distance[inside], apart)
    near = distance < n_times
    if not near.any():
        return None
    known = None if others.predictors is None else others.predictors[near]
    return OtherOnsets(others.onsets[near], others.spans[near], known)
