"""The Python API: what has run, as MNE objects and pandas tables."""

import subprocess
import sys
from pathlib import Path

import pytest

import hrcneuro as package
from hrcneuro.errors import DataError

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def study(smoke):
    return package.open(smoke, "smoke")


def test_importing_the_package_loads_nothing_heavy():
    code = "import hrcneuro, sys; print(sorted({'mne', 'numpy', 'pandas', 'typer'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_results_and_their_folder_are_the_same_study(smoke, study, monkeypatch):
    assert package.open(smoke / "results", "smoke").subjects == study.subjects == ("s01", "s02", "s03")
    # Whatever ran last in this folder may have had stages beyond the study's.
    last = package.open(smoke, last=True).stages
    assert package.open(str(smoke), "smoke").stages == study.stages == {name: last[name] for name in study.stages}
    monkeypatch.chdir(smoke)
    assert package.open("results", "smoke").subjects == study.subjects
    assert "s01, s02, s03" in repr(package.open(config="smoke"))


def test_a_study_is_what_its_configuration_asks_for(smoke, study, tmp_path):
    other = package.open(smoke, "smoke", ["epoch.reject_uv=900"])
    assert set(other.stages) == {"acquire", "preprocess", "simulate", "robot"}
    for call in (other.epochs, lambda unit: other.summary("epoch", unit), lambda unit: other.show("epoch", unit)):
        with pytest.raises(DataError, match=r"params: epoch\.reject_uv 1000\.0 -> 900\.0"):
            call("s01")
    assert other.path("preprocess", "s01") == study.path("preprocess", "s01")
    last = package.open(smoke, "smoke", ["epoch.reject_uv=900"], last=True)
    assert last.path("epoch", "s01") == study.path("epoch", "s01")
    assert last.summary("epoch", "s01") == study.summary("epoch", "s01")
    # The configuration in the study's own folder is found there.
    for name in ("results", "cache"):
        (tmp_path / name).symlink_to(smoke / name)
    text = (ROOT / "configs" / "smoke.toml").read_text()
    (tmp_path / "hrcneuro.toml").write_text(text)
    assert package.open(tmp_path).stages == study.stages
    (tmp_path / "hrcneuro.toml").write_text(text.replace("repeats = 2", "repeats = 1"))
    assert "decode" not in package.open(tmp_path).stages
    assert "<table>" in package.open(tmp_path)._repr_html_()


def test_recordings_epochs_and_averages_are_plain_mne_objects(study):
    import mne

    raw, clean, epochs, evokeds = study.raw("s01"), study.clean("s01"), study.epochs("s01"), study.evokeds("s01")
    assert isinstance(raw, mne.io.BaseRaw)
    assert not raw.preload
    assert clean.info["sfreq"] == epochs.info["sfreq"] == 128
    assert len(clean.ch_names) == 27
    assert len(epochs) == len(epochs.metadata)
    assert all(isinstance(e, mne.Evoked) for e in evokeds.values())
    # The trials whose next move is the takeover, averaged here and by the stage.
    named = epochs["before_RH"].apply_baseline((-0.2, 0), verbose="error")
    assert evokeds["all/RH_before"].nave == len(named)
    assert abs(evokeds["all/RH_before"].data - named.average().data).max() < 1e-9


def test_tables_and_summaries(study):
    trials = study.trials("s01")
    assert trials.equals(study.table("acquire", "s01", "trials.parquet"))
    assert set(study.table("preprocess", "s01", "quality.parquet")["channel"]) == set(study.clean("s01").ch_names)
    assert study.summary("epoch", "s01")["epochs"] == len(study.epochs("s01"))
    assert not study.table("epoch", "s01", "conditions.parquet").empty


def test_mistakes_name_the_cure(study, tmp_path):
    for call, words in (
        (lambda: study.raw("s1"), "did you mean 's0"),
        (lambda: study.table("epok", "s01"), "did you mean 'epoch'"),
        (lambda: study.table("simulate", "group"), "curves.parquet"),
        (lambda: study.table("epoch", "s01"), "name one of: conditions.parquet, drop_log.parquet"),
        (lambda: study.table("epoch", "s01", "nothing.parquet"), "conditions.parquet"),
        (lambda: package.open(tmp_path), "holds no results"),
    ):
        with pytest.raises(DataError) as caught:
            call()
        assert words in str(caught.value)
