"""Markers to events: one event is one trial, a key means one marker, and no name makes a bad stretch of an event."""

import numpy as np
import pytest

from hrcneuro.errors import ConfigError, DataError
from hrcneuro.sources.channels import look_for, misspelt
from hrcneuro.sources.events import select_events
from hrcneuro.sources.recording import Recording, markers_of

SFREQ = 250.0


def recording(onsets, events, spans=()) -> Recording:
    names = ["Fz", "Cz", "ECG"]
    return Recording(np.zeros((3, 10000)), names, ["eeg"] * 3, SFREQ, markers_of(onsets, events), spans=list(spans))


def select(onsets, events, event_map=(), **options):
    one = recording(onsets, events)
    return select_events(one, dict(event_map), least_gap_s=0.02, **options), one


def test_equal_markers_a_sample_or_less_apart_are_one_event():
    kept, one = select([1.0, 1.004, 2.0, 2.001, 3.0, 3.004], ["a", "a", "b", "b", "a", "b"])
    assert kept["onset_s"].tolist() == [1.0, 2.0, 3.0, 3.004]
    assert any("a × 1, b × 1: equal markers a sample or less apart" in w for w in one.warnings)
    assert any("one moment: a and b × 1" in w for w in one.warnings)


@pytest.mark.parametrize("jitter_s", [0.0, 5e-4])
def test_two_recordings_of_one_stream_are_one(jitter_s):
    rng = np.random.default_rng(0)
    onsets = 1 + np.arange(20)
    copies = onsets + 0.012 + rng.uniform(-jitter_s, jitter_s, 20)
    kept, one = select([*onsets, *copies], ["a", "b"] * 20)
    assert kept["onset_s"].tolist() == onsets.tolist()
    assert any("12 ms after an equal one: two recordings of one stream" in w for w in one.warnings)


def test_two_recordings_of_one_stream_may_be_further_apart_than_twins():
    onsets = 1 + 1.3 * np.arange(20)
    kept, one = select([*onsets, *(onsets + 0.06)], ["a", "b"] * 20)
    assert kept["onset_s"].tolist() == onsets.tolist()
    assert any("60 ms after an equal one" in w for w in one.warnings)
    assert len(select([*onsets, *(onsets + 0.06)], ["a", "b"] * 20, twins="keep")[0]) == 40
    assert len(select([1.0, 1.06], ["a", "a"])[0]) == 2


def test_a_key_that_says_the_kind_of_marker_means_no_other_kind():
    kept, _ = select([1.0, 2.0], ["Stimulus/S  1", "Comment/S1"], {"Stimulus/S1": "a"})
    assert kept["onset_s"].tolist() == [1.0]


def test_twins_are_refused_merged_or_kept():
    onsets, events = [1.0, 2.0, 2.015, 3.0], ["a", "b", "b", "a"]
    with pytest.raises(DataError, match=r"1 of 4 markers .* the first 'b' at 2\.015 s, 15\.0 ms after") as caught:
        select(onsets, events)
    assert "acquire.twins = 'merge'" in caught.value.cure
    assert len(select(onsets, events, twins="merge")[0]) == 3
    assert len(select(onsets, events, twins="keep")[0]) == 4


def test_ordinary_rapid_stimulation_is_left_alone():
    onsets = 1 + np.arange(200) / 40
    kept, one = select(onsets, ["click"] * 200)
    assert len(kept) == 200
    assert not one.warnings


@pytest.mark.parametrize("counts", [(20, 18), (18, 20)])
def test_a_short_key_never_means_a_response_whatever_the_counts(counts):
    names = ["Stimulus/1"] * counts[0] + ["Response/1"] * counts[1]
    kept, one = select(np.arange(len(names)), names, {"1": "a"})
    assert len(kept) == counts[0]
    assert "keys taken for markers: 1 = Stimulus/1" in one.notes
    with pytest.raises(ConfigError, match=r"'1' .did you mean 'Response/1'"):
        select([1.0, 2.0], ["Response/1"] * 2, {"1": "a"})


def test_a_key_that_fits_two_markers_is_refused_unless_one_is_exact():
    names = ["Stimulus/S  1", "Comment/S 1"]
    with pytest.raises(ConfigError, match="'S1' may be 'Comment/S 1' or 'Stimulus/S  1'"):
        select([1.0, 2.0], names, {"S1": "a"})
    kept, _ = select([1.0, 2.0, 3.0], [*names, "S1"], {"S1": "a"})
    assert kept["onset_s"].tolist() == [3.0]


def test_two_keys_that_mean_one_marker_are_refused():
    with pytest.raises(ConfigError, match="'1' = 'a' and 'Stimulus/1' = 'b' mean one marker, 'Stimulus/1'"):
        select([1.0], ["Stimulus/1"], {"1": "a", "Stimulus/1": "b"})


def test_a_marker_that_does_not_occur_is_told_and_no_obstacle():
    kept, one = select([1.0, 2.0], ["S 21", "S 23"], {"S 21": "hit", "S 22": "miss"})
    assert kept["event"].tolist() == ["hit"]
    assert one.warnings == ["markers of the map that do not occur: 'S 22' (did you mean 'S 23'?)"]


def test_a_stretch_is_bad_unless_the_map_names_it():
    spans = [(2.0, 1.0, "bad_choice"), (4.0, 1.5, "bad_ET")]
    one = recording([1.0], ["good_choice"], spans)
    kept = select_events(one, {"bad_choice": "bad", "good_choice": "good"})
    assert kept["event"].tolist() == ["good", "bad"]
    assert one.spans == spans[1:]
    assert any("taken for bad: bad_ET × 1 (1.5 s)" in w for w in one.warnings)


@pytest.mark.parametrize(
    ("name", "other", "same"),
    [
        ("ecg", "ECG", True), ("EXG 1", "EXG1", True), ("ECG1", "ECG", True), ("GRS", "GSR", True), ("Fzz", "Fz", True),
        ("VEOG", "HEOG", False), ("A1", "A11", False), ("AF7", "F7", False), ("P1", "P10", False), ("C3", "C4", False),
    ],
)  # fmt: skip
def test_what_is_a_misspelling_of_a_channel(name, other, same):
    assert misspelt(name, other) is misspelt(other, name) is same


def test_a_channel_that_a_subject_lacks_is_told_and_a_misspelt_one_refused():
    one = recording([1.0], ["a"])
    look_for(["GSR", "ECG"], one, "acquire.drop")
    assert one.warnings == ["acquire.drop names what the recording does not have: 'GSR'"]
    with pytest.raises(ConfigError, match=r"acquire\.drop .*'ecg' .did you mean 'ECG'") as caught:
        look_for(["ecg"], one, "acquire.drop")
    assert "[acquire.subjects.SUBJECT]" in caught.value.cure
