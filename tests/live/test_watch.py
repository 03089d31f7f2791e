"""What stands out of a stream: gaps, stalls, clocks set anew; and what does not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.live.watch import StreamWatch


def fed(stamps, *, sfreq=1000.0, chunk=10, stall_s=1.0):
    watch, events = StreamWatch(sfreq, stall_s=stall_s), []
    for at in range(0, len(stamps), chunk):
        piece = stamps[at : at + chunk]
        events += watch.feed(piece, piece[-1])
    return watch, events


def test_a_whole_stream_is_without_a_word():
    watch, events = fed(5 + np.arange(3000) / 1000)
    assert events == []
    assert (watch.count, watch.missing, watch.first, watch.last) == (3000, 0, 5.0, pytest.approx(7.999))


@settings(deadline=None)
@given(st.integers(0, 999), st.integers(1, 300), st.sampled_from([7, 10, 256]))
def test_every_missing_sample_is_counted_wherever_it_is(at, n, chunk):
    """Also within a chunk, between chunks, and before it is known how the stamps waver."""
    stamps = 5 + np.delete(np.arange(1500), np.s_[at + 1 : at + 1 + n]) / 1000
    watch, events = fed(stamps, chunk=chunk)
    assert [(e.kind, e.samples) for e in events] == [("gap", n)]
    assert events[0].stamp == pytest.approx(5 + at / 1000)
    assert watch.missing == n


def test_stamps_that_waver_between_chunks_are_no_gaps_and_a_lost_chunk_is_one():
    rng = np.random.default_rng(2)
    chunk, sfreq = 40, 1000.0
    n = 200
    begin = np.arange(n) * chunk / sfreq + 0.002 * rng.standard_normal(n)
    stamps = (begin[:, None] + np.arange(chunk) / sfreq).ravel()
    watch = StreamWatch(sfreq)
    events = [e for piece in stamps.reshape(n, chunk) for e in watch.feed(piece, piece[-1])]
    # Until it has seen how they waver, it may take a late chunk for a gap.
    assert [e for e in events if e.stamp > 0.6] == []
    lost = [e for e in watch.feed(stamps[-chunk:] + 3 * chunk / sfreq, stamps[-1] + 0.12) if e.kind == "gap"]
    assert lost[0].samples == pytest.approx(2 * chunk, abs=8)


@pytest.mark.parametrize("every", [4, 20, 100])
def test_however_often_samples_are_lost_it_is_never_taken_for_wavering(every):
    """A radio link that loses some of all packets is what a recorder must not get used to."""
    kept = np.arange(20000)[np.arange(20000) // 10 % every != 1]
    _, events = fed(5 + kept / 1000)
    assert sum(e.samples for e in events) == kept[-1] + 1 - len(kept)


def test_silence_is_told_once_and_its_end_too():
    watch = StreamWatch(100.0, stall_s=0.5)
    watch.feed(np.arange(100) / 100, 1.0)
    nothing = np.zeros(0)
    assert watch.feed(nothing, 1.4) == []
    (stall,) = watch.feed(nothing, 1.6)
    assert (stall.kind, stall.seconds, stall.stamp) == ("stall", pytest.approx(0.6), 0.99)
    assert watch.feed(nothing, 2.0) == []
    back, gap = watch.feed(3 + np.arange(10) / 100, 3.1)
    assert (back.kind, back.seconds) == ("back", pytest.approx(2.1))
    assert (gap.kind, gap.samples) == ("gap", 200)


@pytest.mark.parametrize("step", [-500.0, 7200.0, -0.5])
def test_a_clock_set_anew_is_no_gap(step):
    watch = StreamWatch(100.0)
    watch.feed(1000 + np.arange(200) / 100, 2.0)
    (event,) = watch.feed(1000 + step + 2 + np.arange(100) / 100, 3.0)
    assert event.kind == "clock"
    assert event.seconds == pytest.approx(step, abs=1.1)
    assert watch.missing == 0


@settings(deadline=None)
@given(st.integers(2, 40), st.integers(1, 6), st.sampled_from([1, 10, 37]))
def test_a_chunk_that_comes_behind_younger_ones_is_late_and_neither_lost_nor_another_clock(at, behind, pull):
    chunks = np.split(5 + np.arange(1000) / 1000, 100)
    chunks.insert(at + behind, chunks.pop(at))
    watch, events = StreamWatch(1000.0), []
    for piece in np.split(np.concatenate(chunks), np.arange(pull, 1000, pull)):
        events += watch.feed(piece, float(piece.max()))
    assert {one.kind for one in events} == {"gap", "late"}
    assert sum(one.samples for one in events if one.kind == "late") == 10
    assert (watch.missing, watch.count, watch.last) == (0, 1000, pytest.approx(5.999))


def test_a_clock_that_is_set_back_into_a_gap_and_goes_on_is_no_late_chunk():
    watch = StreamWatch(100.0)
    watch.feed(np.arange(100) / 100, 1.0)
    watch.feed(1.5 + np.arange(100) / 100, 2.5)
    # It runs on past the gap's end.
    (event,) = watch.feed(1.2 + np.arange(100) / 100, 3.5)
    assert event.kind == "clock"


def test_markers_may_come_when_they_like():
    watch = StreamWatch(0.0)
    assert watch.feed(np.array([1.0, 9.0]), 9.0) == []
    assert watch.feed(np.zeros(0), 900.0) == []
    assert watch.feed(np.array([3.0]), 901.0) == []
    assert watch.count == 3
