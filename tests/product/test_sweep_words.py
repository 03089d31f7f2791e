"""What a person may write after --sweep, and what is said of it before anything runs."""

import pytest

SMALL = ("--dry-run", "--no-figures")


def asked(hrcneuro, folder, *words):
    return hrcneuro("simulate", *words, *SMALL, "--workdir", folder)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["accuracy=55", "accuracy=60"], ["--sweep names accuracy twice"]),
        (["wide", "wide"], ["--sweep names wide twice"]),
        (["accuracy=0.57"], ["--sweep: simulate.sweep.accuracy[0] = 0.57", "did you mean 57?"]),
        (["accuracy=50,60,50"], ["names 50 twice"]),
        (["accuracy"], ["'accuracy' names no values", "--sweep accuracy=55,60,65"]),
        (["accuracy="], ["'accuracy=' names no values"]),
        (["accuracy=50,,60"], ["accuracy: '' is no number"]),
        (["=50"], ["'=50' names no axis"]),
        (["accuracy=50..60"], ["accuracy: '50..60' is no number", "each value by itself"]),
        (["accuracy=50:60:0"], ["accuracy: '50:60:0' is no number"]),
        (["accuracy=nan"], ["accuracy[0] = nan", "0 <= accuracy <= 100 %"]),
        (["acuracy=50"], ["--sweep: unknown key simulate.sweep.acuracy", "did you mean 'accuracy'"]),
        ([f"tau={','.join(f'{i / 100}' for i in range(1, 401))}", f"events={','.join(map(str, range(2, 300)))}"], [
            "119,200 cells (tau 400 × events 298)", "100,000"
        ]),
    ],
)  # fmt: skip
def test_a_sweep_that_nobody_can_mean_is_refused_before_it_starts(hrcneuro, tmp_path, words, said):
    done = asked(hrcneuro, tmp_path, *(word for axis in words for word in ("--sweep", axis)))
    assert done.code == 2
    for text in said:
        assert text in done.err
    assert "cure" in done.err
    assert list(tmp_path.iterdir()) == []


def test_a_mistake_is_told_with_the_option_that_was_given(hrcneuro, tmp_path):
    done = asked(hrcneuro, tmp_path, "--sweep", "accuracy=101", "--set", "simulate.sweep.tau=[-1]")
    assert done.code == 2
    assert "--sweep: simulate.sweep.accuracy[0] = 101" in done.err
    assert "--set: simulate.sweep.tau[0] = -1" in done.err
    done = hrcneuro("robot", "--backend", "ursym", "--set", "robot.driver=x", "--workdir", tmp_path)
    assert done.code == 2
    assert "--backend: robot.backend = 'ursym'" in done.err
    assert "--set: robot.driver = 'x'" in done.err


def test_the_mistakes_of_all_axes_come_at_once(hrcneuro, tmp_path):
    words = ("accuracy=0.57", "accuracy=60", "subtasks=99", "tau=", "nosuch=1", "events=x")
    done = asked(hrcneuro, tmp_path, *(word for axis in words for word in ("--sweep", axis)), "--set", "epoch.tmim=1")
    assert done.code == 2
    for text in ("7 mistakes", "accuracy twice", "did you mean 57", "subtasks", "'tau='", "nosuch", "'x'", "tmim"):
        assert text in done.err


@pytest.mark.parametrize("assignment", ["simulate.sweep.accuracy=[55]", "simulate.sweep={accuracy=[55]}"])
@pytest.mark.parametrize("other", [("--sweep", "accuracy=60"), ("--set", "simulate.sweep.accuracy=[60]")])
def test_an_axis_is_not_given_in_two_ways(hrcneuro, tmp_path, assignment, other):
    done = asked(hrcneuro, tmp_path, *other, "--set", assignment)
    assert done.code == 2
    assert f"{assignment.partition('=')[0]} is given twice" in done.err


def test_axes_that_differ_and_other_options_may_be_set_one_after_another(hrcneuro, tmp_path):
    words = ("sweep.accuracy=[55]", "sweep.tau=[0.1]", "seed=1", "seed=2")
    done = asked(hrcneuro, tmp_path, *(w for word in words for w in ("--set", f"simulate.{word}")))
    assert done.code == 0, done.err


@pytest.mark.parametrize(
    ("words", "cells"), [(["accuracy= 55 , 60,"], 2), (["subtasks=4,6", "tau=0.1"], 2), (["wide", "tau=0.2"], 3375)]
)
def test_a_sweep_is_read_as_it_is_meant(hrcneuro, tmp_path, words, cells):
    done = asked(hrcneuro, tmp_path, *(word for axis in words for word in ("--sweep", axis)), "--json")
    assert done.code == 0, done.err
    assert len([i for i in done.json["items"] if i["unit"].startswith("sweep-")]) == min(cells, 16)
    # A large one is told before it starts, a small one is not.
    assert (f"the sweep has {cells:,} cells" in done.err) == (cells > 1000)


@pytest.mark.parametrize("where", ["--set", "file"])
def test_percent_and_shares_are_told_apart_wherever_they_stand(hrcneuro, tmp_path, where):
    values = {"simulate": {"tnr_hh": 0.57, "levels": [0.6]}, "epoch": {"outlier_share": 10}, "erp": {"alpha": 5}}
    given = []
    if where == "file":
        given = ["--config", tmp_path / "study.toml"]
        lines = [f"[{s}]\n" + "".join(f"{k} = {v}\n" for k, v in t.items()) for s, t in values.items()]
        (tmp_path / "study.toml").write_text("".join(lines))
    else:
        given = [w for s, t in values.items() for k, v in t.items() for w in ("--set", f"{s}.{k}={v}")]
    done = hrcneuro("config", "check", *given)
    assert done.code == 2
    for text in ("4 mistakes", "mean 57?", "mean 60?", "mean 0.1?", "mean 0.05?"):
        assert text in done.err
