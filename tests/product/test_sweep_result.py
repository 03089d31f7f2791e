"""A sweep is a result beside the simulations: it answers in words, and leaves what was there fresh."""

import pytest

SMALL = [
    word
    for option in ("repetitions=10", "episodes=30", "learner_repetitions=0", "confound=false", "sweep_repetitions=20")
    for word in ("--set", f"simulate.{option}")
]


@pytest.fixture(scope="module")
def swept(hrcneuro, tmp_path_factory):
    folder = tmp_path_factory.mktemp("swept")
    assert hrcneuro("simulate", *SMALL, "--workdir", folder, "-j", "1").code == 0
    words = ("--sweep", "accuracy=55,99", "--sweep", "subtasks=2,4")
    return folder, hrcneuro("simulate", *words, *SMALL, "--workdir", folder, "-j", "1")


def test_the_simulations_are_not_done_again_and_the_answer_is_printed(swept):
    _, done = swept
    assert done.code == 0, done.err
    assert "simulate, sweep" in done.out
    assert done.out.count("% or more (95 % band") == 4
    assert "simulate: 1 fresh, 5 ran; pictures: 1 fresh, 1 ran" in done.err


def test_status_and_report_find_all_fresh_though_no_one_names_the_sweep_again(hrcneuro, swept):
    folder, _ = swept
    status = hrcneuro("status", *SMALL, "--workdir", folder, "--json").json["items"]
    found = {item["unit"]: item["state"] for item in status if item["stage"] == "simulate"}
    assert found == {"group": "hit", "sweep": "hit", **{f"sweep-0{i}": "hit" for i in range(1, 5)}}
    place = hrcneuro("report", *SMALL, "--workdir", folder, "--json").json["report"]
    assert str(folder) in place
    pages = [path.read_text() for path in folder.rglob("report.html")]
    assert any("id='sweep'" in page and "of those swept" in page for page in pages)


def test_a_sweep_of_other_options_is_not_shown(hrcneuro, swept):
    folder, _ = swept
    status = hrcneuro("status", *SMALL, "--set", "simulate.alpha=0.1", "--workdir", folder, "--json").json["items"]
    assert {item["unit"] for item in status if item["stage"] == "simulate"} == {"group"}


def test_show_and_path_know_the_sweep(hrcneuro, swept):
    folder, done = swept
    shown = hrcneuro("show", "simulate", "sweep", *SMALL, "--workdir", folder)
    assert (shown.code, shown.err) == (0, "")
    assert shown.out.strip() in done.out
    assert hrcneuro("path", "simulate", "sweep", "needed.parquet", *SMALL, "--workdir", folder).code == 0


def test_where_nothing_was_swept_the_cure_is_the_option(hrcneuro, tmp_path):
    done = hrcneuro("show", "simulate", "sweep", "--workdir", tmp_path)
    assert done.code == 3
    assert "hrcneuro simulate --sweep AXIS=VALUES" in done.err
