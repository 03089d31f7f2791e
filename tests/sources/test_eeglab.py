"""EEGLAB data sets as EEGLAB, scripts and renaming leave them."""

from __future__ import annotations

import shutil
from pathlib import Path

import h5py
import mne
import numpy as np
import pytest
import scipy.io

from hrcneuro.errors import DataError
from hrcneuro.sources.formats import read_recording
from hrcneuro.sources.formats.companions import companions
from hrcneuro.sources.formats.eeglab_names import named_data

SFREQ, NAMES = 100.0, ["Fz", "Cz", "Pz"]
EMPTY = np.zeros((0, 0))
SHARED = Path(__file__).parents[2] / "../shared/data"


def structure(**changes: object) -> dict:
    """Return a data set's fields with three channels, 500 samples and two events."""
    samples = np.random.default_rng(1).normal(0, 10, (3, 500)).astype("<f4")
    fields = {
        "setname": "x", "nbchan": 3.0, "trials": 1.0, "pnts": 500.0, "srate": SFREQ, "xmin": 0.0, "times": EMPTY,
        "data": samples, "chanlocs": rows(labels=NAMES), "event": rows(type=["a", "b"], latency=[101.0, 201.5]),
        "chaninfo": {"plotrad": 0.5},
    }  # fmt: skip
    return fields | changes


def rows(**columns: list) -> np.ndarray:
    """Return a structure array of MATLAB with these fields."""
    count = len(next(iter(columns.values())))
    table = np.zeros((1, count), dtype=[(name, object) for name in columns])
    for name, values in columns.items():
        table[name][0] = [np.array(v, dtype=object) if v is None else v for v in values]
    return table


def save(path: Path, fields: dict, *, flat: bool = False, compressed: bool = True) -> Path:
    content = fields if flat else {"EEG": fields}
    scipy.io.savemat(path, content, appendmat=False, oned_as="row", do_compression=compressed)
    return path


def save_fdt(path: Path, value: float = 0.0) -> np.ndarray:
    data = np.random.default_rng(2).normal(value, 10, (3, 500)).astype("<f4")
    data.T.tofile(path)
    return data


@pytest.mark.parametrize("chaninfo", [EMPTY, {"plotrad": 0.5}, 0.0])
def test_no_channel_information_is_needed(tmp_path, chaninfo):
    recording = read_recording(save(tmp_path / "x.set", structure(chaninfo=chaninfo)))
    assert recording.ch_names == NAMES
    assert recording.markers.to_numpy().tolist() == [[1.0, "a"], [2.005, "b"]]
    np.testing.assert_allclose(recording.data, structure()["data"] * 1e-6, rtol=1e-6)


@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize("compressed", [True, False])
@pytest.mark.parametrize("name", ["x.fdt", "Übung 1.fdt", "before.FDT", ""])
def test_the_name_inside_is_found_without_reading_the_data_set(tmp_path, flat, compressed, name):
    # A long field before it must be passed over.
    fields = structure(times=np.arange(300_000.0), data=name or structure()["data"])
    path = save(tmp_path / "x.set", fields, flat=flat, compressed=compressed)
    assert named_data(path) == (name, not flat)


def test_the_name_inside_an_hdf5_file_is_found(tmp_path):
    path = tmp_path / "x.set"
    with h5py.File(path, "w", userblock_size=512) as file:
        field = file.create_dataset("EEG/data", data=np.array([[ord(c)] for c in "old.fdt"], dtype="u2"))
        field.attrs["MATLAB_class"] = np.bytes_("char")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    save_fdt(tmp_path / "old.fdt")
    assert named_data(path) == ("old.fdt", True)
    assert companions(path) == {"fdt": tmp_path / "old.fdt"}


def test_after_renaming_the_file_of_the_set_s_own_name_counts(tmp_path):
    path = save(tmp_path / "new.set", structure(data="old.fdt"))
    old = save_fdt(tmp_path / "old.fdt", 50)
    assert companions(path) == {"fdt": tmp_path / "old.fdt"}
    np.testing.assert_allclose(read_recording(path).data * 1e6, old, rtol=1e-6)
    new = save_fdt(tmp_path / "new.fdt")
    assert companions(path) == {"fdt": tmp_path / "new.fdt"}
    recording = read_recording(path)
    np.testing.assert_allclose(recording.data * 1e6, new, rtol=1e-6)
    assert "samples come from new.fdt, by the name of new.set; inside stands old.fdt" in recording.notes
    assert "old.fdt is not read" in recording.notes


def test_fields_without_a_structure_name_their_file(tmp_path):
    path = save(tmp_path / "new.set", structure(data="old.fdt"), flat=True)
    save_fdt(tmp_path / "new.fdt")
    old = save_fdt(tmp_path / "old.fdt", 50)
    assert companions(path) == {"fdt": tmp_path / "old.fdt"}
    recording = read_recording(path)
    np.testing.assert_allclose(recording.data * 1e6, old, rtol=1e-6)
    assert "new.fdt is not read" in recording.notes


def test_samples_inside_need_no_file_beside(tmp_path):
    path = save(tmp_path / "x.set", structure(datfile="x.fdt"))
    save_fdt(tmp_path / "x.fdt")
    assert companions(path) == {}
    np.testing.assert_allclose(read_recording(path).data, structure()["data"] * 1e-6, rtol=1e-6)


def test_the_older_dat_has_channel_after_channel(tmp_path):
    path = save(tmp_path / "x.set", structure(data="x.dat"))
    structure()["data"].tofile(tmp_path / "x.dat")
    np.testing.assert_allclose(read_recording(path).data, structure()["data"] * 1e-6, rtol=1e-6)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"trials": 5.0}, "holds 5 epochs"),
        ({"pnts": 800.0}, r"announces 3 channels × 800 samples and holds \(3, 500\)"),
        ({"nbchan": 4.0}, r"announces 4 channels × 500 samples and holds \(3, 500\)"),
        ({"srate": EMPTY}, r"no number in EEG\.srate"),
        ({"chanlocs": rows(labels=["Fz", "Cz"])}, r"describes 2 channels \(EEG\.chanlocs\) and has 3"),
        ({"data": "gone.fdt"}, r"names a data file that is not there: gone\.fdt"),
    ],
)
def test_a_data_set_that_contradicts_itself_is_refused(tmp_path, fields, message):
    with pytest.raises(DataError, match=message):
        read_recording(save(tmp_path / "x.set", structure(**fields)))


def test_events_of_every_form(tmp_path):
    event = rows(
        type=[2.0, "boundary", -99.0, EMPTY, "go", 33025, "late"],
        latency=[301.5, 100.5, 200.5, 50.0, EMPTY, np.int32(401), 9999.0],
        duration=[EMPTY, 120.0, np.nan, 0.0, 0.0, 0.0, 0.0],
    )
    recording = read_recording(save(tmp_path / "x.set", structure(event=event)))
    assert recording.markers.to_numpy().tolist() == [[3.005, "2"], [4.0, "33025"]]
    assert recording.breaks_s == [1.0, 2.0]
    assert "events without a type or a latency left out: 2" in recording.notes
    assert "1.2 s were cut out of the recording, at its boundaries" in recording.notes
    assert any("outside" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("event", "markers"),
    [
        (rows(type=["a"], latency=[np.int32(101)]), [[1.0, "a"]]),
        (EMPTY, []),
        (rows(type=["a"], sample=[51.0]), [[0.5, "a"]]),
    ],
)
def test_one_event_or_none(tmp_path, event, markers):
    recording = read_recording(save(tmp_path / "x.set", structure(event=event)))
    assert recording.markers.to_numpy().tolist() == markers


def test_one_channel(tmp_path):
    fields = structure(nbchan=1.0, data=structure()["data"][:1], chanlocs=rows(labels=["Cz"]))
    recording = read_recording(save(tmp_path / "x.set", fields))
    assert recording.ch_names == ["Cz"]
    assert recording.data.shape == (1, 500)


def test_types_of_channels_are_those_of_the_data_set(tmp_path):
    chanlocs = rows(labels=["Fz", "Trig", "Belt"], type=["EEG", "trigger", "Respiration"])
    data = structure()["data"]
    data[1] = 0
    data[1, 100:110] = 7
    recording = read_recording(save(tmp_path / "x.set", structure(chanlocs=chanlocs, data=data, event=EMPTY)))
    assert recording.ch_types == ["eeg", "stim", "misc"]
    assert "channel Belt taken for misc by its type 'Respiration'" in recording.notes
    # Codes are no microvolts.
    assert recording.data[1].max() == 7


@pytest.mark.parametrize("unit", [1, 1e-1, 1e-2, 1e-3])
def test_positions_in_any_unit(tmp_path, unit):
    nose, ear, top = (0.095, 0, 0), (0, 0.095, 0), (0, 0, 0.095)
    columns = {axis: [place[i] / unit for place in (nose, ear, top)] for i, axis in enumerate("XYZ")}
    recording = read_recording(save(tmp_path / "x.set", structure(chanlocs=rows(labels=NAMES, **columns))))
    place = recording.montage.get_positions()["ch_pos"]
    np.testing.assert_allclose([place[n] for n in NAMES], [[0, 0.095, 0], [-0.095, 0, 0], [0, 0, 0.095]], atol=1e-9)


def test_real_data_sets_are_read_as_mne_reads_them(tmp_path):
    paths = sorted(SHARED.rglob("*.set"))
    if not paths:
        pytest.skip("real data sets are not here (shared/data)")
    for path in paths:
        try:
            reference = mne.io.read_raw_eeglab(path, preload=True, verbose="error")
        except FileNotFoundError:
            with pytest.raises(DataError, match="not there"):
                read_recording(path)
            continue
        recording = read_recording(path)
        assert recording.ch_names == reference.ch_names
        np.testing.assert_array_equal(recording.data, reference.get_data())
        assert len(recording.markers) + len(recording.breaks_s) <= len(reference.annotations)
        theirs = reference.get_montage()
        assert (theirs is None) == (recording.montage is None)
        if theirs is not None:
            for a, b in zip(theirs.dig, recording.montage.dig, strict=True):
                np.testing.assert_allclose(b["r"], a["r"], atol=1e-12)


def test_a_truncated_set_is_refused(tmp_path):
    path = save(tmp_path / "x.set", structure())
    cut = tmp_path / "cut.set"
    shutil.copy(path, cut)
    cut.write_bytes(path.read_bytes()[:3000])
    assert companions(cut) == {}
    with pytest.raises(DataError, match=r"cut\.set cannot be read"):
        read_recording(cut)
