"""Recordings as tables: columns by name, unit and rate by the study's options, gaps and markers."""

from __future__ import annotations

import numpy as np
import pytest

from hrcneuro.errors import ConfigError, DataError
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.recording import Recording, check_signals, markers_of
from hrcneuro.stages import acquire

SFREQ = 250.0
UV = np.random.default_rng(0).normal(0, 10, (2, 1000)).round(3)
HOW = {"columns": ("TP9", "AF7"), "unit": "uV", "table_rate": SFREQ}


def write(path, *, times=None, marks=None, head="", separator=",", uv=UV, names=("t", "TP9", "AF7", "Mark")):
    times = np.arange(uv.shape[1]) / SFREQ if times is None else times
    marks = [0] * uv.shape[1] if marks is None else marks
    rows = [separator.join([f"{at:.6f}", *(f"{v:.3f}" for v in uv[:, i]), str(marks[i])]) for i, at in enumerate(times)]
    path.write_text("\n".join([*head.splitlines(), separator.join(names), *rows]) + "\n")
    return path


@pytest.mark.parametrize("separator", [",", ";", "\t", ", "])
@pytest.mark.parametrize("head", ["", "%OpenBCI Raw EXG Data\n%Sample Rate = 250 Hz\n"])
def test_columns_unit_and_rate_are_the_study_s(tmp_path, separator, head):
    recording = read_recording(write(tmp_path / "r.csv", separator=separator, head=head), **HOW)
    assert (recording.ch_names, recording.ch_types, recording.sfreq) == (["TP9", "AF7"], ["eeg"] * 2, SFREQ)
    np.testing.assert_allclose(recording.data, UV)  # volts only once the study's unit is applied
    assert recording.markers.empty


def test_numbers_in_the_marker_column_are_a_trigger_channel_and_texts_are_markers(tmp_path):
    codes = [0] * 1000
    codes[100], codes[400] = 1, 2
    recording = read_recording(write(tmp_path / "c.csv", marks=codes), **HOW, marker_column="Mark")
    assert recording.ch_types == ["eeg", "eeg", "stim"]
    np.testing.assert_array_equal(recording.data[2], codes)
    texts = [{100: "go", 400: "stop"}.get(i, "") for i in range(1000)]
    recording = read_recording(write(tmp_path / "t.csv", marks=texts), **HOW, marker_column="Mark")
    assert recording.markers.to_numpy().tolist() == [[0.4, "go"], [1.6, "stop"]]


@pytest.mark.parametrize("nothing", ["NaN", "n/a", "NA"])
def test_a_cell_that_says_nothing_is_no_marker(tmp_path, nothing):
    words = [{100: "go"}.get(i, nothing) for i in range(1000)]
    recording = read_recording(write(tmp_path / "t.csv", marks=words), **HOW, marker_column="Mark")
    assert recording.markers.to_numpy().tolist() == [[0.4, "go"]]
    codes = [{100: 1}.get(i, nothing) for i in range(1000)]
    recording = read_recording(write(tmp_path / "c.csv", marks=codes), **HOW, marker_column="Mark")
    assert recording.ch_types == ["eeg", "eeg", "stim"]
    assert recording.data[2].sum() == recording.data[2][100] == 1


def test_a_gap_in_the_times_is_a_break_and_the_rate_may_be_the_one_of_the_clock(tmp_path):
    times = np.arange(1000) / SFREQ + np.repeat([0, 1.5], 500)
    path = write(tmp_path / "g.csv", times=times)
    recording = read_recording(path, **HOW, time_column="t")
    assert recording.breaks_s == [2.0]
    assert any("gaps without rows: 1, 1.50 s" in note for note in recording.notes)
    measured = read_recording(path, **{**HOW, "table_rate": 0.0}, time_column="t")
    assert measured.sfreq == pytest.approx(SFREQ, rel=1e-4)


def test_a_rate_that_the_clock_contradicts_is_refused(tmp_path):
    path = write(tmp_path / "r.csv")
    with pytest.raises(DataError, match=r"table_rate is 256 Hz, the rows came at 250\.000 Hz, 2\.3 % off"):
        read_recording(path, **{**HOW, "table_rate": 256.0}, time_column="t")
    assert read_recording(path, **{**HOW, "table_rate": 256.0}, time_column="t", rate_tolerance=0.03).sfreq == 256


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        ({"columns": ()}, ConfigError, "acquire.columns is empty: .* They are t, TP9, AF7, Mark"),
        ({"columns": ("TP9", "AF77")}, ConfigError, r"no column 'AF77' \(did you mean 'AF7'"),
        ({"unit": ""}, ConfigError, "states no unit, and acquire.unit is empty"),
        ({"table_rate": 0.0}, ConfigError, "states no sampling rate"),
        ({"marker_column": "Marker"}, ConfigError, r"no column 'Marker' \(did you mean 'Mark'"),
    ],
)
def test_what_a_table_does_not_say_must_be_set(tmp_path, options, kind, message):
    with pytest.raises(kind, match=message) as caught:
        read_recording(write(tmp_path / "r.csv"), **{**HOW, **options})
    assert caught.value.cure


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("1.0,2.0\n3.0,4.0\n", "does not name the columns"),
        ("TP9,TP9\n1,2\n", "does not name the columns, each by itself"),
        ("TP9,AF7\n1,2\n", "holds 1 samples"),
        ("TP9,AF7\n1,2\n3,4\n5,x7\n", "column 'AF7' has 1 cells that are no numbers, the first 'x7' in sample 2"),
        ("TP9,AF7\n1,2\n3,4,5,6\n", "cannot be read as a table"),
        ("TP9,AF7\n1,2,3\n4,5,6\n", "cannot be read as a table"),
    ],
)
def test_a_table_that_is_none(tmp_path, text, message):
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=message) as caught:
        read_recording(path, **HOW)
    assert caught.value.cure


def test_an_empty_cell_is_no_number_and_no_zero(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("TP9,AF7\n1,2\n,4\n5,nan\n")
    assert np.isnan(read_recording(path, **HOW).data).tolist() == [[False, True, False], [False, False, True]]


def test_a_last_row_that_was_cut_is_left_out_with_a_word(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("TP9,AF7\n1,2\n3,4\n5")
    recording = read_recording(path, **HOW)
    assert recording.data.tolist() == [[1, 3], [2, 4]]
    assert recording.notes == ["x.csv ends within a row, which is left out"]


def test_times_that_go_backwards_are_refused(tmp_path):
    with pytest.raises(DataError, match="do not go forward"):
        read_recording(write(tmp_path / "b.csv", times=-np.arange(1000) / SFREQ), **HOW, time_column="t")


@pytest.mark.parametrize(("factor", "hz"), [(1e3, r"0\.25"), (1e6, r"0\.00025"), (1 / 900, r"2\.25e[+]05")])
def test_a_rate_that_no_eeg_has_is_refused_by_whatever_it_came(tmp_path, factor, hz):
    path = write(tmp_path / "r.csv", times=factor * np.arange(1000) / SFREQ)
    with pytest.raises(DataError, match=rf"by 't' its rows came at {hz} Hz; allowed: 32 to 100000 Hz") as caught:
        read_recording(path, **{**HOW, "table_rate": 0.0}, time_column="t")
    assert "must be in s" in caught.value.cure
    assert "acquire.table_rate" in caught.value.cure
    slow = Recording(1e-6 * UV, ["Cz", "Pz"], ["eeg", "eeg"], 31.9, markers_of([], []))
    with pytest.raises(DataError, match=r"sampling rate is 31\.9 Hz, which no EEG has; allowed: 32"):
        check_signals(slow)


def test_a_table_rate_that_no_eeg_has_is_a_mistake():
    config = dict(source="file", path="{subject}.csv", columns=("A",), unit="uV")
    assert not acquire.check(acquire.Config(**config, table_rate=32.0))
    assert ["table_rate = 0.25 Hz" in one for one in acquire.check(acquire.Config(**config, table_rate=0.25))] == [True]


@pytest.mark.parametrize("rate", [0.0, SFREQ])
def test_a_clock_that_starts_again_is_a_break_and_no_gap_of_less_than_nothing(tmp_path, rate):
    times = np.concatenate([np.arange(600), np.arange(400)]) / SFREQ
    times[800:] += 1.5
    recording = read_recording(write(tmp_path / "two.csv", times=times), **{**HOW, "table_rate": rate}, time_column="t")
    assert recording.breaks_s == pytest.approx([2.4, 3.2])
    assert recording.sfreq == pytest.approx(SFREQ, rel=1e-4)
    again = [note for note in recording.notes if "clock" in note]
    assert [note.partition(":")[0] for note in again] == ["the clock starts again at row 601 (2.40 s, then 0.00 s)"]
    assert ["gaps without rows: 1, 1.50 s in all" in note for note in recording.notes if "gaps" in note] == [True]
    np.testing.assert_allclose(recording.data, UV)


def test_a_table_of_many_short_takes_has_its_rate_and_a_break_before_each(tmp_path):
    # As many rows as the middle of long stretches is taken over, so that across takes no time goes by.
    path = write(tmp_path / "takes.csv", times=np.tile(np.arange(50) / SFREQ, 20))
    recording = read_recording(path, **{**HOW, "table_rate": 0.0}, time_column="t")
    assert recording.sfreq == pytest.approx(SFREQ, rel=1e-4)
    assert recording.breaks_s == pytest.approx(np.arange(50, 1000, 50) / SFREQ)
    assert any("… (19)" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"columns": ("TP9", "TP9")}, r"acquire\.columns names twice the column 'TP9'"),
        ({"marker_column": "AF7"}, r"acquire\.columns and acquire\.marker_column name the column 'AF7'"),
        ({"time_column": "TP9"}, r"acquire\.columns and acquire\.time_column name the column 'TP9'"),
        ({"time_column": "t", "marker_column": "t"}, r"time_column and acquire\.marker_column name the column 't'"),
    ],
)
def test_a_column_is_one_thing(tmp_path, options, message):
    with pytest.raises(ConfigError, match=message) as caught:
        read_recording(write(tmp_path / "r.csv"), **{**HOW, **options})
    assert "channel_map" not in str(caught.value)
    assert caught.value.cure
