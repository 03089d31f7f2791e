"""Export in the authors' layout: what is written is what the same data set reader gives back."""

from __future__ import annotations

import builtins
from pathlib import Path

import mne
import numpy as np
import pandas as pd
import pytest

from hrcneuro.contract import Inputs
from hrcneuro.errors import ConfigError
from hrcneuro.export import authors as export
from hrcneuro.io.fif import read_raw
from hrcneuro.io.tables import read_table
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.sources.authors_log import same_moves, write_log, write_metadata
from hrcneuro.sources.logs import read_log
from hrcneuro.sources.origin import SYNTHETIC
from hrcneuro.stages import acquire

LOGS = Path(__file__).parents[2] / "../shared/data/HRC_neurobased_taskplanning"
SHORT = acquire.Config(
    session=SessionParams(practice_episodes=1, blocks=2, episodes_per_block=2),
    timing=TimingParams(break_s=1.0, pause_s=1.0),
    sfreq=128.0,
)


@pytest.fixture
def acquired(tmp_path):
    """Run acquire; return its folder."""

    def run(name="made", config=SHORT, unit="s01"):
        out = tmp_path / name
        out.mkdir()
        acquire.run(config, Inputs(unit, {}), out)
        return out

    return run


@pytest.fixture
def exported(tmp_path):
    """Export what lies in a folder of acquire; return what is told."""

    def write(made, folder=None, *, unit="s01", key="abc", study="123"):
        folder = folder or tmp_path / "layout"
        export.prepare(folder, [unit], study=study)
        files = made / f"{unit}_raw.fif", made / "trials.parquet"
        return export.export_subject(*files, folder, unit, key=key, study=study, origins=SYNTHETIC)

    return write


def same(first, second, *, but=()):
    """Hold that two folders of acquire have the same trials, samples, channels and breaks."""
    trials, again = (read_table(folder / "trials.parquet") for folder in (first, second))
    pd.testing.assert_frame_equal(
        trials.drop(columns=list(but)), again.drop(columns=list(but)), check_categorical=False
    )
    one, other = (read_raw(folder / "s01_raw.fif") for folder in (first, second))
    assert one.ch_names == other.ch_names
    assert one.get_channel_types() == other.get_channel_types()
    np.testing.assert_allclose(other.get_data(), one.get_data(), rtol=1e-6, atol=1e-12)
    at, there = (np.array([ch["loc"][:3] for ch in raw.info["chs"]]) for raw in (one, other))
    np.testing.assert_allclose(there, at, atol=1e-6)
    marks, marks_again = ([(a["onset"], a["description"]) for a in raw.annotations] for raw in (one, other))
    assert marks == marks_again


def dataset(folder, **options):
    return acquire.Config(source="dataset", path=str(folder), **options)


def test_a_simulated_subject_comes_back_whole(tmp_path, acquired, exported):
    made = acquired()
    told = exported(made)
    assert told["state"] == "ran"
    assert told["notes"] == []
    assert {p.name for p in (tmp_path / "layout" / "s01").iterdir()} == set(told["files"])
    # How long a motion takes is in no log.
    same(made, acquired("again", dataset(tmp_path / "layout")), but=["t_f_s"])


def test_fractional_onsets_repeated_labels_and_lost_practice_markers_come_back(tmp_path, study, acquired, exported):
    study(practice=False, jitter=0.3)
    made = acquired("made", dataset(tmp_path / "study", onset_event="33025"))
    onset = read_table(made / "trials.parquet")["onset_s"]
    assert (onset.dropna() * 256 % 1 > 0.2).all()
    assert onset.isna().any()
    exported(made)
    again = acquired("again", dataset(tmp_path / "layout"))
    trials, same_trials = (read_table(folder / "trials.parquet") for folder in (made, again))
    np.testing.assert_allclose(same_trials["onset_s"], onset, atol=1e-9)
    same(made, again, but=["onset_s", "soa_s"])
    assert trials["soa_s"].isna().equals(same_trials["soa_s"].isna())


def test_breaks_and_spoilt_spans_come_back(tmp_path, acquired, exported):
    made = acquired()
    raw = read_raw(made / "s01_raw.fif", preload=True)
    at = 1000 / 128
    raw.annotations.append([at, at, 3.0], [0, 0, 1.5], ["BAD boundary", "EDGE boundary", "BAD_talk"])
    raw.save(made / "s01_raw.fif", overwrite=True, verbose="error")
    exported(made)
    again = read_raw(acquired("again", dataset(tmp_path / "layout")) / "s01_raw.fif")
    found = {(a["description"], round(float(a["onset"]), 6), float(a["duration"])) for a in again.annotations}
    assert {("BAD boundary", at, 0.0), ("EDGE boundary", at, 0.0), ("BAD_talk", 3.0, 1.5)} <= found


def test_mne_opens_the_set_with_numeric_codes_and_positions(tmp_path, acquired, exported):
    made = acquired()
    exported(made)
    raw = mne.io.read_raw_eeglab(tmp_path / "layout/s01/s01.set", preload=True, verbose="error")
    assert set(raw.annotations.description.astype(float)) == {33025.0}
    assert raw.get_channel_types() == ["eeg"] * 27 + ["eog"] * 3
    assert len(raw.get_montage().ch_names) == 27
    samples = (tmp_path / "layout/s01/s01.fdt").stat().st_size / 30 / 4
    assert samples == raw.n_times


def test_the_same_recording_gives_the_same_bytes(tmp_path, acquired, exported):
    made = acquired()
    for name in ("one", "two"):
        exported(made, tmp_path / name)
    for path in (tmp_path / "one/s01").iterdir():
        assert path.read_bytes() == (tmp_path / "two/s01" / path.name).read_bytes(), path.name


def test_the_header_says_that_the_recording_is_synthetic_and_names_no_folder(tmp_path, acquired, exported):
    exported(acquired())
    text = (tmp_path / "layout/s01/s01.set").read_bytes()
    assert b"SYNTHETIC: behaviour and EEG were simulated by hrcneuro" in text
    assert str(tmp_path).encode() not in text


@pytest.mark.parametrize("subject", [f"s{k:02d}" for k in range(1, 13)])
def test_the_real_logs_come_back_byte_for_byte(tmp_path, subject):
    if not LOGS.is_dir():
        pytest.skip("the authors' logs are not there (../shared/data)")
    trials = read_log(LOGS, subject)
    number = subject[1:]
    write_log(trials, tmp_path / f"subject{number}.csv")
    write_metadata(trials, tmp_path / f"metadata{number}.csv")
    for name in (f"subject{number}.csv", f"metadata{number}.csv"):
        assert (tmp_path / name).read_bytes() == (LOGS / subject / name).read_bytes()


@pytest.mark.parametrize("seed", range(20))
def test_short_sessions_come_back_though_they_show_few_directions(tmp_path, moves, seed):
    trials = moves(seed)
    home = tmp_path / "s01"
    home.mkdir()
    write_log(trials, home / "subject01.csv")
    write_metadata(trials, home / "metadata01.csv")
    assert same_moves(trials, read_log(tmp_path, "s01")) == []


def test_a_changed_move_is_noticed(moves):
    trials = moves(1)
    other = trials.assign(intended=trials["intended"].where(trials.index != 5, "?"))
    assert same_moves(trials, other) == ["intended"]
    assert "row" in same_moves(trials, trials.iloc[:-1])


def test_a_second_export_is_a_hit_and_a_new_key_replaces(tmp_path, acquired, exported):
    made = acquired()
    exported(made)
    fdt = tmp_path / "layout/s01/s01.fdt"
    stamp = fdt.stat().st_mtime_ns
    assert exported(made)["state"] == "hit"
    assert fdt.stat().st_mtime_ns == stamp
    assert exported(made, key="abd")["state"] == "ran"
    fdt.unlink()
    assert exported(made, key="abd")["state"] == "ran"
    assert [p.name for p in (tmp_path / "layout").iterdir()] == ["s01"]


def test_another_study_and_foreign_folders_are_left_alone(tmp_path, acquired, exported, study):
    made = acquired()
    exported(made)
    with pytest.raises(ConfigError, match="other settings"):
        exported(made, unit="s02", study="124")
    study()
    before = {p: p.read_bytes() for p in (tmp_path / "study/s01").iterdir()}
    for unit in ("s01", "s02"):
        with pytest.raises(ConfigError, match="not written by hrcneuro"):
            exported(made, tmp_path / "study", unit=unit)
    assert {p: p.read_bytes() for p in (tmp_path / "study/s01").iterdir()} == before


def test_a_folder_that_cannot_be_is_refused(tmp_path, acquired, exported):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="is a file"):
        exported(tmp_path, tmp_path / "file")
    with pytest.raises(ConfigError, match="cannot be written"):
        exported(acquired(), tmp_path / "file" / "below")
    with pytest.raises(ConfigError, match="demo"):
        export.prepare(tmp_path / "new", ["demo"], study="1")


def test_a_recording_of_another_paradigm_is_refused(tmp_path, study, acquired, exported):
    study()
    config = acquire.Config(source="file", path=str(tmp_path / "study/{subject}/{subject}.set"))
    with pytest.raises(ConfigError, match="no session of the study"):
        exported(acquired("made", config))
    assert not (tmp_path / "layout").exists()


def test_an_interrupted_export_leaves_nothing(tmp_path, acquired, exported, monkeypatch):
    made = acquired()

    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("hrcneuro.sources.authors_log.write_metadata", stop)
    with pytest.raises(KeyboardInterrupt):
        exported(made)
    assert list((tmp_path / "layout").iterdir()) == []


def test_without_eeglabio_the_cure_is_named(tmp_path, monkeypatch):
    real = builtins.__import__

    def missing(name, *arguments, **named):
        if name.startswith("eeglabio"):
            raise ImportError(name)
        return real(name, *arguments, **named)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(ConfigError, match="eeglabio") as error:
        export.prepare(tmp_path, ["s01"], study="1")
    assert "hrcneuro[export]" in error.value.cure
