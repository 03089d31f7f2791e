"""calibrate from outside: no part of a study that does not name it; its command, its numbers, its chapter."""

import lab_study
import pytest

DRAWS = "\n[calibrate]\ndraws = 2\n"


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    (folder / "plain.toml").write_text(lab_study.text("s01", stages="", more=DRAWS))
    (folder / "asked.toml").write_text(
        lab_study.text("s01", stages='stages = ["acquire", "preprocess", "calibrate"]', more=DRAWS)
    )
    return folder


def test_a_study_that_does_not_name_it_has_none(hrcneuro, lab):
    (lab / "run.toml").write_text('config = "plain.toml"\n')
    done = hrcneuro("run", lab / "run.toml", "--dry-run", "--json", "--workdir", lab / "none")
    assert done.code == 0, done.err
    assert "robot s01" in done.states
    assert not any(key.startswith("calibrate") for key in done.states)


def test_it_runs_once_says_what_came_out_and_stands_in_the_report(hrcneuro, lab):
    given = ("--config", lab / "asked.toml", "--workdir", lab / "work")
    first = hrcneuro("calibrate", "s01", "--json", *given)
    assert first.code == 0, first.err
    assert {key: first.states[key] for key in ("calibrate s01", "calibrate.figures s01")} == {
        "calibrate s01": "ran",
        "calibrate.figures s01": "ran",
    }
    again = hrcneuro("calibrate", "s01", *given)
    assert "calibrate: 3 fresh" in again.err
    shown = hrcneuro("show", "calibrate", *given)
    assert "a decoder for 30 channels at 128 Hz, ready 602 ms after an onset" in shown.out
    assert shown.out.splitlines()[0] == "calibrate, s01"
    artifacts = next(item["artifacts"] for item in first.json["items"] if item["stage"] == "calibrate")
    assert {"decoder.npz", "decoder.json"} <= set(artifacts)
    report = hrcneuro("report", *given)
    assert report.code == 0, report.err
    page = (lab / "work" / "results" / "report.html").read_text()
    assert "A decoder for live use" in page
    assert "Held-out blocks, and rules without EEG" in page
    assert "What the decoder listens to" in page


def test_a_mistake_is_told_before_anything_runs(hrcneuro, lab):
    done = hrcneuro("calibrate", "--config", lab / "asked.toml", "--set", 'calibrate.matched=["turns"]')
    assert done.code == 2
    assert "[calibrate] matched names 'turns' (did you mean 'turn'?)" in done.err
