"""Bad input from the command line: one message with a cure, the right exit code, and the other subjects go on."""

import json
import re
import shutil
from pathlib import Path

import foreign
import numpy as np
import pandas as pd
import pytest
from tiny_study import half_written

from hrcneuro.paradigm.session import SessionParams, simulate_session

SFREQ = 128.0
LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 89000000\n"


def moves(seed):
    params = SessionParams(practice_episodes=1, blocks=2, episodes_per_block=2)
    return simulate_session(params, rng=np.random.default_rng(seed))


def write_recording(folder, subject, trials, *, change=lambda data: data, events=None):
    samples = int((trials["onset_s"].max() + 3) * SFREQ)
    marks = [(33025, round(t * SFREQ) + 1) for t in trials["onset_s"]] if events is None else events
    data = change(foreign.eeg_uv(len(foreign.NAMES), samples))
    foreign.save_set(folder / subject / f"{subject}.set", data, foreign.NAMES, SFREQ, marks)


@pytest.fixture(scope="session")
def sound_study(tmp_path_factory):
    """Two subjects in the authors' layout."""
    folder = tmp_path_factory.mktemp("layout") / "study"
    for seed, subject in enumerate(("s01", "s02")):
        trials = moves(seed)
        foreign.save_log(folder, subject, trials)
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
    "no fdt": (lambda s, n: (s / f"{n}.fdt").unlink(), [".fdt"]),
    "truncated fdt": (lambda s, n: truncate(s / f"{n}.fdt", 0.6), [".fdt"]),
    "truncated set": (lambda s, n: truncate(s / f"{n}.set", 0.4), [".set"]),
    "LFS pointer": (lambda s, n: (s / f"{n}.fdt").write_bytes(LFS), ["Git LFS", "git lfs pull"]),
    "LFS pointer for the set": (lambda s, n: (s / f"{n}.set").write_bytes(LFS), ["Git LFS", "git lfs pull"]),
    "no set": (lambda s, n: (s / f"{n}.set").unlink(), [".set"]),
    "no log": (lambda s, n: (s / f"subject{n[1:]}.csv").unlink(), ["subject", ".csv"]),
    "empty log": (lambda s, n: (s / f"subject{n[1:]}.csv").write_text(""), ["subject", ".csv"]),
    "binary log": (lambda s, n: (s / f"subject{n[1:]}.csv").write_bytes(b"\x00\xff" * 500), ["subject", ".csv"]),
    "three rows too many": (lambda s, n: add_rows(s / f"subject{n[1:]}.csv", 3), ["33025", "markers", "log"]),
    "no events": (lambda s, n: write_recording(s.parent, n, moves(0), events=[]), ["marker"]),
    "channel that is no number": (
        lambda s, n: write_recording(s.parent, n, moves(0), change=spoil_channel(np.nan)),
        ["Cz"],
    ),
    "infinite channel": (
        lambda s, n: write_recording(s.parent, n, moves(0), change=spoil_channel(np.inf)),
        ["Cz"],
    ),
    "no subject folder": (lambda s, n: shutil.rmtree(s), ["no subject", "subjects found"]),
}


@pytest.fixture(scope="module")
def spoilt(hrcneuro, sound_study, tmp_path_factory):
    """One run over a study of which every subject but the last is spoilt in another way: ``(done, items, work)``."""
    folder, work = tmp_path_factory.mktemp("spoilt") / "study", tmp_path_factory.mktemp("spoilt") / "work"
    names = [f"s{i:02d}" for i in range(1, len(SPOILT) + 2)]
    for name in names:
        shutil.copytree(sound_study / "s01", folder / name)
        for path in list((folder / name).iterdir()):
            path.rename(path.with_name(path.name.replace("01", name[1:])))
    for name, (spoil, _) in zip(names, SPOILT.values(), strict=False):
        spoil(folder / name, name)
    done = hrcneuro("acquire", *given(folder, work), "--set", f"study.subjects={names}")
    return done, dict(zip([*SPOILT, "sound"], done.json["items"], strict=True)), work


@pytest.mark.parametrize("name", SPOILT)
def test_a_spoilt_subject_fails_with_one_message_and_a_cure(spoilt, name):
    done, items, work = spoilt
    item = items[name]
    assert item["state"] == "failed"
    assert item["error"]["cure"]
    text = f"{item['error']['problem']} {item['error']['cure']}"
    for word in SPOILT[name][1]:
        assert word in text
    assert "unexpected" not in text
    # Units with the same trouble share a message.
    assert len(re.findall(rf"error: acquire of [^:]*\b{item['unit']}\b", done.err)) == 1
    assert list(work.glob(f"cache/acquire/{item['unit']}/*")) == []


def test_the_sound_subject_goes_on_and_the_exit_code_says_data(spoilt):
    done, items, work = spoilt
    assert done.code == 3
    assert items["sound"]["state"] == "ran"
    assert "Traceback" not in done.err
    assert half_written(work) == []
    assert len(list(work.glob("cache/acquire/*/*/record.json"))) == 1


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
    # White noise at every electrode: none is like another, which is said of each and rejects none.
    summary = {f"{i['stage']} {i['unit']}": {**i["summary"], "noisy": {}} for i in done.json["items"]}
    assert "Cz" in json.dumps(summary["preprocess s01"])
    assert "Cz" not in json.dumps(summary["preprocess s02"])


def test_a_condition_without_trials_is_left_out_and_said(hrcneuro, tiny):
    rest = ("--workdir", tiny / "study", "--json", "--executor", "serial", "--config", tiny / "tiny.toml")
    # An episode a scenario: most subjects lack a case or two, not each of them does.
    for seed in range(20):
        done = hrcneuro("epoch", "s01", *rest, "--no-figures", "--set", f"acquire.seed={seed}")
        assert done.code == 0, done.err
        (epoch,) = [item for item in done.json["items"] if item["stage"] == "epoch"]
        counts, notes = epoch["summary"]["counts"], epoch["summary"]["warnings"]
        absent = {(case, scenario) for scenario, cases in counts.items() for case, n in cases.items() if not n}
        said = set(re.findall(r"no epoch of (\w+) \(before\) in (\w+)", "\n".join(notes)))
        assert said == absent
        if absent:
            return
    raise AssertionError("no subject of the twenty lacks a case")


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ('acquire.drop=["cz"]', ["cz", "Cz"]),
        ('acquire.bads=["cz"]', ["cz", "Cz"]),
        ('acquire.channel_types={cz = "eog"}', ["cz", "Cz"]),
        ('acquire.channel_map={cz = "Oz"}', ["cz", "Cz"]),
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
