"""FIF: stretches that were not recorded, recordings in several files, and files that end too early."""

from __future__ import annotations

import warnings
from pathlib import Path

import mne
import numpy as np
import pytest

from hrcneuro.errors import DataError
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.layout import recording_files

FS = 100.0
RAMP = np.arange(1000) * 1e-8


def ramp(marks=(), *, first: int = 0, dated: bool = True, samples: int = 1000) -> mne.io.BaseRaw:
    """Return a recording whose samples tell where they lie."""
    info = mne.create_info(["Cz", "Pz"], FS, "eeg", verbose="error")
    raw = mne.io.RawArray(np.tile(np.arange(samples) * 1e-8, (2, 1)), info, first_samp=first, verbose="error")
    if dated:
        raw.set_meas_date(1_500_000_000.0)
    onset, duration, text = zip(*marks, strict=True) if marks else ([], [], [])
    return raw.set_annotations(mne.Annotations(onset, duration, text), verbose="error")


def save(raw: mne.io.BaseRaw, path: Path, **options) -> Path:
    with warnings.catch_warnings(action="ignore"):
        raw.save(path, overwrite=True, verbose="error", **options)
    return path


@pytest.mark.parametrize(("first", "dated"), [(0, True), (300, True), (300, False)])
def test_what_was_not_recorded_is_left_out_and_events_keep_their_sample(tmp_path, first, dated):
    marks = [(1.5, 0, "a"), (4.5, 0, "b"), (3.2, 0, "lost"), (3.0, 1.0, "BAD_ACQ_SKIP")]
    path = save(ramp(marks, first=first, dated=dated), tmp_path / "x_raw.fif", buffer_size_sec=1.0)
    recording = read_recording(path)
    assert recording.duration_s == 9.0
    assert recording.breaks_s == [3.0]
    assert recording.markers["event"].tolist() == ["a", "b"]
    np.testing.assert_allclose(recording.markers["onset_s"], [1.5, 3.5], atol=1e-6)
    np.testing.assert_allclose(recording.data[0], np.delete(RAMP, np.s_[300:400]), atol=1e-14)
    assert "1 s in 1 stretches were not recorded (BAD_ACQ_SKIP): left out, each is a break" in recording.notes
    assert any("1 markers lie where nothing was recorded and are left out: lost × 1" in one for one in recording.notes)
    assert recording.spans == []


def test_gaps_that_a_later_program_filled_are_left_out_all_the_same(tmp_path):
    """A gap that fits no buffer is written as samples; only its annotation tells of it."""
    path = save(ramp([(2.55, 0.5, "BAD_ACQ_SKIP"), (3.05, 0, "a")]), tmp_path / "x_raw.fif", buffer_size_sec=1.0)
    recording = read_recording(path)
    assert recording.data.shape[1] == 950
    assert recording.breaks_s == [2.55]
    np.testing.assert_allclose(recording.markers["onset_s"], [2.55], atol=1e-6)


@pytest.fixture(params=["neuromag", "bids"])
def split(request, tmp_path):
    """A recording in three files, by both ways to name them."""
    raw = ramp([(1.0, 0, "a"), (3999.0, 0, "b")], samples=400_000)
    name = "x_eeg.fif" if request.param == "bids" else "x_raw.fif"
    save(raw, tmp_path / name, split_size="2MB", split_naming=request.param)
    parts = sorted(p.name for p in tmp_path.iterdir())
    first = "x_raw.fif" if "x_raw.fif" in parts else parts[0]
    return tmp_path / first, [p for p in parts if p != first]


def test_every_part_of_a_split_recording_is_in_the_key(split):
    path, later = split
    files = recording_files(str(path), "p1")
    assert [file.name for file in files.values()] == [path.name, *later]
    assert later
    recording = read_recording(path)
    assert recording.duration_s == 4000.0
    assert recording.breaks_s == []
    assert recording.markers["event"].tolist() == ["a", "b"]


def test_a_missing_part_is_named(split):
    path, later = split
    (path.parent / later[0]).rename(path.parent / "elsewhere.fif")
    with pytest.raises(DataError, match=rf"a part is missing: {path.name} goes on in {later[0]}") as caught:
        recording_files(str(path), "p1")
    assert f"put {later[0]} beside it" in caught.value.cure


def test_a_later_part_alone_is_refused(split):
    path, later = split
    # The name that MNE writes into BIDS parts lacks the number of the part.
    with pytest.raises(DataError, match=rf"{later[0]} is a later part of .*: it goes on after x_(raw|eeg)\.fif"):
        recording_files(str(path.parent / later[0]), "p1")


def shift(part: Path, samples: int) -> int:
    """Let a part of a recording begin later than it did; return at which sample it did."""
    content = part.read_bytes()
    # The tag of a part's first sample: kind 208, an int of 4 bytes.
    at = content.index(b"\x00\x00\x00\xd0\x00\x00\x00\x03\x00\x00\x00\x04") + 16
    first = int.from_bytes(content[at : at + 4], "big")
    part.write_bytes(content[:at] + (first + samples).to_bytes(4, "big") + content[at + 4 :])
    return first


def test_parts_that_do_not_follow_each_other_have_a_break_and_keep_their_time(split):
    path, later = split
    first = shift(path.parent / later[-1], 200)
    recording = read_recording(path)
    assert recording.breaks_s == [first / FS]
    assert any("do not follow each other (+200 samples)" in note for note in recording.notes)
    # The clock went on for two seconds: what it calls 3999 s was recorded on the sample of 3997 s.
    np.testing.assert_allclose(recording.markers["onset_s"], [1.0, 3997.0], atol=1e-3)


def test_parts_that_overlap_are_refused(split):
    path, later = split
    shift(path.parent / later[-1], -200)
    with pytest.raises(DataError, match=rf"{later[-1]} begins 200 samples before .* ends: parts overlap"):
        read_recording(path)


@pytest.mark.parametrize("ending", [".fif", ".fif.gz"])
def test_a_whole_file_is_whole(tmp_path, ending):
    assert read_recording(save(ramp(), tmp_path / f"x_raw{ending}")).notes == []


def buffers(path: Path) -> list[int]:
    """Return where the buffers of samples begin (kind 300, single precision)."""
    content, found, at = path.read_bytes(), [], 0
    while (at := content.find(b"\x00\x00\x01\x2c\x00\x00\x00\x04", at)) >= 0:
        found.append(at)
        at += 1
    return found


@pytest.mark.parametrize("beyond", [0, 3, 16, 200])
def test_a_file_that_ends_within_its_recording_is_refused_wherever_it_is_cut(tmp_path, beyond):
    path = save(ramp(), tmp_path / "x_raw.fif", buffer_size_sec=1.0)
    starts = buffers(path)
    assert len(starts) == 10
    # Cut at the border of two buffers, nothing in what is left is broken: MNE reads it as a shorter recording.
    path.write_bytes(path.read_bytes()[: starts[6] + beyond])
    with pytest.raises(DataError, match=r"x_raw\.fif is truncated: it ends within its recording, after 6 buffers"):
        read_recording(path)


def test_a_truncated_gz_is_refused(tmp_path):
    path = save(ramp(), tmp_path / "x_raw.fif.gz")
    path.write_bytes(path.read_bytes()[:-500])
    with pytest.raises(DataError, match=r"x_raw\.fif\.gz"):
        read_recording(path)


def test_a_name_that_mne_does_not_like_is_no_note(tmp_path):
    path = save(ramp(), tmp_path / "x_raw.fif").rename(tmp_path / "session one.fif")
    assert read_recording(path).notes == []
