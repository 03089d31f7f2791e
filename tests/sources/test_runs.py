"""Which files belong to a subject: several runs, links, names with accents, tables of BIDS beside a recording."""

from __future__ import annotations

import shutil
import unicodedata
from pathlib import Path

import mne
import numpy as np
import pytest

from hrcneuro.contract import Inputs
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io.fif import read_raw
from hrcneuro.io.tables import read_table
from hrcneuro.sources.layout import recording_files, recordings
from hrcneuro.stages import acquire

SFREQ = 100.0


@pytest.fixture
def save(noise_uv):
    def write(path: Path, *, seed: int = 0, names: tuple[str, ...] = ("Fz", "Cz"), sfreq: float = SFREQ) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        data = noise_uv(len(names), 500, seed=seed).astype(float) * 1e-6
        raw = mne.io.RawArray(data, mne.create_info(list(names), sfreq, "eeg"), verbose="error")
        raw.set_annotations(mne.Annotations([1.0, 2.0], 0, ["a", f"b{seed}"]))
        raw.save(path, verbose="error")
        return path

    return write


def run(pattern, out, unit="p1", **options):
    config = acquire.Config(source="file", path=str(pattern), **options)
    out.mkdir()
    summary = acquire.run(config, Inputs(unit, {}), out)
    return summary, read_raw(out / f"{unit}_raw.fif", preload=True), read_table(out / "trials.parquet")


def names(pattern, unit="p1"):
    return [path.name for path in recordings(recording_files(str(pattern), unit))]


def test_runs_that_a_pattern_fits_are_joined_with_a_break_between(tmp_path, save, noise_uv):
    for run_number in (10, 9):
        save(tmp_path / f"p1_run-{run_number}_raw.fif", seed=run_number)
    summary, raw, trials = run(tmp_path / "{subject}_run-*_raw.fif", tmp_path / "out")
    both = np.concatenate([noise_uv(2, 500, seed=9), noise_uv(2, 500, seed=10)], axis=1)
    np.testing.assert_allclose(raw.get_data() * 1e6, both, atol=1e-3)
    assert trials[["event", "onset_sample"]].to_numpy().tolist() == [["a", 100], ["b9", 200], ["a", 600], ["b10", 700]]
    assert summary["breaks"] == 1
    assert [a["onset"] for a in raw.annotations if a["description"] == "BAD boundary"] == [5.0]
    assert "joined, with a break between: p1_run-9_raw.fif (5.0 s), p1_run-10_raw.fif (5.0 s)" in summary["notes"]


def test_every_run_is_in_the_key(tmp_path, save):
    for run_number in (1, 2):
        save(tmp_path / f"p1_run-{run_number}_raw.fif")
    files = acquire.sources(acquire.Config(source="file", path=str(tmp_path / "{subject}_run-?_raw.fif")), "p1")
    assert {label: file.name for label, file in files.items()} == {
        "recording": "p1_run-1_raw.fif", "recording 2": "p1_run-2_raw.fif",
    }  # fmt: skip


def test_a_pattern_takes_no_other_subject_s_files(tmp_path, save):
    for name in ("p1_raw.fif", "p10_raw.fif", "p1b_raw.fif"):
        save(tmp_path / name)
    assert names(tmp_path / "{subject}*.fif") == ["p1_raw.fif"]
    with pytest.raises(DataError, match=r"of p2 does not exist.*subjects found: p1, p10, p1b"):
        names(tmp_path / "{subject}_*.fif", "p2")


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"sfreq": 200.0}, "cannot be joined: 100 Hz and 200 Hz"),
        ({"names": ("Fz", "Pz")}, r"channels that differ: Cz \('eeg', 'V'\) and absent; Pz absent and"),
    ],
)
def test_runs_that_differ_are_not_joined(tmp_path, save, other, message):
    save(tmp_path / "p1_1_raw.fif")
    save(tmp_path / "p1_2_raw.fif", **other)
    with pytest.raises(DataError, match=message):
        run(tmp_path / "{subject}_*_raw.fif", tmp_path / "out")


def test_channels_in_another_order_are_put_in_the_first_run_s(tmp_path, save, noise_uv):
    save(tmp_path / "p1_1_raw.fif")
    save(tmp_path / "p1_2_raw.fif", names=("Cz", "Fz"))
    _, raw, _ = run(tmp_path / "{subject}_*_raw.fif", tmp_path / "out")
    np.testing.assert_allclose(raw.get_data(start=500) * 1e6, noise_uv(2, 500)[::-1], atol=1e-3)


@pytest.mark.parametrize("gone", ["rec.vhdr", "rec.eeg", "rec.vmrk"])
def test_a_link_to_a_file_that_is_not_here(tmp_path, save, gone):
    raw = mne.io.read_raw_fif(save(tmp_path / "x_raw.fif"), preload=True, verbose="error")
    mne.export.export_raw(tmp_path / "rec.vhdr", raw, verbose="error")
    (tmp_path / gone).unlink()
    (tmp_path / gone).symlink_to("../.git/annex/objects/XX/key/key")
    config = acquire.Config(source="file", path=str(tmp_path / "rec.vhdr"))
    with pytest.raises(DataError, match=rf"{gone} is a link to a file that is not here: .*annex") as caught:
        acquire.sources(config, "p1")
    assert f"git annex get '{gone}'" in caught.value.cure


def test_accents_may_be_written_in_two_ways(tmp_path, save):
    path = save(tmp_path / "Übung" / "größer_raw.fif")
    assert names(unicodedata.normalize("NFD", str(path))) == ["größer_raw.fif"]


def test_a_folder_says_which_file_to_name(tmp_path, save):
    save(tmp_path / "set/sub-01/eeg/sub-01_run-01_raw.fif")
    for folder in ("set", "set/sub-{subject}"):
        with pytest.raises(ConfigError, match="is a folder") as caught:
            names(tmp_path / folder, "01")
        assert "sub-{subject}/eeg/sub-{subject}_run-01_raw.fif" in caught.value.cure


def with_tables(tmp_path, save):
    path = save(tmp_path / "sub-01_task-x_eeg.fif")
    (tmp_path / "sub-01_task-x_events.tsv").write_text("onset\tduration\ttrial_type\n1.0\t0\ta\n2.0\t0\tb\n")
    (tmp_path / "sub-01_task-x_channels.tsv").write_text("name\ttype\tstatus\nFz\tEEG\tgood\nCz\tEEG\tbad\n")
    return path


def test_tables_beside_a_recording_are_named(tmp_path, save):
    summary, _, _ = run(with_tables(tmp_path, save), tmp_path / "out")
    assert "sub-01_task-x_events.tsv lies beside the recording and is not read: 2 events" in summary["notes"]
    assert any(note.endswith("it marks as bad: Cz (acquire.bads)") for note in summary["notes"])


def test_a_recording_whose_events_are_only_in_a_table(tmp_path, save):
    path = with_tables(tmp_path, save)
    raw = mne.io.read_raw_fif(path, preload=True, verbose="error").set_annotations(None)
    raw.save(path, overwrite=True, verbose="error")
    config = acquire.Config(source="file", path=str(path))
    with pytest.raises(DataError, match=r"has no events of its own; sub-01_task-x_events\.tsv beside it has 2"):
        acquire.run(config, Inputs("p1", {}), tmp_path)
    view = acquire.inspect(config, "p1")
    assert view["recording"]["duration_s"] == 5
    assert "events.tsv beside it has 2" in view["problems"][0]["problem"]


def test_a_plan_reads_no_samples(tmp_path, save):
    """Names of files decide which belong to a subject: a damaged one is found all the same."""
    path = save(tmp_path / "p1_raw.fif")
    shutil.copy(path, tmp_path / "p2_raw.fif")
    path.write_bytes(b"not a recording")
    assert names(tmp_path / "{subject}_raw.fif") == ["p1_raw.fif"]
