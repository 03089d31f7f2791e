"""rerp from outside: no part of a study that does not name it; its command, its numbers, its chapter, its refusals."""

import lab_study
import pytest

LAB = lab_study.text("s01", "s02")


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    (folder / "lab.toml").write_text(LAB)
    return folder


def test_a_study_that_does_not_name_it_has_none(hrcneuro, lab):
    (lab / "run.toml").write_text('config = "lab.toml"\n')
    done = hrcneuro("run", lab / "run.toml", "--dry-run", "--json", "--workdir", lab / "none")
    assert done.code == 0, done.err
    assert not any(key.startswith("rerp") for key in done.states)


def test_it_runs_once_says_what_came_out_and_stands_in_the_report(hrcneuro, lab):
    given = ("--config", lab / "lab.toml", "--workdir", lab / "work")
    first = hrcneuro("rerp", "--json", *given)
    assert first.code == 0, first.err
    assert {first.states[f"rerp {unit}"] for unit in ("s01", "s02", "group")} == {"ran"}
    again = hrcneuro("rerp", *given)
    assert "rerp: 9 fresh" in again.err
    shown = hrcneuro("show", "rerp", "group", *given)
    assert "potential ~ actor / takeover + error + prev_error + turn + soa; overlap regressed out" in shown.out
    assert "actor[robot]:takeover" in shown.out
    group = next(i["artifacts"] for i in first.json["items"] if (i["stage"], i["unit"]) == ("rerp", "group"))
    assert {"rerp_stats.parquet", "rerp_parts.parquet"} <= set(group)
    # Without the pictures of other stages, which take longer than all else here.
    assert hrcneuro("erp", "--no-figures", *given).code == 0
    named = 'study.stages=["acquire", "preprocess", "epoch", "erp", "rerp"]'
    report = hrcneuro("report", "--no-figures", "--set", named, *given)
    assert report.code == 0, report.err
    page = (lab / "work" / "results" / "report.html").read_text()
    assert "Potentials by regression" in page
    assert "one model beside the strata" in page
    assert "iC: all trials in one model" in page
    # One formula more, and only its own stage runs.
    other = hrcneuro("rerp", "--no-figures", "--json", "--set", "rerp.formula=actor / takeover + turn", *given)
    assert other.code == 0, other.err
    assert {key for key, state in other.states.items() if state == "ran"} == {
        "rerp s01",
        "rerp s02",
        "rerp group",
    }


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        ("actor + tunr", "names the column 'tunr' (did you mean 'turn'?)"),
        ("actor +", "cannot be read"),
        ("actor + case", "case[T.RR] = actor[T.robot] - case[T.HR]"),
    ],
)
@pytest.mark.parametrize("command", [("rerp",), ("rerp", "--dry-run")])
def test_a_formula_that_cannot_be_is_refused_before_anything_runs(hrcneuro, lab, formula, words, command):
    done = hrcneuro(
        *command, "--config", lab / "lab.toml", "--workdir", lab / "new", "--set", f"rerp.formula={formula}"
    )
    assert done.code == 2
    assert words in done.err
    assert "cure:" in done.err
    assert not list((lab / "new").rglob("*.fif"))
