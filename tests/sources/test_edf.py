"""EDF and BDF: what the header announces, what lies between the records, and what Status says."""

from __future__ import annotations

from pathlib import Path

import mne
import numpy as np
import pytest
from edf_files import save_edf, tal

from hrcneuro.errors import DataError
from hrcneuro.sources.channels import shape
from hrcneuro.sources.events import select_events
from hrcneuro.sources.formats import read_recording

FS = 100
RECORDS = 6
REAL = Path(__file__).parents[2] / "../shared/data/recordings/edf_bdf"


@pytest.fixture
def uv():
    """Six records of one second: what each sample is tells where it lies."""
    return np.arange(RECORDS * FS).reshape(RECORDS, FS) / 10


def times(*seconds: float) -> list[str]:
    return [f"+{one:g}" for one in seconds]


def marked(recording) -> list[tuple[str, float]]:
    return [(row.event, round(row.onset_s, 6)) for row in recording.markers.itertuples()]


@pytest.mark.parametrize("name", ["d.edf", "d.bdf"])
def test_events_after_a_break_lie_on_the_sample_that_was_recorded_then(uv, tmp_path, name):
    lists = {
        0: tal("+0.5", "a") + tal("+7", "lost") + tal("+3", "edge of the gap"),
        3: tal("+10.25", "b") + tal("+12.99", "c"),
        5: tal("+13", "too late"),
    }
    path = save_edf(tmp_path / name, [("Cz", "uV", uv)], times=times(0, 1, 2, 10, 11, 12), lists=lists, kind="EDF+D")
    recording = read_recording(path)
    assert marked(recording) == [("a", 0.5), ("b", 3.25), ("c", 5.99)]
    # The sample under b is the one that was recorded at 10.25 s.
    np.testing.assert_allclose(recording.data[0, 325] * 1e6, uv[3, 25], atol=0.02)
    assert recording.breaks_s == [3.0]
    assert f"{name} is in 2 pieces, 7 s between them were not recorded: each is a break" in recording.notes
    (note,) = [one for one in recording.notes if "nothing was recorded" in one]
    assert note.startswith("3 markers lie where nothing was recorded and are left out")
    assert all(name in note for name in ("lost × 1", "edge of the gap × 1", "too late × 1"))


def test_a_gap_in_a_file_that_calls_itself_continuous_is_a_break_all_the_same(uv, tmp_path):
    path = save_edf(tmp_path / "c.edf", [("Cz", "uV", uv)], times=times(0, 1, 2, 3.5, 4.5, 5.5))
    recording = read_recording(path)
    assert recording.breaks_s == [3.0]
    assert any("though the header calls it continuous (EDF+C)" in note for note in recording.notes)


def test_records_that_overlap_are_refused(uv, tmp_path):
    path = save_edf(tmp_path / "o.edf", [("Cz", "uV", uv)], times=times(0, 1, 2, 2.5, 3.5, 4.5), kind="EDF+D")
    with pytest.raises(DataError, match=r"o\.edf: record 4 begins at 2\.5 s, before record 3 ends \(3 s\)"):
        read_recording(path)


def test_a_clock_that_runs_slow_moves_no_mark_and_is_no_break(uv, tmp_path):
    late = [i * 1.0009 for i in range(RECORDS)]
    path = save_edf(
        tmp_path / "s.edf", [("Cz", "uV", uv)], times=[f"+{t:.4f}" for t in late], lists={0: tal("+5.0545", "a")}
    )
    recording = read_recording(path)
    assert recording.breaks_s == []
    assert marked(recording) == [("a", 5.05)]


def test_times_count_from_the_first_record_which_may_start_at_a_fraction(uv, tmp_path):
    lists = {0: tal("+0.75", "a"), 1: tal("+2.25", "BAD_move", duration="0.5")}
    path = save_edf(
        tmp_path / "f.edf", [("Cz", "uV", uv)], times=times(0.25, 1.25, 2.25, 3.25, 4.25, 5.25), lists=lists
    )
    recording = read_recording(path)
    assert marked(recording) == [("a", 0.5)]
    assert recording.spans == [(2.0, 0.5, "BAD_move")]


def test_a_bad_stretch_over_a_gap_keeps_what_was_recorded_of_it(uv, tmp_path):
    path = save_edf(
        tmp_path / "b.edf", [("Cz", "uV", uv)], times=times(0, 1, 2, 10, 11, 12), kind="EDF+D",
        lists={2: tal("+2.5", "BAD_x", duration="8"), 0: tal("+4", "BAD_gone", duration="2")},
    )  # fmt: skip
    ((onset, duration, text),) = read_recording(path).spans
    assert (onset, round(duration, 6), text) == (2.5, 1.0, "BAD_x")


def test_both_annotation_signals_are_read_and_a_mark_on_two_channels_is_one(uv, tmp_path):
    path = save_edf(
        tmp_path / "two.edf", [("Cz", "uV", uv), ("Pz", "uV", uv)], times=times(*range(RECORDS)),
        lists={1: tal("+1.5", "spike@@Cz", "spike@@Pz")}, second={0: tal("+4", "b"), 3: tal("+3.5", "c@@else")},
    )  # fmt: skip
    assert marked(read_recording(path)) == [("spike", 1.5), ("c@@else", 3.5), ("b", 4.0)]


def test_annotations_that_are_not_utf8_are_read_and_noted(uv, tmp_path):
    path = save_edf(
        tmp_path / "l.edf", [("Cz", "uV", uv)], times=times(*range(RECORDS)),
        lists={0: tal("+0.5", "Öffnen".encode("cp1252")), 1: tal("+1.5", "schließen")},
    )  # fmt: skip
    recording = read_recording(path)
    assert marked(recording) == [("Öffnen", 0.5), ("schließen", 1.5)]
    assert "l.edf: annotations that are not UTF-8 are read as cp1252" in recording.notes


def test_rates_that_differ_are_brought_together_within_each_piece(tmp_path):
    """A step at the join of two pieces must not ring into either of them."""
    slow = np.repeat([[0.0], [0.0], [0.0], [300.0], [300.0], [300.0]], FS // 2, axis=1)
    fast = np.zeros((RECORDS, FS))
    path = save_edf(
        tmp_path / "m.edf", [("Cz", "uV", slow), ("EMG", "uV", fast)], times=times(0, 1, 2, 10, 11, 12), kind="EDF+D"
    )
    recording = read_recording(path)
    np.testing.assert_allclose(recording.data[0] * 1e6, np.repeat([0.0, 300.0], 3 * FS), atol=1e-6)
    assert "channels at 50 Hz, 100 Hz: all are brought to 100 Hz" in recording.notes
    assert not any("edge artifacts" in note for note in recording.notes)


@pytest.mark.parametrize("unit", ["uV", "\u00b5V", "uv", "UV", "microV"])
def test_a_microvolt_is_one_in_any_spelling(uv, tmp_path, unit):
    recording = read_recording(save_edf(tmp_path / "u.edf", [("Cz", unit, uv)]))
    np.testing.assert_allclose(recording.data[0] * 1e6, uv.ravel(), atol=1e-9)


def test_nanovolts_are_no_volts(uv, tmp_path):
    recording = read_recording(save_edf(tmp_path / "n.edf", [("Cz", "nV", uv)]))
    np.testing.assert_allclose(recording.data[0] * 1e9, uv.ravel(), atol=1e-9)


@pytest.mark.parametrize("ending", ["edf", "bdf"])
@pytest.mark.parametrize(
    ("announced", "message"),
    [
        (10, "truncated: its header announces 10 records of 1 s, the file holds 6: 4 s are missing"),
        (4, "too long: its header announces 4 records of 1 s, the file holds 6: 2 s more"),
        (0, "too long: its header announces 0 records"),
    ],
)
def test_a_file_that_does_not_hold_what_its_header_announces_is_refused(uv, tmp_path, ending, announced, message):
    path = save_edf(tmp_path / f"r.{ending}", [("Cz", "uV", uv)], announced=announced, kind="")
    with pytest.raises(DataError, match=message):
        read_recording(path)


@pytest.mark.parametrize(
    ("announced", "cut", "note", "records"),
    [
        (-1, 0, "was not closed by its recorder: it holds 6 records of 1 s", 6),
        (-1, 30, "holds 5 records of 1 s and 170 bytes of another, left out", 5),
        (6, 30, "announces 6 records of 1 s and holds 5 and 170 bytes of another: 5 are read", 5),
        (5, 0, "announces 5 records of 1 s and holds 6: 6 are read", 6),
        (6, 0, "", 6),
    ],
)
def test_less_than_a_record_more_or_less_is_noted(uv, tmp_path, announced, cut, note, records):
    path = save_edf(tmp_path / "r.edf", [("Cz", "uV", uv)], announced=announced, kind="")
    path.write_bytes(path.read_bytes()[: path.stat().st_size - cut])
    recording = read_recording(path)
    assert recording.duration_s == records
    assert [note in one for one in recording.notes] == ([True] if note else [])


def test_a_file_of_annotations_only_is_refused(tmp_path):
    path = save_edf(tmp_path / "h.edf", [("EDF Annotations", "", np.zeros((1, 20)))], record_s=0)
    with pytest.raises(DataError, match=r"h\.edf holds annotations and no signal"):
        read_recording(path)


@pytest.mark.parametrize("content", [b"", b"no header", b"0" * 600])
def test_what_is_no_edf_is_refused(tmp_path, content):
    (tmp_path / "x.edf").write_bytes(content)
    with pytest.raises(DataError, match=r"x\.edf does not begin with a header of EDF"):
        read_recording(tmp_path / "x.edf")


def test_bdf_under_the_ending_of_edf_is_refused(uv, tmp_path):
    save_edf(tmp_path / "x.bdf", [("Cz", "uV", uv)], biosemi=True, kind="24BIT").rename(tmp_path / "x.edf")
    with pytest.raises(DataError, match=r"x\.edf is BDF by its header"):
        read_recording(tmp_path / "x.edf")


def status(codes: list[tuple[int, int, int]], base: int) -> np.ndarray:
    words = np.full(RECORDS * FS, base)
    for start, stop, code in codes:
        words[start:stop] |= code
    return words.reshape(RECORDS, FS)


def test_biosemis_status_tells_triggers_pauses_and_an_open_reference(uv, tmp_path):
    cms, epoch = 1 << 20, 1 << 16
    words = status([(50, 55, 7), (350, 355, 300), (0, 1, epoch), (300, 301, epoch)], cms | 1 << 23)
    words.ravel()[400:450] &= ~cms
    path = save_edf(tmp_path / "b.bdf", [("Cz", "uV", uv), ("Status", "Boolean", words)], biosemi=True, kind="24BIT")
    recording = read_recording(path)
    codes = recording.data[recording.ch_names.index("Status")]
    assert np.unique(codes).tolist() == [0, 7, 300]
    assert np.flatnonzero(codes == 300).tolist() == [350, 351, 352, 353, 354]
    assert recording.breaks_s == [3.0]
    assert recording.spans == [(4.0, 0.5, "BAD_CMS")]
    assert any("Status marks 1 pauses" in note for note in recording.notes)
    assert any("CMS was out of range" in note for note in recording.notes)
    assert not any("battery" in note for note in recording.notes)


def test_a_low_battery_and_a_reference_that_never_closed_are_said(uv, tmp_path):
    path = save_edf(
        tmp_path / "b.bdf", [("Cz", "uV", uv), ("Status", "Boolean", status([(0, 300, 1 << 22)], 1 << 23))],
        biosemi=True, kind="24BIT",
    )  # fmt: skip
    recording = read_recording(path)
    assert any("battery was low in 50%" in note for note in recording.notes)
    assert any("CMS was never in range" in note for note in recording.notes)
    assert recording.spans == []


def test_a_trigger_channel_of_another_rate_keeps_its_codes(tmp_path):
    """Resampled as a signal, a code would ring."""
    codes = np.zeros((RECORDS, 50))
    codes[2, 10:20] = 27
    signals = [("Cz", "uV", np.zeros((RECORDS, FS))), ("Event marker", "uV", codes)]
    recording = read_recording(save_edf(tmp_path / "t.edf", signals))
    assert recording.ch_types == ["eeg", "stim"]
    np.testing.assert_array_equal(recording.data[1], np.repeat(codes.ravel(), 2))


def test_a_status_channel_of_another_maker_is_not_read_as_biosemis(uv, tmp_path):
    path = save_edf(
        tmp_path / "b.bdf", [("Cz", "uV", uv), ("Status", "", status([(50, 55, 7)], 0))], biosemi=True, kind="BDF"
    )
    recording = read_recording(path)
    assert (recording.spans, recording.breaks_s, recording.notes) == ([], [], [])
    assert np.unique(recording.data[1]).tolist() == [0, 7]


@pytest.mark.parametrize(
    "name",
    [
        "mne_testing/test_utf8_annotations.edf", "mne_testing/subsecond_starttime.edf", "mne_testing/chtypes_edf.edf",
        "mne/duplicate_channel_labels.edf", "mne/test_uneven_samp.edf", "eeglab/test.bdf",
    ],
)  # fmt: skip
def test_real_files_against_mnes_own_reading(name):
    path = REAL / name
    if not path.is_file():
        pytest.skip("the recordings of many makers are not here (shared/data)")
    recording = read_recording(path)
    reader = mne.io.read_raw_bdf if path.suffix == ".bdf" else mne.io.read_raw_edf
    raw = reader(path, preload=True, verbose="error")
    np.testing.assert_array_equal(recording.data[recording.picks("eeg")], raw.get_data("eeg"))
    theirs = [(one["description"].strip(), round(one["onset"], 6)) for one in raw.annotations]
    assert sorted(marked(recording)) == sorted(theirs)


def test_a_channel_in_another_unit_than_volts_is_no_eeg(uv, tmp_path):
    signals = [("X1", "uV", uv), ("X2", "cmH2O", uv), ("X3", "dB", uv), ("X4", "", uv)]
    recording = read_recording(save_edf(tmp_path / "u.edf", signals, times=times(*range(RECORDS))))
    shape(recording, rename={}, types={}, drop=(), bads=(), montage="none", unit="")
    assert recording.ch_types == ["eeg", "misc", "misc", "eeg"]
    assert "taken for MISC, not EEG, by the unit cmH2O: X2" in recording.notes


@pytest.mark.parametrize("mapped", [False, True])
def test_a_break_that_only_a_name_tells_is_an_event_where_the_map_names_it(uv, tmp_path, mapped):
    lists = {1: tal("+1.5", "boundary"), 2: tal("+2.5", "within"), 4: tal("+4.5", "boundary")}
    path = save_edf(tmp_path / "n.edf", [("Cz", "uV", uv)], times=times(*range(RECORDS)), lists=lists)
    recording = read_recording(path)
    events = select_events(recording, {"within": "w"} | ({"boundary": "b"} if mapped else {}))
    assert events["event"].tolist() == (["b", "w", "b"] if mapped else ["w"])
    assert recording.breaks_s == ([] if mapped else [1.5, 4.5])
    assert any("taken for breaks of the recording: boundary × 2" in one for one in recording.warnings) != mapped


def test_a_recording_with_no_more_than_breaks_says_so(uv, tmp_path):
    lists = {1: tal("+1.5", "boundary")}
    recording = read_recording(save_edf(tmp_path / "o.edf", [("Cz", "uV", uv)], times=times(*range(6)), lists=lists))
    with pytest.raises(DataError, match="only breaks: boundary × 1"):
        select_events(recording, {})
