"""Bad input from the command line: one message with a cure, the right exit code, and the other subjects go on."""

import importlib.util
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tiny_study import half_written

from hrcneuro.paradigm.session import SessionParams, simulate_session

SFREQ = 128.0
LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 89000000\n"


def _writers():
    path = Path(__file__).parents[1] / "sources" / "conftest.py"
    spec = importlib.util.spec_from_file_location("writers_of_recordings", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


WRITERS = _writers()


def moves(seed):
    params = SessionParams(practice_episodes=1, blocks=2, episodes_per_block=2)
    return simulate_session(params, rng=np.random.default_rng(seed))


def write_recording(folder, subject, trials, *, change=lambda data: data, events=None):
    samples = int((trials["onset_s"].max() + 3) * SFREQ)
    marks = [(33025, round(t * SFREQ) + 1) for t in trials["onset_s"]] if events is None else events
    data = change(WRITERS.eeg_uv(len(WRITERS.NAMES), samples))
    WRITERS.save_set(folder / subject / f"{subject}.set", data, WRITERS.NAMES, SFREQ, marks)


@pytest.fixture(scope="session")
def sound_study(tmp_path_factory):
    """Two subjects in the authors' layout."""
    folder = tmp_path_factory.mktemp("layout") / "study"
    for seed, subject in enumerate(("s01", "s02")):
        trials = moves(seed)
        WRITERS.save_log(folder, subject, trials)
        write_recording(folder, subject, trials)
    return folder


@pytest.fixture
def study(sound_study, tmp_path):
    """A copy of the two subjects, for a test to spoil the first of them."""
    return Path(shutil.copytree(sound_study, tmp_path / "study"))


def given(study, workdir, *more):
    values = ("acquire.source=dataset", f"acquire.path={study}", 'study.subjects=["s01", "s02"]', *more)
    rates = ("preprocess.sfreq=128", "preprocess.h_freq=40", "ersp.high_hz=40")
    return [
        *(word for value in (*values, *rates) for word in ("--set", value)),
        *("--workdir", workdir, "--executor", "serial", "--json"),
    ]


def truncate(path, share):
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])


def add_rows(path, count):
    rows = pd.read_csv(path)
    pd.concat([rows, rows.tail(count)]).to_csv(path, index=False)


def spoil_channel(value):
    def change(data):
        data = data.copy()
        data[4, 100:200] = value
        return data

    return change


SPOILT = {
    "no fdt": (lambda s: (s / "s01.fdt").unlink(), ["s01.fdt"]),
    "truncated fdt": (lambda s: truncate(s / "s01.fdt", 0.6), ["s01.fdt"]),
    "truncated set": (lambda s: truncate(s / "s01.set", 0.4), ["s01.set"]),
    "LFS pointer": (lambda s: (s / "s01.fdt").write_bytes(LFS), ["Git LFS", "git lfs pull"]),
    "LFS pointer for the set": (lambda s: (s / "s01.set").write_bytes(LFS), ["Git LFS", "git lfs pull"]),
    "no set": (lambda s: (s / "s01.set").unlink(), ["s01.set"]),
    "no log": (lambda s: (s / "subject01.csv").unlink(), ["subject01.csv"]),
    "empty log": (lambda s: (s / "subject01.csv").write_text(""), ["subject01.csv"]),
    "binary log": (lambda s: (s / "subject01.csv").write_bytes(b"\x00\xff" * 500), ["subject01.csv"]),
    "three rows too many": (lambda s: add_rows(s / "subject01.csv", 3), ["33025", "markers", "log"]),
    "no events": (lambda s: write_recording(s.parent, "s01", moves(0), events=[]), ["marker"]),
    "channel that is no number": (
        lambda s: write_recording(s.parent, "s01", moves(0), change=spoil_channel(np.nan)),
        ["Cz"],
    ),
    "infinite channel": (
        lambda s: write_recording(s.parent, "s01", moves(0), change=spoil_channel(np.inf)),
        ["Cz"],
    ),
    "no subject folder": (lambda s: shutil.rmtree(s), ["s01", "s02"]),
}


@pytest.mark.parametrize("name", SPOILT)
def test_a_spoilt_subject_fails_with_a_cure_and_the_other_goes_on(hrcneuro, study, tmp_path, name):
    spoil, words = SPOILT[name]
    spoil(study / "s01")
    work = tmp_path / "work"
    done = hrcneuro("acquire", *given(study, work))
    assert done.code == 3, done.err
    assert done.states == {"acquire s01": "failed", "acquire s02": "ran"}
    error = done.json["items"][0]["error"]
    assert error["cure"]
    for word in words:
        assert word in f"{error['problem']} {error['cure']}"
    assert "Traceback" not in done.err
    assert done.err.count("error: ") == 1
    assert "unexpected" not in done.err
    assert half_written(work) == []
    assert sorted(p.name for p in work.glob("cache/acquire/*")) in (["s02"], ["s01", "s02"])
    assert list(work.glob("cache/acquire/s01/*")) == []


def test_the_log_of_another_subject_is_refused_with_both_histograms(hrcneuro, study, tmp_path):
    for kind in ("subject", "metadata"):
        (study / "s01" / f"{kind}01.csv").write_bytes((study / "s02" / f"{kind}02.csv").read_bytes())
    done = hrcneuro("acquire", *given(study, tmp_path / "work"))
    assert (done.code, done.states["acquire s02"]) == (3, "ran")
    problem = done.json["items"][0]["error"]["problem"]
    assert re.search(r"first|disagree|differ", problem)
    assert "33025" in problem


def test_a_flat_channel_is_repaired_and_named(hrcneuro, study, tmp_path):
    write_recording(study, "s01", moves(0), change=lambda data: np.where(np.arange(9)[:, None] == 4, 0, data))
    done = hrcneuro("preprocess", *given(study, tmp_path / "work"))
    assert done.code == 0, done.err
    summary = {f"{i['stage']} {i['unit']}": json.dumps(i["summary"]) for i in done.json["items"]}
    assert "Cz" in summary["preprocess s01"]
    assert "Cz" not in summary["preprocess s02"]


def test_a_condition_without_trials_is_left_out_and_said(hrcneuro, tiny):
    rest = ("--workdir", tiny / "study", "--json", "--executor", "serial", "--config", tiny / "tiny.toml")
    done = hrcneuro("epoch", "s01", *rest)
    assert done.code == 0, done.err
    assert any("no epoch of" in note for note in done.json["items"][-1]["summary"]["warnings"])


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ('acquire.drop=["Cx"]', ["Cx", "Cz"]),
        ('acquire.bads=["Cx"]', ["Cx", "Cz"]),
        ('acquire.channel_types={Cx = "eog"}', ["Cx", "Cz"]),
        ('acquire.channel_map={Cx = "Oz"}', ["Cx", "Cz"]),
        ("acquire.onset_event=4711", ["4711", "33025"]),
    ],
)
def test_an_unknown_channel_or_marker_names_those_there_are(hrcneuro, study, tmp_path, setting, words):
    done = hrcneuro("acquire", "s01", *given(study, tmp_path / "work", setting))
    assert done.code in (2, 3), done.err
    error = done.json["items"][0]["error"]
    for word in words:
        assert word in f"{error['problem']} {error['cure']}"
    assert error["cure"]


def test_a_subject_that_does_not_exist_and_a_typo_stop_before_anything_is_written(hrcneuro, study, tmp_path):
    for words in (
        ["acquire", "s03"],
        ["acquire", "--set", "acquire.pathh=x"],
        ["acquire", "--set", "preprocess.l_freq=-1"],
    ):
        done = hrcneuro(*words, *given(study, tmp_path / "work"))
        assert done.code == 2
        assert done.json["ok"] is False
        assert done.json["error"]["cure"]
    assert not (tmp_path / "work").exists()
