"""Evidence is a result beside the simulations: named for once, kept by the logs' content, refused where it is none."""

import pytest

from tests.helpers import gaze_logs

SMALL = [
    word
    for option in ("repetitions=10", "episodes=30", "learner_repetitions=0", "confound=false", "evidence_repetitions=5")
    for word in ("--set", f"simulate.{option}")
]


@pytest.fixture(scope="module")
def held(hrcneuro, tmp_path_factory):
    folder = tmp_path_factory.mktemp("evidence")
    gaze_logs.write_study(folder / "logs", subjects=2)
    assert hrcneuro("simulate", *SMALL, "--workdir", folder, "-j", "1").code == 0
    return folder, hrcneuro("simulate", "--evidence", folder / "logs", *SMALL, "--workdir", folder, "-j", "1")


def states(hrcneuro, folder, *more):
    items = hrcneuro("status", *SMALL, *more, "--workdir", folder, "--json").json["items"]
    return {item["unit"]: item["state"] for item in items if item["stage"] == "simulate"}


def test_the_simulations_are_not_done_again_and_the_answer_is_printed(held):
    _, done = held
    assert done.code == 0, done.err
    assert "simulate: 1 fresh, 1 ran; pictures: 1 fresh, 1 ran" in done.err
    for words in ("6 sessions of 2 people, 300 trials", "the design tool asks for", "people who adapt are", "one path"):
        assert words in done.out
    assert "400 rows of policies" not in done.out  # run 3 is replayed, too
    assert "of 1,600 rows of policies" in done.out


def test_status_show_path_and_report_find_it_though_no_one_names_the_logs_again(hrcneuro, held):
    folder, done = held
    assert states(hrcneuro, folder) == {"group": "hit", "evidence": "hit"}
    shown = hrcneuro("show", "simulate", "evidence", *SMALL, "--workdir", folder)
    assert (shown.code, shown.err) == (0, "")
    assert shown.out.strip() in done.out
    assert hrcneuro("path", "simulate", "evidence", "sessions.parquet", *SMALL, "--workdir", folder).code == 0
    hrcneuro("report", *SMALL, "--workdir", folder)
    pages = [path.read_text() for path in folder.rglob("report.html")]
    assert any("id='evidence'" in page and "the design tool asks for" in page for page in pages)


def test_logs_elsewhere_are_the_same_evidence_and_others_are_not(hrcneuro, held, tmp_path):
    folder, _ = held
    copy = tmp_path / "copy"
    gaze_logs.write_study(copy, subjects=2)
    given = ("--evidence", copy, *SMALL, "--workdir", folder, "--dry-run", "--no-figures", "--json")
    items = {item["unit"]: item for item in hrcneuro("simulate", *given).json["items"]}
    assert items["evidence"]["state"] == "hit"
    (copy / "s04_corl4_log").unlink()
    items = {item["unit"]: item for item in hrcneuro("simulate", *given).json["items"]}
    assert items["evidence"]["state"] == "would-run"
    assert "corl4" in str(items["evidence"]["why"])
    assert items["group"]["state"] == "hit"


def test_it_stays_where_the_logs_have_gone_and_nothing_kept_says_where_they_were(hrcneuro, held):
    folder, _ = held
    away = (folder / "logs").rename(folder / "away")
    try:
        assert states(hrcneuro, folder) == {"group": "hit", "evidence": "hit"}
    finally:
        away.rename(folder / "logs")
    pointers = [*(folder / "results").rglob("*.json"), *(folder / "cache").rglob("record.json")]
    assert pointers
    assert not [path for path in pointers if str(folder) in path.read_text()]


def test_evidence_of_other_options_is_not_shown(hrcneuro, held):
    folder, _ = held
    assert states(hrcneuro, folder, "--set", "simulate.evidence_repetitions=6") == {"group": "hit"}


def test_other_people_s_logs_are_refused_before_anything_runs(hrcneuro, tmp_path):
    (tmp_path / "s01").mkdir()
    (tmp_path / "s01" / "subject01.csv").write_text("Scenario,Block,Episode\n")
    work = tmp_path / "work"
    done = hrcneuro("simulate", "--evidence", tmp_path, *SMALL, "--workdir", work)
    assert done.code == 3
    assert "s01/subject01.csv, a trial log of the study on the grid" in done.err
    assert "cure: name the folder data_coadaptation" in done.err
    assert not list(work.glob("cache/simulate/*"))


def test_a_log_that_was_cut_off_is_refused_before_anything_runs(hrcneuro, tmp_path):
    one, _ = gaze_logs.session("s03", 1, seed=0)
    path = gaze_logs.write_log(tmp_path, one)
    path.write_text("\n".join(path.read_text().splitlines()[:30]))
    for command in ("simulate", ("config", "check")):
        words = (command,) if isinstance(command, str) else command
        done = hrcneuro(*words, "--set", f"simulate.evidence={tmp_path}", "--workdir", tmp_path / "work")
        assert done.code == 3
        assert "s03_corl1_log: 29 trials; a whole session has 50" in done.err
    assert not list(tmp_path.glob("work/cache/simulate/*"))


def test_a_log_whose_decoder_was_altered_is_refused_before_anything_runs(hrcneuro, tmp_path):
    one, _ = gaze_logs.session("s03", 1, seed=0)
    one.error[[4, 8, 19, 29, 40]] ^= True
    gaze_logs.write_log(tmp_path, one)
    done = hrcneuro("simulate", "--evidence", tmp_path, *SMALL, "--workdir", tmp_path / "work")
    assert done.code == 3
    assert "s03_corl1_log, row 5: errpDetector is" in done.err
    assert "5 of 50 rows are so" in done.err
    assert "cure: copy it again from" in done.err
    assert not list(tmp_path.glob("work/cache/simulate/*"))


def test_a_partner_that_nobody_knows_is_a_mistake(hrcneuro, tmp_path):
    for value, said in (("['fixd']", "did you mean 'fixed'"), ("[]", "one or both of fixed, adapting")):
        given = ("--set", f"simulate.evidence_partners={value}", "--workdir", tmp_path, "--dry-run")
        done = hrcneuro("simulate", *given)
        assert done.code == 2
        assert said in done.err


def test_where_there_is_no_evidence_the_cure_is_the_option(hrcneuro, tmp_path):
    done = hrcneuro("show", "simulate", "evidence", "--workdir", tmp_path)
    assert done.code == 3
    assert "hrcneuro simulate --evidence FOLDER" in done.err
    done = hrcneuro("show", "decode", "evidence", "--workdir", tmp_path)
    assert (done.code, "decode has no evidence" in done.err) == (2, True)
