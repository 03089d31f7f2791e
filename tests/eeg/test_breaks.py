import numpy as np
import pytest

from hrcneuro.eeg import breaks


@pytest.mark.parametrize("text", ["boundary", "Boundary", "BAD boundary", "EDGE boundary", "boundary, 12"])
def test_names_of_discontinuities(text):
    assert breaks.is_break(text)


@pytest.mark.parametrize("text", ["move", "BAD muscle", "edge", "square"])
def test_names_of_other_annotations(text):
    assert not breaks.is_break(text)


def test_a_discontinuity_between_two_samples_belongs_to_the_later_even_in_single_precision():
    sfreq, halves = 1000.0, np.array([0.5, 99.5, 1_000_000.5, 2_500_001.5])
    stored = (halves / sfreq).astype(np.float32).astype(float)
    expected = [int(h + 0.5) for h in halves]
    assert breaks.borders(stored, ["boundary"] * 4, sfreq) == expected
    whole = np.array([100, 2_000_000, 2_600_001])
    stored = (whole / sfreq).astype(np.float32).astype(float)
    assert breaks.borders(stored, ["EDGE boundary"] * 3, sfreq) == whole.tolist()


def test_borders_are_ascending_and_single():
    onsets, texts = [2.0, 1.0, 1.0, 0.5], ["boundary", "BAD boundary", "EDGE boundary", "move"]
    assert breaks.borders(onsets, texts, 100) == [100, 200]


def test_marked_stretches_are_bad_annotations_with_a_length():
    onsets, durations = [1.0, 2.0, 3.0, 4.0], [0.5, 0.0, 1.0, 1.0]
    texts = ["BAD muscle", "bad point", "move", "BAD boundary"]
    assert breaks.marked(onsets, durations, texts, 100) == [(100, 150)]


def test_segments_cover_the_recording_and_ignore_borders_outside():
    assert breaks.segments([50, 10, 10, 0, -3, 100, 120], 100) == [(0, 10), (10, 50), (50, 100)]
    assert breaks.segments([], 7) == [(0, 7)]
    assert breaks.segments([3], 0) == []


@pytest.mark.parametrize("event", ["bad_choice", "EDGE_left", "boundary crossed", "badminton"])
def test_an_event_s_annotation_is_taken_for_nothing_else(event):
    mark = breaks.event_mark(event)
    assert event in mark
    assert not breaks.is_break(mark)
    assert breaks.marked([1.0], [2.0], [mark], 100.0) == []


def test_an_ordinary_event_keeps_its_name():
    assert breaks.event_mark("good_choice") == "good_choice"
