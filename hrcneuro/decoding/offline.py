"""A recording that goes through a frozen decoder as a stream does, chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from hrcneuro.decoding.frozen import FrozenDecoder
from hrcneuro.eeg.causal import CausalStream, State


def epochs(
    decoder: FrozenDecoder, chunks: Iterable[np.ndarray], zeros: np.ndarray, *, breaks: Sequence[int] = ()
) -> Iterator[tuple[int, np.ndarray | State]]:
    """Yield each epoch as soon as its last sample is there: which of ``zeros`` it is, and its filtered samples.

    In the place of samples stands why there are none: ``BROKEN`` where samples are missing in it or are no numbers,
    ``GONE`` where it begins before the recording, ``COMING`` where it ends after it.

    Args:
        decoder: Says how long an epoch is, and has the filter.
        chunks: ndarray, shape (n_channels, n_times), µV, one after the other, of any lengths.
        zeros: ndarray, shape (n_epochs,): where each epoch begins, in samples from the first one, with fractions.
        breaks: Samples before which others are missing.
    """
    firsts = np.array([decoder.first(zero) for zero in zeros], int)
    waiting = sorted(range(len(firsts)), key=lambda i: firsts[i], reverse=True)
    edges = sorted(set(breaks), reverse=True)
    most = max(int(decoder.sfreq), 1)  # an epoch that is complete after a push must be there still
    stream = decoder.stream(kept_s=most / decoder.sfreq)
    for chunk in chunks:
        for piece in _split(chunk, stream.end, edges, most):
            if piece is None:
                stream.broken()
                continue
            stream.push(piece)
            while waiting and firsts[waiting[-1]] + decoder.n_times <= stream.end:
                i = waiting.pop()
                yield i, _cut(stream, int(firsts[i]), decoder.n_times)
    for i in reversed(waiting):
        yield i, State.GONE if firsts[i] < 0 else State.COMING


def _split(chunk: np.ndarray, start: int, edges: list[int], most: int) -> Iterator[np.ndarray | None]:
    """Yield pieces of a chunk, none longer than ``most`` samples, and None at each break.

    The edges that were passed are taken off the list, which is in falling order.
    """
    stop, done = start + chunk.shape[1], start
    while done < stop:
        if edges and edges[-1] <= done:
            edges.pop()
            yield None
            continue
        end = min(stop, done + most, edges[-1] if edges else stop)
        yield chunk[:, done - start : end - start]
        done = end


def _cut(stream: CausalStream, first: int, length: int) -> np.ndarray | State:
    state = stream.state(first, length)
    return stream.cut(first, length) if state is State.COMPLETE else state
