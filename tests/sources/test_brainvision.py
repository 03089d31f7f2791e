"""BrainVision files as recorders, exports and people leave them."""

from __future__ import annotations

import unicodedata
from pathlib import Path

import mne
import numpy as np
import pytest

from hrcneuro.errors import DataError
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.formats.companions import companions
from hrcneuro.stages import acquire

SFREQ = 250
CUT_OFF = {"Analyzer_nV_Export.vhdr": "announces 64 samples, its data file holds 2", "testv2.vhdr": "not there"}
REAL = Path(__file__).parents[2] / "../shared/data/recordings/brainvision"


def write(
    folder: Path,
    stem: str = "rec",
    *,
    samples: int = 1000,
    rows: list[str] | None = None,
    marks: list[str] | None = None,
    common: dict[str, str] | None = None,
    more: str = "",
    encoding: str = "utf-8",
    scale_uv: float = 0.1,
) -> Path:
    """Write three channels of 10 µV noise as INT_16, and their header and markers."""
    rows = ["Fz,,0.1,µV", "Cz,,0.1,µV", "Pz,,0.1,µV"] if rows is None else rows
    marks = ["New Segment,,1,1,0,20200101000000000000", "Stimulus,S  1,251,1,0"] if marks is None else marks
    keys = {
        "Codepage": "UTF-8", "DataFile": f"{stem}.eeg", "MarkerFile": f"{stem}.vmrk", "DataFormat": "BINARY",
        "DataOrientation": "MULTIPLEXED", "NumberOfChannels": str(len(rows)), "SamplingInterval": "4000",
    } | (common or {})  # fmt: skip
    volts = noise_uv(len(rows), samples)
    (folder / f"{stem}.eeg").write_bytes(np.round(volts / scale_uv).astype("<i2").T.tobytes())
    text = ["Brain Vision Data Exchange Marker File, Version 1.0", "[Common Infos]", f"DataFile={stem}.eeg"]
    text += [f"Codepage={keys['Codepage']}", "[Marker Infos]", *(f"Mk{i}={m}" for i, m in enumerate(marks, start=1))]
    (folder / f"{stem}.vmrk").write_bytes("\r\n".join([*text, ""]).encode(encoding))
    text = ["Brain Vision Data Exchange Header File Version 1.0", "[Common Infos]"]
    text += [f"{key}={value}" for key, value in keys.items() if value != "absent"]
    text += ["[Binary Infos]", "BinaryFormat=INT_16", "[Channel Infos]"]
    text += [f"Ch{i}={row}" for i, row in enumerate(rows, start=1)]
    path = folder / f"{stem}.vhdr"
    path.write_bytes("\r\n".join([*text, more, ""]).encode(encoding))
    return path


def noise_uv(channels: int, samples: int) -> np.ndarray:
    return np.random.default_rng(3).normal(0, 10, (channels, samples))


@pytest.mark.parametrize("unit", ["µV", "μV", "uV", "", "microvolt", "UV"])
def test_a_microvolt_in_any_spelling(tmp_path, unit):
    recording = read_recording(write(tmp_path, rows=[f"Fz,,0.1,{unit}", "Cz,,0.1,µV"]))
    assert recording.ch_types == ["eeg", "eeg"]
    assert recording.units == ["uV", "uV"]
    np.testing.assert_allclose(recording.data * 1e6, noise_uv(2, 1000), atol=0.051)


@pytest.mark.parametrize(("unit", "resolution"), [("mV", "0.0001"), ("nV", "100"), ("V", "0.0000001")])
def test_other_multiples_of_a_volt(tmp_path, unit, resolution):
    recording = read_recording(write(tmp_path, rows=[f"Fz,,{resolution},{unit}"]))
    np.testing.assert_allclose(recording.data * 1e6, noise_uv(1, 1000), atol=0.051)


@pytest.mark.parametrize("encoding", ["cp1252", "utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("page", ["ANSI", "UTF-8", "absent"])
def test_a_header_in_any_code_page(tmp_path, encoding, page):
    """Whatever the header says of its code page; a mark of byte order in front, or none."""
    marks = ["Comment,Augen schließen,501,1,0", r"Stimulus,a\1b,251,1,0"]
    path = write(tmp_path, "Übung", rows=["Größe,,0.1,µV"], marks=marks, common={"Codepage": page}, encoding=encoding)
    recording = read_recording(path)
    assert recording.ch_names == ["Größe"]
    assert recording.units == ["uV"]
    assert recording.markers["event"].tolist() == ["Stimulus/a,b", "Comment/Augen schließen"]
    assert recording.markers["onset_s"].tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("named", "on_disk"),
    [
        ("REC.EEG", "rec.eeg"),
        (r"C:\Users\lab\Desktop\rec.eeg", "rec.eeg"),
        ("/home/lab/rec.eeg", "rec.eeg"),
        ("$b.eeg", "rec.eeg"),
        ("Müller.eeg", unicodedata.normalize("NFD", "Müller.eeg")),
    ],
)
def test_a_data_file_is_found_however_its_name_is_written(tmp_path, named, on_disk):
    path = write(tmp_path, common={"DataFile": named})
    if on_disk != "rec.eeg":
        (tmp_path / "rec.eeg").rename(tmp_path / on_disk)
    assert companions(path)["data"] == tmp_path / on_disk
    assert read_recording(path).data.shape == (3, 1000)


def test_a_marker_file_by_the_header_s_name_stands_in_for_a_missing_one(tmp_path):
    path = write(tmp_path, common={"MarkerFile": "before_renaming.vmrk"})
    assert companions(path)["markers"] == tmp_path / "rec.vmrk"
    recording = read_recording(path)
    assert recording.markers["event"].tolist() == ["Stimulus/S  1"]
    assert recording.notes == ["markers come from rec.vmrk: before_renaming.vmrk, which the header names, is not there"]


def test_the_marker_file_that_the_header_names_comes_first(tmp_path):
    write(tmp_path, "other", marks=["Stimulus,S  7,251,1,0"])
    path = write(tmp_path, common={"MarkerFile": "other.vmrk"})
    assert companions(path)["markers"] == tmp_path / "other.vmrk"
    recording = read_recording(path)
    assert recording.markers["event"].tolist() == ["Stimulus/S  7"]
    assert recording.notes == ["markers come from other.vmrk, which the header names; rec.vmrk is not read"]


def test_no_marker_file(tmp_path):
    path = write(tmp_path, common={"MarkerFile": "absent"})
    assert read_recording(path).markers.empty
    assert "markers" not in companions(path)
    path = write(tmp_path, common={"MarkerFile": "gone.vmrk"})
    (tmp_path / "rec.vmrk").unlink()
    assert "the marker file gone.vmrk, which the header names, is not there: no markers" in read_recording(path).notes


def test_a_missing_data_file_is_named(tmp_path):
    path = write(tmp_path, common={"DataFile": "before.eeg"})
    with pytest.raises(DataError, match=r"names a data file that is not there: before\.eeg") as caught:
        read_recording(path)
    assert "correct DataFile=" in caught.value.cure


def test_a_new_segment_is_a_break_and_events_after_it_keep_their_place(tmp_path):
    marks = [
        "New Segment,,1,1,0,20200101000000000000",
        "New Segment,paused,501,1,0,20200101000500000000",
        "Stimulus,S  1,601,1,0",
        "Bad Interval,Userdefined,101,50,0",
    ]
    recording = read_recording(write(tmp_path, marks=marks))
    assert recording.breaks_s == [2.0]
    assert recording.markers["onset_s"].tolist() == [2.4]
    ((onset, duration, name),) = recording.spans
    assert (onset, duration, name) == (pytest.approx(0.4), pytest.approx(0.2), "Bad Interval/Userdefined")


def test_a_bad_stretch_that_was_exported_as_a_comment_is_one(tmp_path):
    marks = ["Comment,BAD_muscle,251,100,0", "Comment,bad_choice,501,1,0", "Comment,badge,601,100,0"]
    recording = read_recording(write(tmp_path, marks=marks))
    assert recording.spans == [(1.0, 0.4, "Comment/BAD_muscle")]
    assert recording.markers["event"].tolist() == ["Comment/bad_choice", "Comment/badge"]


def test_every_line_of_a_marker_file_counts_even_where_numbers_repeat(tmp_path):
    path = write(tmp_path)
    markers = tmp_path / "rec.vmrk"
    markers.write_bytes(markers.read_bytes() + b"Mk2=Stimulus,S  9,501,1,0\r\nMk3=Comment,eyes, open,601,1,0\r\n")
    recording = read_recording(path)
    assert recording.markers["event"].tolist() == ["Stimulus/S  1", "Stimulus/S  9"]
    assert recording.notes == ["rec.vmrk: 1 lines that are no markers"]


def test_a_truncated_data_file(tmp_path):
    marks = [f"Stimulus,S  1,{at},1,0" for at in range(101, 1000, 100)]
    path = write(tmp_path, marks=marks)
    data = tmp_path / "rec.eeg"
    data.write_bytes(data.read_bytes()[: 400 * 6])
    with pytest.raises(DataError, match=r"they hold 1\.6 s, and 3 of 9 markers lie behind that.*at 3\.6 s"):
        read_recording(path)


def test_a_header_that_counts_the_samples_is_believed(tmp_path):
    path = write(tmp_path, common={"DataPoints": "1200"})
    with pytest.raises(DataError, match=r"announces 1200 samples, its data file holds 1000: it is truncated"):
        read_recording(path)
    with pytest.raises(DataError, match="too long"):
        read_recording(write(tmp_path, common={"DataPoints": "900"}))
    marks = ["Stimulus,S  1,251,1,0", "Stimulus,S  1,2001,1,0"]
    recording = read_recording(write(tmp_path, common={"DataPoints": "1000"}, marks=marks))
    assert len(recording.markers) == 1
    assert any("outside" in note for note in recording.notes)


def test_a_data_file_that_ends_inside_a_sample(tmp_path):
    path = write(tmp_path)
    data = tmp_path / "rec.eeg"
    data.write_bytes(data.read_bytes()[:-1])
    recording = read_recording(path)
    assert recording.data.shape == (3, 999)
    assert any(
        "no multiple of 3 channels × 2 bytes" in note and "999 whole samples" in note for note in recording.notes
    )
    path = write(tmp_path, common={"DataOrientation": "VECTORIZED"})
    data.write_bytes(data.read_bytes()[:-1])
    with pytest.raises(DataError, match="one after the other"):
        read_recording(path)


@pytest.mark.parametrize(
    ("common", "message"),
    [
        ({"DataType": "FREQUENCYDOMAIN"}, "no signal over time"),
        ({"Averaged": "YES"}, "an average over epochs"),
        (
            {"SegmentationType": "MARKERBASED", "DataPoints": "1000", "SegmentDataPoints": "100"},
            "epochs of 100 samples",
        ),
        ({"NumberOfChannels": "4"}, "announces 4 channels and describes 3; Ch4 is missing"),
        ({"SamplingInterval": "absent"}, r"has no line SamplingInterval= under \[Common Infos\]"),
    ],
)
def test_what_is_no_continuous_recording_is_refused(tmp_path, common, message):
    with pytest.raises(DataError, match=message):
        read_recording(write(tmp_path, common=common))


def test_channels_that_are_no_eeg_are_told_by_unit_and_position(tmp_path):
    places = "[Coordinates]\r\nCh1=1,45,90\r\nCh2=1,0,0\r\nCh3=0,0,0\r\nCh4=0,0,0\r\nCh5=0,0,0\r\nCh6=0,0,0"
    names = ["Fz", "Cz", "Pz", "Pulse", "VEOG", "Temp"]
    rows = [f"{name},,0.1,{'C' if name == 'Temp' else 'µV'}" for name in names]
    recording = read_recording(write(tmp_path, rows=rows, more=places))
    assert dict(zip(recording.ch_names, recording.ch_types, strict=True)) == {
        "Fz": "eeg", "Cz": "eeg", "Pz": "eeg", "Pulse": "misc", "VEOG": "eeg", "Temp": "misc",
    }  # fmt: skip
    assert "channels in units of no voltage taken for misc: Temp (C)" in recording.notes
    assert any(note.endswith("taken for misc: Pulse") for note in recording.notes)
    place = recording.montage.get_positions()["ch_pos"]
    np.testing.assert_allclose(place["Fz"], [0, 0.0672, 0.0672], atol=1e-4)
    np.testing.assert_allclose(place["Cz"], [0, 0, 0.095], atol=1e-9)


def test_labels_that_repeat_are_numbered(tmp_path):
    recording = read_recording(write(tmp_path, rows=["EOG,,0.1,µV", "Cz,,0.1,µV", "EOG,,0.1,µV", ",,0.1,µV"]))
    assert recording.ch_names == ["EOG-0", "Cz", "EOG-1", "Ch4"]
    assert recording.notes == ["labels that repeat are numbered: EOG"]


def test_a_change_of_any_file_that_is_read_is_a_change_of_the_sources(tmp_path):
    path = write(tmp_path, common={"MarkerFile": "stale.vmrk", "DataFile": "REC.EEG"})
    files = acquire.sources(acquire.Config(source="file", path=str(path)), "p1")
    assert {label: file.name for label, file in files.items()} == {
        "recording": "rec.vhdr", "data": "rec.eeg", "markers": "rec.vmrk",
    }  # fmt: skip


def test_real_files_are_read_as_mne_reads_them():
    paths = sorted([*REAL.rglob("*.vhdr"), *REAL.rglob("*.ahdr")])
    if not paths:
        pytest.skip("recordings of other makers are not here (shared/data)")
    for path in paths:
        if path.name in CUT_OFF:
            with pytest.raises(DataError, match=CUT_OFF[path.name]):
                read_recording(path)
            continue
        recording = read_recording(path)
        reference = mne.io.read_raw_brainvision(path, preload=True, verbose="error")
        assert recording.ch_names == reference.ch_names
        np.testing.assert_array_equal(recording.data, reference.get_data())
        theirs, ours = reference.get_montage(), recording.montage
        for name, place in (ours.get_positions()["ch_pos"] if ours else {}).items():
            np.testing.assert_allclose(place, theirs.get_positions()["ch_pos"].get(name, place), atol=1e-12)
