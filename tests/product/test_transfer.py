"""transfer from outside: no part of a study that does not name it; its command, numbers, chapter and refusals."""

import lab_study
import pytest

pytest.importorskip("pyriemann", reason="needs the extra decoders")

LAB = lab_study.text("s01", "s02", "s03", more="\n[transfer]\npairs = [5]\ndraws = 2\n")


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    (folder / "lab.toml").write_text(LAB)
    return folder


def test_a_study_that_does_not_name_it_has_none(hrcneuro, lab):
    (lab / "run.toml").write_text('config = "lab.toml"\n')
    done = hrcneuro("run", lab / "run.toml", "--dry-run", "--json", "--workdir", lab / "none")
    assert done.code == 0, done.err
    assert not any(key.startswith("transfer") for key in done.states)


def test_it_runs_once_says_what_came_out_and_stands_in_the_report(hrcneuro, lab):
    given = ("--config", lab / "lab.toml", "--workdir", lab / "work")
    first = hrcneuro("transfer", "--json", *given)
    assert first.code == 0, first.err
    assert {first.states[f"transfer {unit}"] for unit in ("s01", "s02", "s03", "group")} == {"ran"}
    found = {i["unit"]: i["artifacts"] for i in first.json["items"] if i["stage"] == "transfer"}
    assert {"scores.parquet", "curves.parquet", "tests.parquet", "compared.parquet"} <= set(found["group"])
    again = hrcneuro("transfer", *given)
    assert "ran" not in again.err.partition("transfer:")[2].splitlines()[0]
    shown = hrcneuro("show", "transfer", "group", *given)
    assert "RRvsRH, causal" in shown.out
    assert "recentred, none" in shown.out
    named = 'study.stages=["acquire", "preprocess", "epoch", "transfer"]'
    report = hrcneuro("report", "--no-figures", "--set", named, *given)
    assert report.code == 0, report.err
    page = (lab / "work" / "results" / "report.html").read_text()
    assert "Decoders without calibration" in page
    assert "Beside the subjects&#39; own decoders" in page or "Beside the subjects' own decoders" in page
    assert "a control that must come out at chance" not in page


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ('transfer.ways=["own", "poled"]', "did you mean 'pooled'?"),
        ("transfer.pairs=[1]", "transfer.pairs[0] = 1"),
        ("transfer.pairs=[20, 5]", "give numbers in rising order"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_runs(hrcneuro, lab, option, words):
    done = hrcneuro("transfer", "--config", lab / "lab.toml", "--workdir", lab / "new", "--set", option)
    assert done.code == 2
    assert words in done.err
    assert not list((lab / "new").rglob("*.fif"))
