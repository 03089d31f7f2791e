"""Recordings of every format: channels, samples, markers and positions come back as they were written."""

from __future__ import annotations

import shutil
import sys
import warnings
from pathlib import Path

import mne
import numpy as np
import pytest

from hrcneuro.contract import Inputs
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io.fif import read_raw
from hrcneuro.io.tables import read_table
from hrcneuro.sources.channels import standard_montage
from hrcneuro.sources.formats import read_recording
from hrcneuro.stages import acquire

SFREQ = 200.0
NAMES = ["Fz", "Cz", "Pz", "HEOG"]
MARKS = [("flash", 1.0), ("press", 1.5), ("flash", 3.0)]


@pytest.fixture
def original(noise_uv):
    info = mne.create_info(NAMES, SFREQ, "eeg", verbose="error")
    raw = mne.io.RawArray(noise_uv(4, 1000).astype(float) * 1e-6, info, verbose="error")
    onsets, names = [at for _, at in MARKS], [name for name, _ in MARKS]
    raw.set_annotations(mne.Annotations(onsets, 0, names))
    return raw


def export(raw: mne.io.BaseRaw, path: Path) -> Path:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if path.suffix == ".fif":
            raw.save(path, verbose="error")
        else:
            mne.export.export_raw(path, raw, verbose="error")
    return path


def run(path, out, **options):
    config = acquire.Config(source="file", path=str(path), **options)
    assert not acquire.check(config)
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    assert acquire.sources(config, "p1")
    summary = acquire.run(config, Inputs("p1", {}), out)
    return summary, read_raw(out / "p1_raw.fif", preload=True), read_table(out / "trials.parquet")


@pytest.mark.parametrize(
    ("name", "marker", "atol_uv"),
    [
        ("rec.vhdr", "Comment/{}", 0.1),
        ("rec.set", "{}", 1e-4),
        ("rec_raw.fif", "{}", 1e-5),
        ("rec.edf", "{}", 0.01),
        ("rec.bdf", "{}", 0.001),
    ],
)
def test_what_was_written_is_acquired(original, tmp_path, name, marker, atol_uv):
    path = export(original, tmp_path / name)
    event_map = {marker.format("flash"): "flash", marker.format("press"): "press"}
    summary, raw, trials = run(path, tmp_path / "out", event_map=event_map)

    assert summary["source"] == "file"
    assert summary["channels"] == {"eeg": 3, "eog": 1}
    assert summary["events"] == {"flash": 2, "press": 1}
    assert raw.ch_names == NAMES
    assert raw.info["sfreq"] == SFREQ
    assert trials["event"].tolist() == ["flash", "press", "flash"]
    assert trials["onset_sample"].tolist() == [200, 300, 600]
    np.testing.assert_allclose(trials["soa_s"], [0.5, 1.5, np.nan], atol=1e-6)
    assert trials["scenario"].isna().all()
    assert trials["error"].isna().all()
    assert trials["subject"].unique().tolist() == ["p1"]
    np.testing.assert_allclose(raw.get_data(stop=1000) * 1e6, original.get_data() * 1e6, atol=atol_uv)
    standard = standard_montage().get_positions()["ch_pos"]
    assert summary["without_position"] == []
    assert raw.get_montage().get_positions()["ch_pos"].keys() == {"Fz", "Cz", "Pz"} <= standard.keys()


def test_the_event_map_may_leave_out_brainvisions_prefix(original, tmp_path):
    path = export(original, tmp_path / "rec.vhdr")
    summary, _, _ = run(path, tmp_path / "out", event_map={"flash": "light"})
    assert summary["events"] == {"light": 2}
    assert any("markers left out: Comment/press × 1" in note for note in summary["notes"])


def test_without_a_map_every_marker_is_an_event(original, tmp_path):
    summary, raw, _ = run(export(original, tmp_path / "rec.set"), tmp_path / "out")
    assert summary["events"] == {"flash": 2, "press": 1}
    assert list(raw.annotations.description) == ["flash", "press", "flash"]


def test_companions_of_a_header_enter_the_key(original, tmp_path):
    path = export(original, tmp_path / "rec.vhdr")
    files = acquire.sources(acquire.Config(source="file", path=str(path)), "p1")
    assert {label: file.name for label, file in files.items()} == {
        "recording": "rec.vhdr", "data": "rec.eeg", "markers": "rec.vmrk",
    }  # fmt: skip


@pytest.mark.parametrize("dated", [True, False])
def test_a_fif_that_starts_late_keeps_its_times(original, tmp_path, dated):
    if dated:
        original.set_meas_date(1_500_000_000.0)
    raw = original.copy().crop(0.5, None)
    assert raw.first_samp == 100
    _, _, trials = run(export(raw, tmp_path / "late_raw.fif"), tmp_path / "out")
    assert trials["onset_sample"].tolist() == [100, 200, 500]


def test_markers_of_a_trigger_channel(original, tmp_path):
    codes = np.zeros((1, original.n_times))
    codes[0, 100:110] = 7
    codes[0, 400:410] = 9
    stim = mne.io.RawArray(codes, mne.create_info(["STI 014"], SFREQ, "stim", verbose="error"), verbose="error")
    raw = original.copy().set_annotations(None).add_channels([stim], force_update_info=True)
    summary, back, trials = run(
        export(raw, tmp_path / "stim_raw.fif"), tmp_path / "out", event_map={"7": "a", "9": "b"}
    )
    assert trials[["event", "onset_sample"]].to_numpy().tolist() == [["a", 100], ["b", 400]]
    assert summary["channels"]["stim"] == 1
    np.testing.assert_array_equal(back.get_data("stim"), codes)


def with_triggers(original, tmp_path, name="STI 014", kind="stim"):
    """Return a file with codes 7 and 9 beside its annotations."""
    codes = np.zeros((1, original.n_times))
    codes[0, 100:110] = 7
    codes[0, 400:410] = 9
    stim = mne.io.RawArray(codes, mne.create_info([name], SFREQ, kind, verbose="error"), verbose="error")
    return export(original.copy().add_channels([stim], force_update_info=True), tmp_path / "stim_raw.fif")


def test_which_markers_are_taken_can_be_chosen_and_is_seen_at_once(original, tmp_path):
    path = with_triggers(original, tmp_path)
    assert run(path, tmp_path / "out")[0]["events"] == {"flash": 2, "press": 1}
    assert run(path, tmp_path / "out", markers="channel", event_map={"9": "nine"})[0]["events"] == {"nine": 1}
    view = acquire.inspect(acquire.Config(source="file", path=str(path)), "p1")
    left = "trigger channel STI 014 left aside: 7 × 1, 9 × 1; acquire.markers = 'channel' takes it instead"
    assert any(note.startswith(left) for note in view["recording"]["notes"])


def test_a_channel_of_codes_that_the_file_calls_eeg_can_be_the_source(original, tmp_path):
    path = with_triggers(original, tmp_path, name="X9", kind="eeg")
    summary, _, _ = run(path, tmp_path / "out", channel_types={"X9": "stim"}, markers="X9")
    assert summary["events"] == {"7": 1, "9": 1}


def test_breaks_and_bad_stretches_are_no_events(original, tmp_path):
    marks = original.annotations + mne.Annotations(
        [2.0, 2.0, 4.0], [0, 0, 0.5], ["BAD boundary", "EDGE boundary", "BAD_x"]
    )
    original.set_annotations(marks)
    summary, raw, trials = run(export(original, tmp_path / "rec_raw.fif"), tmp_path / "out")
    assert set(trials["event"]) == {"flash", "press"}
    assert summary["breaks"] == 1
    found = {a["description"]: (round(a["onset"], 3), round(a["duration"], 3)) for a in raw.annotations}
    assert found["EDGE boundary"] == found["BAD boundary"] == (2.0, 0.0)
    assert found["BAD_x"] == (4.0, 0.5)


def test_the_files_own_positions_survive(noise_uv, tmp_path, write_set):
    path = write_set(tmp_path / "p.set", noise_uv(3, 500), ["Fz", "Cz", "Pz"], 100.0, [("x", 50)], positions=True)
    _, raw, _ = run(path, tmp_path / "out")
    own = standard_montage().get_positions()["ch_pos"]
    for name, place in raw.get_montage().get_positions()["ch_pos"].items():
        np.testing.assert_allclose(place, own[name], atol=1e-7)


def test_channels_without_position_are_stated(original, tmp_path):
    original.rename_channels({"Pz": "Q17"})
    summary, _, _ = run(export(original, tmp_path / "rec_raw.fif"), tmp_path / "out")
    assert summary["without_position"] == ["Q17"]
    summary, _, _ = run(tmp_path / "rec_raw.fif", tmp_path / "out", montage="none")
    assert summary["without_position"] == ["Fz", "Cz", "Q17"]


def test_channels_are_renamed_typed_and_dropped(original, tmp_path):
    path = export(original, tmp_path / "rec_raw.fif")
    _, raw, _ = run(
        path, tmp_path / "out", channel_map={"Fz": "EKG"}, channel_types={"EKG": "ecg", "HEOG": "misc"}, drop=("Pz",)
    )
    assert dict(zip(raw.ch_names, raw.get_channel_types(), strict=True)) == {"EKG": "ecg", "Cz": "eeg", "HEOG": "misc"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"channel_map": {"Fzz": "A"}},
            r"acquire\.channel_map.*'Fzz' \(did you mean 'Fz'\?\); it has Fz, Cz, Pz, HEOG",
        ),
        ({"channel_types": {"HOEG": "eog"}}, r"acquire\.channel_types.*does not have: 'HOEG' \(did you mean 'HEOG'"),
        ({"drop": ("heog",)}, r"acquire\.drop.*'heog' \(did you mean 'HEOG'"),
        ({"channel_map": {"Fz": "Cz"}}, "several channels the same name: Cz"),
        ({"montage": "colin27_1006"}, r"acquire\.montage = 'colin27_1006' \(did you mean"),
        ({"event_map": {"flsh": "x"}}, r"'flsh' \(did you mean 'flash'\?\); it has flash × 2, press × 1"),
    ],
)
def test_a_wrong_option_names_what_there_is(original, tmp_path, options, message):
    with pytest.raises(ConfigError, match=message):
        run(export(original, tmp_path / "rec_raw.fif"), tmp_path / "out", **options)


def with_gap(original, tmp_path, row):
    """Return a file whose channel of that row has no numbers in ten samples."""
    original._data[row, 300:310] = np.nan
    return export(original, tmp_path / "rec_raw.fif")


def test_numbers_that_are_no_numbers(original, tmp_path):
    path = with_gap(original, tmp_path, 1)
    with pytest.raises(DataError, match=r"channel Cz has 10 of 1000 samples.*first at 1\.500 s") as caught:
        run(path, tmp_path / "out")
    assert "acquire.bads = ['Cz']" in caught.value.cure
    assert "acquire.drop = ['Cz']" in caught.value.cure
    assert run(path, tmp_path / "out", drop=("Cz",))[0]["channels"] == {"eeg": 2, "eog": 1}
    summary, raw, _ = run(path, tmp_path / "out", bads=("Cz",))
    assert summary["bads"] == raw.info["bads"] == ["Cz"]
    assert not raw.get_data("Cz", start=300, stop=310).any()


def test_an_eog_channel_that_is_no_number_can_only_be_left_out(original, tmp_path):
    path = with_gap(original, tmp_path, 3)
    with pytest.raises(DataError, match=r"channel HEOG has 10 of 1000 samples") as caught:
        run(path, tmp_path / "out")
    assert "acquire.drop = ['HEOG']" in caught.value.cure
    assert "bads" not in caught.value.cure
    summary, raw, _ = run(path, tmp_path / "out", bads=("HEOG",))
    assert summary["bads"] == raw.info["bads"] == ["HEOG"]
    note = "channel HEOG, marked bad: 10 of 1000 samples that are no numbers are 0 now, the first at 1.500 s"
    assert note in summary["notes"]


def test_the_cure_for_a_renamed_channel_works(original, tmp_path):
    path = with_gap(original, tmp_path, 1)
    with pytest.raises(DataError, match="channel Mid has") as caught:
        run(path, tmp_path / "out", channel_map={"Cz": "Mid"})
    assert "(acquire.bads = ['Mid']) or leave it out (acquire.drop = ['Cz'], without its name in" in caught.value.cure
    run(path, tmp_path / "out", channel_map={"Cz": "Mid"}, bads=("Mid",))
    run(path, tmp_path / "out", drop=("Cz",))


def test_the_cure_for_a_shortened_label_works(original, tmp_path):
    original.rename_channels({"Cz": "EEG Cz-Ref"})
    path = with_gap(original, tmp_path, 1)
    with pytest.raises(DataError, match="channel Cz has") as caught:
        run(path, tmp_path / "out")
    assert "(acquire.bads = ['Cz']) or leave it out (acquire.drop = ['EEG Cz-Ref'])" in caught.value.cure
    run(path, tmp_path / "out", bads=("Cz",))
    run(path, tmp_path / "out", drop=("EEG Cz-Ref",))


def test_a_flat_channel_is_noted_and_left_to_preprocess(original, tmp_path):
    original._data[2] = 5e-6
    summary, raw, _ = run(export(original, tmp_path / "rec_raw.fif"), tmp_path / "out")
    assert "channel Pz is flat: 5 µV from the first sample to the last" in summary["notes"]
    assert "Pz" in raw.ch_names


def test_channels_that_the_file_marks_bad_stay_marked(original, tmp_path):
    original.info["bads"] = ["Cz"]
    path = export(original, tmp_path / "rec_raw.fif")
    _, raw, _ = run(path, tmp_path / "out", bads=("Top",), channel_map={"Fz": "Top", "Cz": "Mid"})
    assert sorted(raw.info["bads"]) == ["Mid", "Top"]


def test_no_events(original, tmp_path):
    original.set_annotations(None)
    with pytest.raises(DataError, match="the recording has no events"):
        run(export(original, tmp_path / "rec_raw.fif"), tmp_path / "out")


def test_a_wrong_unit_is_refused_and_can_be_set_right(original, tmp_path):
    wrong = original.copy()
    wrong._data *= 1e6
    path = export(wrong, tmp_path / "uv_raw.fif")
    with pytest.raises(DataError, match="the EEG's spread is") as caught:
        run(path, tmp_path / "out")
    assert "acquire.unit = 'uV'" in caught.value.cure
    _, raw, _ = run(path, tmp_path / "out", unit="uV")
    np.testing.assert_allclose(raw.get_data(), original.get_data(), atol=1e-10)


def test_volts_in_an_eeglab_file_are_refused_and_can_be_set_right(noise_uv, tmp_path, write_set):
    data = noise_uv(3, 500)
    path = write_set(tmp_path / "v.set", data * 1e-6, ["Fz", "Cz", "Pz"], 100.0, [("x", 50)])
    with pytest.raises(DataError, match="scalp EEG lies above") as caught:
        run(path, tmp_path / "out")
    assert "acquire.unit = 'V'" in caught.value.cure
    _, raw, _ = run(path, tmp_path / "out", unit="V")
    np.testing.assert_allclose(raw.get_data() * 1e6, data, rtol=1e-5, atol=1e-5)


def test_offsets_of_electrodes_say_nothing_of_the_unit(original, tmp_path):
    original._data += 0.02 * np.array([-1.5, 0.4, 1.0, 0.1])[:, None]
    _, raw, _ = run(export(original, tmp_path / "dc_raw.fif"), tmp_path / "out")
    np.testing.assert_allclose(raw.get_data(), original.get_data(), atol=1e-8)


def test_a_recording_a_thousand_times_too_small_is_refused(original, tmp_path):
    original._data *= 1e-3
    path = export(original, tmp_path / "mv_raw.fif")
    with pytest.raises(DataError, match=r"spread is .* V; scalp EEG lies above 1e-07 V") as caught:
        run(path, tmp_path / "out")
    assert "acquire.unit = 'mV'" in caught.value.cure or "or 'mV'" in caught.value.cure


def test_the_reference_is_noted(original, tmp_path):
    summary, raw, _ = run(export(original, tmp_path / "rec_raw.fif"), tmp_path / "out", reference="left earlobe")
    assert summary["reference"] == "left earlobe"
    assert "left earlobe" in raw.info["description"]


def test_a_truncated_fif(original, tmp_path):
    path = export(original, tmp_path / "rec_raw.fif")
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(DataError, match=r"rec_raw\.fif"):
        run(path, tmp_path / "out")


def test_a_missing_data_file_of_brainvision(original, tmp_path):
    path = export(original, tmp_path / "rec.vhdr")
    path.with_suffix(".eeg").unlink()
    with pytest.raises(DataError, match=r"data file that is not there.*rec\.eeg"):
        run(path, tmp_path / "out")


def test_epochs_are_no_recording(original, tmp_path):
    epochs = mne.make_fixed_length_epochs(original, 1.0, preload=True, verbose="error")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mne.export.export_epochs(tmp_path / "epo.set", epochs, verbose="error")
    with pytest.raises(DataError, match="holds 5 epochs"):
        run(tmp_path / "epo.set", tmp_path / "out")


def test_the_subject_stands_in_the_path(original, tmp_path):
    for name in ("p1", "p2"):
        (tmp_path / name).mkdir()
        export(original, tmp_path / name / f"{name}_raw.fif")
    pattern = str(tmp_path / "{subject}" / "{subject}_raw.fif")
    config = acquire.Config(source="file", path=pattern)
    assert acquire.sources(config, "p2")["recording"] == tmp_path / "p2/p2_raw.fif"
    with pytest.raises(DataError, match=r"of p3 does not exist.*subjects found: p1, p2"):
        acquire.sources(config, "p3")


def test_a_path_that_is_no_recording(tmp_path):
    with pytest.raises(ConfigError, match="is a folder; recordings that can be read"):
        acquire.sources(acquire.Config(source="file", path=str(tmp_path)), "p1")
    with pytest.raises(ConfigError, match=r"has the ending '\.mat'"):
        acquire.sources(acquire.Config(source="file", path=str(tmp_path / "x.mat")), "p1")
    with pytest.raises(DataError, match=r"x\.edf of p1 does not exist"):
        acquire.sources(acquire.Config(source="file", path=str(tmp_path / "x.edf")), "p1")


def eeg_stream(samples: np.ndarray, *, srate: float = 100.0, start: float = 50.0, **more) -> dict:
    stamps = start + np.arange(len(samples)) / srate
    labels = ["Fz", "Cz", "EOG1"]
    return {
        "name": "amp", "type": "EEG", "srate": srate, "format": "float32", "labels": labels,
        "types": ["EEG", "EEG", "EOG"],
        "stamps": stamps, "samples": samples, **more,
    }  # fmt: skip


def marker_stream(stamps: list[float], texts: list[str], **more) -> dict:
    return {
        "name": "tags", "type": "Markers", "srate": 0, "format": "string", "stamps": stamps, "samples": texts, **more,
    }  # fmt: skip


def test_xdf(tmp_path, noise_uv, write_xdf):
    data = noise_uv(3, 400).T
    # The marker computer's clock is 7 s ahead: XDF notes the difference, and the times must come out on the EEG's.
    marks = marker_stream([58.0, 59.005, 44.0], ["flash", "press", "early"], offset=-7.0)
    path = write_xdf(tmp_path / "rec.xdf", [eeg_stream(data), marks])
    summary, raw, trials = run(path, tmp_path / "out")
    assert raw.ch_names == ["Fz", "Cz", "EOG1"]
    assert summary["channels"] == {"eeg": 2, "eog": 1}
    np.testing.assert_allclose(raw.get_data() * 1e6, data.T, rtol=1e-5, atol=1e-5)
    assert trials["event"].tolist() == ["flash", "press"]
    np.testing.assert_allclose(trials["onset_s"], [1.0, 2.005], atol=1e-6)
    assert any("1 markers lie before or after" in note for note in summary["notes"])


def test_xdf_with_a_gap_has_a_break(tmp_path, noise_uv, write_xdf):
    stream = eeg_stream(noise_uv(3, 3000).T, srate=500.0)
    stream["stamps"][1500:] += 10.0
    path = write_xdf(tmp_path / "rec.xdf", [stream, marker_stream([51.0, 64.0], ["a", "b"])])
    summary, _, trials = run(path, tmp_path / "out")
    assert summary["breaks"] == 1
    # b comes 1 s after the gap's end, so 1 s after sample 1500.
    np.testing.assert_allclose(trials["onset_s"], [1.0, 4.0], atol=0.002)


def test_xdf_with_two_eeg_streams_asks_which(tmp_path, noise_uv, write_xdf):
    data = noise_uv(3, 400).T
    streams = [eeg_stream(data), eeg_stream(data * 2, name="second"), marker_stream([51.0], ["a"])]
    path = write_xdf(tmp_path / "rec.xdf", streams)
    with pytest.raises(ConfigError, match=r"2 streams that may be the EEG: amp \(EEG, 3 channels, .*, second \(EEG"):
        run(path, tmp_path / "out")
    with pytest.raises(ConfigError, match=r"no regular stream 'secnd'.*did you mean 'second'"):
        run(path, tmp_path / "out", stream="secnd")
    _, raw, _ = run(path, tmp_path / "out", stream="second")
    np.testing.assert_allclose(raw.get_data() * 1e6, data.T * 2, rtol=1e-5, atol=1e-5)


def test_xdf_without_pyxdf_says_how_to_get_it(tmp_path, noise_uv, write_xdf, monkeypatch):
    path = write_xdf(tmp_path / "rec.xdf", [eeg_stream(noise_uv(3, 400).T), marker_stream([51.0], ["a"])])
    monkeypatch.setitem(sys.modules, "pyxdf", None)
    with pytest.raises(ConfigError, match="needs pyxdf") as caught:
        run(path, tmp_path / "out")
    assert "hrcneuro[xdf]" in caught.value.cure


def test_a_file_that_is_no_xdf(tmp_path):
    (tmp_path / "rec.xdf").write_bytes(b"nothing of the kind")
    with pytest.raises(DataError, match="cannot be read as XDF"):
        run(tmp_path / "rec.xdf", tmp_path / "out")


def test_eeglabs_own_recording(tmp_path):
    """Against MNE's own reading of the file: the samples, the events and the positions."""
    path = Path(__file__).parents[2] / "../shared/data/eeglab_sample/eeglab_data.set"
    if not path.is_file():
        pytest.skip("EEGLAB's sample recording is not here (shared/data)")
    summary, raw, trials = run(path, tmp_path / "out")
    reference = mne.io.read_raw_eeglab(path, preload=True, verbose="error")
    assert summary["events"] == {"square": 80, "rt": 74}
    assert summary["channels"] == {"eeg": 30, "eog": 2}
    assert raw.ch_names[0] == "FPz"
    assert [n for n, t in zip(raw.ch_names, raw.get_channel_types(), strict=True) if t == "eog"] == ["EOG1", "EOG2"]
    np.testing.assert_allclose(raw.get_data(), reference.get_data(), atol=1e-10)
    assert len(trials) == len(reference.annotations) == 154
    np.testing.assert_allclose(trials["onset_s"], reference.annotations.onset, atol=1e-9)
    for got, want in zip(raw.info["chs"], reference.info["chs"], strict=True):
        if "EOG" not in got["ch_name"]:
            np.testing.assert_allclose(got["loc"][:3], want["loc"][:3], atol=1e-7)


def test_an_xdf_that_is_cut_off_in_its_only_chunk_of_eeg(tmp_path, noise_uv, write_xdf):
    path = write_xdf(tmp_path / "rec.xdf", [marker_stream([51.0], ["a"]), eeg_stream(noise_uv(3, 400).T)])
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(DataError, match=r"the EEG stream has no samples: amp \(EEG, 3 channels, 100 Hz, 0 samples\)"):
        run(path, tmp_path / "out")


def test_both_names_of_the_template_montage_are_taken(original, tmp_path):
    path = export(original, tmp_path / "rec_raw.fif")
    positions = [run(path, tmp_path / "out", montage=f"{n}_1020")[1].get_montage() for n in ("standard", "colin27")]
    assert positions[0] == positions[1]


def test_reading_leaves_no_folder_in_the_notes(original, tmp_path):
    path = export(original, tmp_path / "rec.edf")
    path.write_bytes(path.read_bytes()[:-100])
    notes = read_recording(path).notes
    assert not [note for note in notes if str(tmp_path) in note]
