"""A stream filtered chunk by chunk: the same bits whatever the chunks, breaks kept apart, epochs when whole."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.eeg import filters
from hrcneuro.eeg.causal import CausalChain, CausalStream, EpochError, State, design, nearest
from hrcneuro.eeg.refusals import BandError

N = 2500
DESIGN = design(1000, 0.1, 40)


def signal(seed, n_channels=4, n=N):
    rng = np.random.default_rng(seed)
    return rng.normal(0, 20, (n_channels, n)).cumsum(axis=1).astype(np.float32) + 3000


def pushed(x, chunks, *, breaks=(), **stream):
    """Push a recording in chunks of these lengths, over and over; break it before the samples ``breaks``."""
    one = CausalStream(DESIGN, len(x), **{"kept": x.shape[1], **stream})
    at, turn = 0, 0
    while at < x.shape[1]:
        if at in breaks:
            one.broken()
        stop = min([at + chunks[turn % len(chunks)], x.shape[1], *(b for b in breaks if b > at)])
        one.push(x[:, at:stop])
        at, turn = stop, turn + 1
    return one


@pytest.mark.parametrize("length", [1, 7, 10, 40, 1000])
def test_chunks_of_any_length_give_the_bits_of_one_piece(length):
    x = signal(1)
    whole = filters.CausalFilter(1000, 0.1, 40).apply(x.astype(float))
    np.testing.assert_array_equal(pushed(x, [length]).cut(0, N), whole)


@settings(deadline=None, max_examples=25)
@given(
    st.lists(st.integers(1, 600), min_size=1, max_size=6),
    st.lists(st.integers(1, N - 1), max_size=3),
    st.lists(st.tuples(st.integers(0, 3), st.integers(0, N - 1)), max_size=3),
    st.integers(0, 99),
)
def test_breaks_and_samples_that_are_no_numbers_change_nothing_of_that(chunks, breaks, holes, seed):
    x = signal(seed)
    for channel, at in holes:
        x[channel, at] = np.nan if seed % 2 else np.inf
    one, other = pushed(x, [N], breaks=breaks), pushed(x, chunks, breaks=breaks)
    np.testing.assert_array_equal(one._last, other._last)
    bad = sorted({at for _, at in holes})
    assert np.flatnonzero(np.isnan(one._last).any(axis=0)).tolist() == bad
    # Each stretch is what it would be without the others.
    edges = sorted({0, N, *breaks, *bad, *(at + 1 for at in bad)})
    for start, stop in itertools.pairwise(edges):
        if start not in bad:
            alone = CausalChain(DESIGN).apply(x[:, start:stop].astype(float))
            np.testing.assert_array_equal(one._last[:, start:stop], alone)


def test_an_offset_does_not_ring_and_a_broken_electrode_harms_no_other():
    offset = np.full((3, 500), 1e5)
    one = CausalStream(DESIGN, 3, kept=500, ignored=[1])
    offset[1] = np.nan
    one.push(offset)
    # What is left is the rounding of double precision on 1e5.
    assert np.abs(one.cut(0, 500)).max() < 1e-6
    assert (one.cut(0, 500)[1] == 0).all()


def test_an_epoch_is_whole_when_its_last_sample_is_there_and_gone_when_the_buffer_has_moved_on():
    x = signal(3)
    one = CausalStream(DESIGN, 4, kept=300)
    one.push(x[:, :250])
    assert one.state(100, 150) is State.COMPLETE
    assert one.state(101, 150) is State.COMING
    with pytest.raises(EpochError, match="of samples 101 to 250 is coming; the stream has received 250 samples"):
        one.cut(101, 150)
    one.push(x[:, 250:500])
    assert one.state(199, 150) is State.GONE
    assert one.state(200, 150) is State.COMPLETE
    assert one.state(-1, 150) is State.GONE
    whole = pushed(x[:, :500], [500])
    np.testing.assert_array_equal(one.cut(200, 300), whole.cut(200, 300))
    one.push(x[:, 500:])  # longer than what is kept
    np.testing.assert_array_equal(one.cut(N - 300, 300), pushed(x, [N]).cut(N - 300, 300))


def test_an_epoch_may_begin_at_a_break_and_not_contain_one():
    one = pushed(signal(4, n=600), [50], breaks=[300])
    assert one.state(300, 100) is State.COMPLETE
    assert one.state(200, 100) is State.COMPLETE
    assert one.state(201, 100) is State.BROKEN
    assert one.state(299, 100) is State.BROKEN


def test_an_epoch_with_samples_that_are_no_numbers_is_broken_for_as_long_as_it_holds_them():
    x = signal(6, n=900)
    x[2, 300:350] = np.nan
    x[0, 600] = np.inf
    for chunks in ([900], [7]):
        one = pushed(x, chunks)
        for first in range(0, 800):
            bad = (first < 350 and first + 100 > 300) or first <= 600 < first + 100
            assert one.state(first, 100) is (State.BROKEN if bad else State.COMPLETE)
        assert np.isfinite(one.cut(350, 250)).all()
    one = CausalStream(DESIGN, 4, kept=200)
    one.push(x[:, :340])
    assert one.state(310, 100) is State.BROKEN
    one.push(x[:, 340:700])
    assert one.state(500, 100) is State.COMPLETE


def test_epochs_are_copies():
    one = pushed(signal(5, n=100), [10])
    one.cut(0, 50)[:] = 0
    assert one.cut(0, 50).any()


def test_what_does_not_fit_is_refused():
    with pytest.raises(BandError, match=r"0\.1–600 Hz does not fit a sampling rate of 1000 Hz"):
        design(1000, 0.1, 600)
    with pytest.raises(ValueError, match=r"shape \(3, 10\); the stream has 4 channels"):
        CausalStream(DESIGN, 4, kept=10).push(np.zeros((3, 10)))


@given(st.integers(0, 10**7), st.floats(-0.499, 0.499))
def test_an_epoch_begins_at_the_sample_nearest_to_its_zero(sample, fraction):
    assert nearest(sample + fraction) == sample
    assert nearest(sample + 0.5) == sample + 1
