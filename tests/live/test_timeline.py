"""Moments among samples: the same place whatever the chunks and the samples' numbers, gaps and edges told apart."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.live.timeline import NOT_FINITE, RAILED, Timeline

SFREQ = 250.0


def filled(stamps, codes=None, *, chunks=(10,), kept_s=4.0, before=0, broken=()):
    """Return a timeline that took samples in chunks of these lengths in turn, after ``before`` others."""
    line = Timeline(SFREQ, kept_s=kept_s)
    for at in range(0, before, 50):
        line.add(np.arange(at, at + 50) / SFREQ - 1e5, None, np.zeros(50, np.uint8), 0.0)
    if before:
        line.broken()
    at, turn = 0, 0
    while at < len(stamps):
        stop = min([at + chunks[turn % len(chunks)], len(stamps), *(one for one in broken if one > at)])
        if at in broken:
            line.broken()
        part = slice(at, stop)
        marks = np.zeros(stop - at, np.uint8)
        line.add(stamps[part], None if codes is None else codes[part], marks, float(at))
        at, turn = stop, turn + 1
    return line


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.integers(1, 300), min_size=1, max_size=5),
    st.integers(0, 40).map(lambda n: 50 * n),
    st.floats(0, 0.004),
    st.integers(0, 2**32 - 1),
)
def test_a_place_depends_on_the_samples_alone(chunks, before, waver, seed):
    rng = np.random.default_rng(seed)
    stamps = 50.0 + np.sort(np.arange(600) / SFREQ + rng.uniform(0, waver, 600))
    codes = (rng.random(600) < 0.02).astype(float)
    moments = rng.uniform(50.1, 52.3, 5)
    one, other = filled(stamps, codes), filled(stamps, codes, chunks=chunks, before=before)
    for moment in moments:
        place, shifted = one.place(moment), other.place(moment)
        assert place is not None
        assert shifted == pytest.approx(place + before, abs=1e-6)
        # A stamp wavers by up to a sample; the place among a second of them by less.
        assert place == pytest.approx((moment - 50.0) * SFREQ, abs=waver * SFREQ + 0.01)
        edge, its = one.edge(place, 25.0), other.edge(place + before, 25.0)
        assert (edge is None) is (its is None)
        if edge is not None:
            assert its == edge + before
            assert abs(edge - place) <= 25
            assert codes[edge] == 1
            assert codes[edge - 1] == 0


def test_a_moment_in_a_gap_or_before_or_after_all_samples_has_no_place():
    stamps = np.concatenate([np.arange(500), np.arange(700, 1200)]) / SFREQ
    line = filled(stamps, broken=(500,))
    assert line.place(1.0) == pytest.approx(250)
    assert line.place(3.2) == pytest.approx(600)
    assert line.place(2.4) is None
    assert line.place(-0.1) is None
    assert line.place(4.9) is None
    assert not line.passed(4.9)
    assert line.passed(4.7)
    assert not line.forgotten(0.0)


def test_what_is_older_than_is_kept_is_forgotten_and_the_rest_is_exact():
    stamps = np.arange(10_000) / SFREQ
    line = filled(stamps, kept_s=4.0)
    assert line.forgotten(20.0)
    assert line.place(37.0) == pytest.approx(37.0 * SFREQ)
    assert line.with_stamp(float(stamps[9500])) == 9500
    assert line.stamp(9500) == stamps[9500]
    assert line.pulled(9500) == 9500.0
    assert line.with_stamp(37.0001) is None


def test_marks_of_an_epoch_come_together():
    line = Timeline(SFREQ, kept_s=4.0)
    marks = np.zeros(100, np.uint8)
    marks[10], marks[40] = RAILED, NOT_FINITE
    line.add(np.arange(100) / SFREQ, None, marks, 0.0)
    assert line.marked(0, 10) == 0
    assert line.marked(5, 10) == RAILED
    assert line.marked(5, 500) == RAILED | NOT_FINITE
    assert line.marked(41, 59) == 0


def test_a_code_that_changes_into_another_is_an_edge_and_one_that_falls_is_none():
    codes = np.array([0, 0, 1, 1, 2, 2, 0, 0, 1, np.nan, 0, 0], float)
    line = filled(np.arange(12) / SFREQ, codes, chunks=(5,))
    assert [k for k in range(12) if line.edge(k, 0.0) == k] == [2, 4, 8]
