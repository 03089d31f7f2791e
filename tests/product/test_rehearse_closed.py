"""The closed loop rehearsed at virtual pace and small size: calibrated, decided, learned, acted by, scored."""

import json
from pathlib import Path

import pandas as pd
import pytest

from hrcneuro.cli.rehearsing_real import _last_words

pytest.importorskip("pyxdf", reason="needs the extra xdf")

LAB = """
[study]
name = "lab"
subjects = ["s01"]
exclude = []

[acquire]
sfreq = 128.0

[acquire.session]
practice_episodes = 0
blocks = 3
episodes_per_block = 4

[acquire.eeg]
dipoles = 20

[preprocess]
sfreq = 128.0

[calibrate]
draws = 2

[experiment.closed]
blocks = 2
episodes_per_block = 3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    (folder / "lab.toml").write_text(LAB)
    return folder


def rehearse(hrcneuro, folder, *words):
    shared = ["--closed", "--config", folder / "lab.toml", "--executor", "serial", "--json"]
    return hrcneuro("rehearse", "s01", *shared, *words, "--workdir", folder)


@pytest.fixture(scope="module")
def rehearsed(hrcneuro, folder):
    done = rehearse(hrcneuro, folder)
    assert done.code == 0, done.err
    return done.json


@pytest.fixture(scope="module")
def decoder(rehearsed):
    (found,) = Path(rehearsed["folder"]).glob("cache/calibrate/s01/*/decoder.json")
    return found.parent


def logs(about):
    """Return the lines of the experiment's log and of the loop's, of the first session."""
    place = Path(about["folder"]) / "closed-001"
    texts = (place / "recordings" / "s01" / "closed" / "experiment.jsonl", place / "decisions.jsonl")
    return [[json.loads(line) for line in path.read_text().splitlines()] for path in texts]


def test_it_is_calibrated_decided_and_learned(rehearsed):
    done, decided = logs(rehearsed)
    assert (rehearsed["sessions"], rehearsed["episodes"]) == (1, 6)
    moves = [line for line in decided if line["kind"] == "move"]
    assert len(moves) == sum(line["kind"] == "move" for line in done) == sum(rehearsed["steps"].values())
    assert all(line["deadline_met"] for line in moves)
    assert {line["cause"] for line in moves} <= {"", "last", "diagonal"}
    assert rehearsed["updates"] == sum(line["update"] for line in moves)


def test_the_robot_draws_from_what_had_been_learned_by_then(rehearsed):
    """The policy that it drew from is the last one that came before keys opened."""
    done, decided = logs(rehearsed)
    learned = {line["marker"]: line["policy_after"] for line in decided if line["kind"] == "move"}
    now = dict.fromkeys("NESW", 0.5)
    for line in done:
        if line["kind"] == "policy":
            assert line["marker"] == "" or line["policy"] == learned[line["marker"]]
            now = line["policy"]
        elif line["kind"] == "choice" and len(line["step"]) == 1:
            assert line["human"] == now[line["step"]]


def test_the_recording_decides_alike_to_the_last_bit(rehearsed):
    (one,) = rehearsed["replay"]
    assert one["equal"] > 0
    assert (one["different"], one["unknown"]) == (0, 0)


def test_its_tables_and_its_page_are_there(rehearsed):
    folder = Path(rehearsed["folder"])
    steps, episodes = (pd.read_parquet(folder / f"loop_{name}.parquet") for name in ("steps", "episodes"))
    assert len(steps) == sum(rehearsed["steps"].values())
    assert len(episodes) == 6
    page = (folder / "rehearsal.html").read_text()
    assert "SYNTHETIC" in page
    assert "RR against RH" in page or "RRvsRH" in page
    assert "loop.png" in page
    assert (folder / "loop.png").stat().st_size > 10_000


def test_sessions_do_not_depend_on_how_many_run_beside_them(hrcneuro, folder, decoder):
    numbers = ["--decoder", decoder, "--no-figures", "--set", "experiment.closed.blocks=1"]
    alone = rehearse(hrcneuro, folder, *numbers, "-j", "1")
    both = rehearse(hrcneuro, folder, *numbers, "--sessions", "2", "-j", "2")
    assert (alone.code, both.code) == (0, 0), alone.err + both.err
    assert both.json["page"] is None
    assert not (Path(both.json["folder"]) / "rehearsal.html").exists()
    tables = [pd.read_parquet(Path(done.json["folder"]) / "loop_steps.parquet") for done in (alone, both)]
    first = tables[1][tables[1]["session"] == "001"].reset_index(drop=True)
    assert len(tables[1]) > len(first) == len(tables[0])
    for name in ("step", "owner", "drawn", "actor", "human", "predicted", "update"):
        assert first[name].astype(object).equals(tables[0][name].astype(object)), name


def test_in_shadow_each_makes_the_own_steps_and_the_learner_looks_on(hrcneuro, folder, decoder):
    done = rehearse(hrcneuro, folder, "--decoder", decoder, "--mode", "shadow")
    assert done.code == 0, done.err
    assert not {"taken from the person", "left lying"} & set(done.json["steps"])
    assert done.json["updates"] > 0


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--mode", "open"], 2, "shadow, semi, closed"),
        (["--pace", "real", "--sessions", "3"], 2, "--sessions 3 at real pace"),
        (["--decoder", "nowhere"], 3, "nowhere"),
        (["--set", "experiment.closed.blocks=0"], 2, "experiment.closed.blocks"),
    ],
)
def test_mistakes_are_told(hrcneuro, folder, words, code, said):
    done = rehearse(hrcneuro, folder, *words)
    assert (done.code, said in done.err) == (code, True), done.err


def test_of_a_part_that_ended_the_problem_is_told_not_its_cure(tmp_path):
    said = tmp_path / "online.txt"
    for text, told in (
        ("looking\nerror: the EEG is missing\n  cure: start it\n", "the EEG is missing"),
        ("one\ntwo\n", "two"),
        ("", "without a word"),
    ):
        said.write_text(text)
        assert _last_words(said) == told


@pytest.mark.parametrize("words", [("--sessions", "2"), ("--decoder", "somewhere")])
def test_what_is_of_closed_blocks_is_refused_without_them(hrcneuro, tmp_path, words):
    done = hrcneuro("rehearse", "s01", *words, "--workdir", tmp_path)
    assert (done.code, f"{words[0]} without --closed" in done.err) == (2, True), done.err
    assert not list(tmp_path.iterdir())


def test_closed_blocks_need_the_loop(hrcneuro, tmp_path):
    words = ["experiment", "s01", "--closed", "--human", "simulated", "--workdir", tmp_path]
    done = hrcneuro(*words, "--pace", "virtual")
    assert (done.code, "rehearse" in done.err) == (2, True), done.err
    done = hrcneuro(*words, "--backend", "none", "--no-screen", "--no-lsl")
    assert (done.code, "experiment.markers" in done.err) == (2, True), done.err
