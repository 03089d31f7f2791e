"""The dress rehearsal at virtual pace and small size: a session without a person, recorded, checked and analysed."""

import json
from pathlib import Path

import pandas as pd
import pytest

from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.session import simulate_session
from hrcneuro.sources.simulated import generator

pytest.importorskip("pyxdf", reason="needs the extra xdf")

SIZE = {"practice_episodes": 1, "blocks": 2, "episodes_per_block": 2}
WORDS = ["rehearse", "s01", "--config", "smoke", "--no-figures", "--executor", "serial", "--json"]
WORDS += [word for key, value in SIZE.items() for word in ("--set", f"acquire.session.{key}={value}")]
TIMES = {"onset_s", "t_f_s", "soa_s", "onset_sample"}


@pytest.fixture(scope="module")
def rehearsed(hrcneuro, tmp_path_factory):
    """Return how a rehearsal ended, and the folder in which it ran."""
    folder = tmp_path_factory.mktemp("rehearsal")
    return hrcneuro(*WORDS, "--workdir", folder), folder


def test_the_session_is_whole_and_so_is_its_recording(rehearsed):
    done, folder = rehearsed
    assert done.code == 0, done.err
    about = done.json
    session, eeg = about["session"], next(one for one in about["recording"] if one["stream"] == "eeg")
    assert about["ok"]
    assert session["whole"]
    assert (session["blocks"], session["stops"], session["late_packets"]) == (2 + SIZE["blocks"], 0, 0)
    assert (eeg["missing"], eeg["gaps"], eeg["flaws"]) == (0, 0, [])
    assert all(one["ok"] for one in about["rules"]), about["rules"]
    # Every move has its marker, and every marker its edge in the EEG.
    assert (about["timing"]["markers"], about["timing"]["without_edge"]) == (session["moves"], 0)
    assert Path(about["folder"]).is_relative_to(folder)
    # As of any recording.
    (notes,) = Path(about["folder"]).glob("recordings/s01/*/session.json")
    (part,) = json.loads(notes.read_text())["parts"]
    assert {"hrcneuro", "numpy"} <= set(part["versions"])
    assert {"file", "began", "clock_s", "state"} <= set(part)


def test_the_whole_grid_is_tried_once(monkeypatch, tmp_path):
    """Before anything is written; what was tried serves the session, too."""
    from hrcneuro.cli import rehearsing
    from hrcneuro.cli.options import Options
    from hrcneuro.robot.lookahead import LookAhead

    tried, grid = [], LookAhead.grid
    monkeypatch.setattr(LookAhead, "grid", lambda self, t_f: tried.append(t_f) or grid(self, t_f))
    monkeypatch.setattr(rehearsing, "_told", lambda *given, **named: 0)
    size = [f"acquire.session.{key}={value}" for key, value in SIZE.items()]
    options = Options(config=Path("smoke"), set=size, workdir=tmp_path)
    assert rehearsing.run(options, "s01", "virtual", screen=False, patient=False) == 0
    assert list(tmp_path.rglob("experiment.jsonl"))
    assert len(tried) == 1


def test_what_was_recorded_is_what_a_simulated_subject_does(rehearsed):
    (table,) = Path(rehearsed[0].json["folder"]).glob("cache/acquire/s01/*/trials.parquet")
    recorded = pd.read_parquet(table)
    moves = simulate_session(SessionParams(**SIZE), rng=generator(2023, "s01", "moves"))
    columns = [name for name in moves if name not in TIMES]
    assert len(columns) > 10
    one, other = (table[columns].astype(object).where(table[columns].notna(), None) for table in (recorded, moves))
    pd.testing.assert_frame_equal(one, other)


def test_it_is_analysed_or_says_where_trials_are_too_few(rehearsed):
    stages = rehearsed[0].json["stages"]
    assert list(stages) == ["acquire", "preprocess", "epoch", "erp", "decode"]
    assert stages["acquire"]["events"] == {"move": rehearsed[0].json["session"]["moves"]}
    decoded = stages["decode"]
    for scenario in ("iC", "sC"):
        for problem in ("HHvsHR", "RRvsRH"):
            few = any(text.startswith(f"{scenario} {problem}: not computed") for text in decoded["warnings"])
            assert few == (decoded[scenario][problem]["acc"] is None)


def test_the_page_tells_that_all_of_it_is_simulated(rehearsed):
    about = rehearsed[0].json
    page = Path(about["page"]).read_text()
    assert "SYNTHETIC" in page
    assert f"{about['session']['moves']} moves" in page


def test_a_dry_run_leaves_nothing(hrcneuro, tmp_path):
    done = hrcneuro(*WORDS, "--dry-run", "--workdir", tmp_path)
    assert (done.code, list(tmp_path.iterdir())) == (0, [])


@pytest.mark.parametrize(
    ("words", "said"), [(["s99"], "unknown subject 's99'"), (["s01", "--pace", "vitual"], "did you mean 'virtual'")]
)
def test_mistakes_are_told_before_anything_begins(hrcneuro, tmp_path, words, said):
    done = hrcneuro("rehearse", *words, "--workdir", tmp_path)
    assert (done.code, said in done.err) == (2, True), done.err
    assert list(tmp_path.iterdir()) == []


LABORATORY = [
    word
    for value in (
        *("robot.backend=ur", "robot.host=192.0.2.1", "robot.trigger.port=parallel", "experiment.drawn_tool=true"),
        *("robot.trigger.address=/dev/parport0", "robot.at_the_robot=true", "robot.markers=lsl"),
    )
    for word in ("--set", value)
]


def test_a_laboratorys_configuration_is_rehearsed_with_a_simulated_arm(hrcneuro, tmp_path):
    size = [word for key in SIZE for word in ("--set", f"acquire.session.{key}={'2' if key == 'blocks' else '1'}")]
    done = hrcneuro(*WORDS, *size, *LABORATORY, "--workdir", tmp_path)
    assert done.code == 0, done.err
    assert done.json["session"]["whole"]


@pytest.mark.parametrize("pace", ["virtual", "real"])
def test_either_pace_takes_a_laboratorys_configuration(hrcneuro, tmp_path, pace):
    done = hrcneuro("rehearse", "s01", "--pace", pace, *LABORATORY, "--dry-run", "--workdir", tmp_path)
    assert done.code == 0, done.err


def test_an_arm_that_cannot_work_in_its_cell_is_told_before_anything_begins(hrcneuro, tmp_path):
    done = hrcneuro("rehearse", "s01", "--set", "robot.cell.near_edge=1.5", "--workdir", tmp_path)
    assert done.code == 2, done.err
    assert list(tmp_path.iterdir()) == []
