import dataclasses
import json
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from hrcneuro.contract import Inputs, Of, Read
from hrcneuro.errors import DataError
from hrcneuro.io.tables import describe, read_table
from hrcneuro.learning.grid import WIDE
from hrcneuro.stages import simulate

SMALL = simulate.Config(repetitions=20, episodes=12, period=5, learner_repetitions=10, sweep_repetitions=10)
PLAIN = dataclasses.replace(SMALL, learner_repetitions=0, confound=False)
NOTHING = Inputs("group", {})


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    out = tmp_path_factory.mktemp("simulate")
    return out, simulate.run_group(simulate.Config(), NOTHING, out)


def test_tables_hold_what_artifacts_md_says(plain):
    out, _ = plain
    curves = read_table(out / "curves.parquet")
    assert list(curves)[:6] == ["simulation", "variant", "episode", "mean", "sd", "n"]
    last = curves[curves["variant"] == "10/8 emp"].iloc[-1]
    assert last[["subtasks", "chosen", "reassign", "period"]].tolist() == [10, 8, "never", 40]
    assert set(curves[curves["simulation"] == "SIM3"]["reassign"]) == {"every"}
    np.testing.assert_allclose(curves["half_width"], 1.96 * curves["sd"] / 10, rtol=1e-4)
    assert len(curves) == 31 * 200  # the paper's 26 and five of (10, 8)
    assert (curves["n"] == 100).all()
    assert curves["mean"].between(0, 1).all()
    assert describe(out / "curves.parquet").row == "one row a curve and episode"
    marks = read_table(out / "milestones.parquet")
    assert len(marks) == 31 * 2 * 2
    first = marks[(marks.simulation == "SIM1") & (marks.level == 0.8)]
    assert first["printed_episode"].tolist() == [100, 100]
    assert first["printed_minutes"].tolist() == [17, 17]
    assert first["minutes"].tolist() == pytest.approx([first.episode.iloc[0] / 6, first.episode.iloc[0] / 3])
    again = read_table(out / "relearning.parquet")
    assert again.groupby("variant")["episode"].apply(list).iloc[0] == [40, 80, 120, 160, 200]


def test_summary_is_the_curves(plain):
    out, summary = plain
    assert json.loads(json.dumps(summary)) == summary
    assert set(summary) == {"SIM1", "SIM2", "SIM3", "SIM4", "milestones"}
    assert summary["milestones"]["SIM1"]["emp"].keys() == {"70", "80"}
    curves = read_table(out / "curves.parquet").set_index(["simulation", "variant", "episode"])["mean"]
    assert summary["SIM1"]["emp"]["35"] == pytest.approx(curves["SIM1", "emp", 35], abs=1e-6)
    assert summary["SIM4"]["10/8 emp"]["100"] == pytest.approx(curves["SIM4", "10/8 emp", 100], abs=1e-6)


def test_the_band_of_100_repetitions_covers_the_printed_points(plain):
    out, _ = plain
    curves = read_table(out / "curves.parquet").set_index(["simulation", "variant", "episode"])
    for episode, printed in ((35, 0.70), (100, 0.80)):
        row = curves.loc[("SIM1", "emp", episode)]
        assert abs(row["mean"] - printed) < 1.96 * row["sd"] / np.sqrt(row["n"])


def test_same_configuration_same_bytes(tmp_path):
    config = dataclasses.replace(SMALL, sweep={"accuracy": (55.0, 80.0), "period": (0.0, 4.0), "alpha": (0.05, 0.2)})
    for name in ("one", "two"):
        folders = {unit: tmp_path / f"{name}-parts" / unit for unit in simulate.parts(config)}
        for unit, folder in folders.items():
            folder.mkdir(parents=True)
            simulate.run_part(config, Inputs(unit, {}), folder)
        (tmp_path / name).mkdir()
        simulate.run_group(config, NOTHING, tmp_path / name)
        simulate.run_sweep(config, Inputs.of("sweep", simulate=folders), tmp_path / name)
    files = sorted(p.name for p in (tmp_path / "one").iterdir())
    assert files == [
        "analytic.parquet",
        "confound.parquet",
        "curves.parquet",
        "learner_curves.parquet",
        "learners.parquet",
        "milestones.parquet",
        "needed.parquet",
        "relearning.parquet",
        "sweep.parquet",
    ]
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_short_runs_and_no_cases_work(tmp_path):
    config = dataclasses.replace(SMALL, episodes=1, test_cases=(), levels=())
    assert "emp" in simulate.run_group(config, NOTHING, tmp_path)["SIM3"]
    config = dataclasses.replace(PLAIN, episodes=1, test_cases=(), levels=())
    assert simulate.check(config) == []
    summary = simulate.run_group(config, NOTHING, tmp_path)
    assert summary["SIM1"]["emp"].keys() == {"1"}
    assert "SIM4" not in summary


def test_inputs_follow_the_rates():
    reads = {r: simulate.STAGE.group.needed(dataclasses.replace(SMALL, rates=r)) for r in ("paper", "decode", "replay")}
    assert reads["paper"] == ()
    assert reads["decode"] == (Read("decode", ("scores.parquet",), Of.INCLUDED),)
    assert reads["replay"] == (Read("decode", ("predictions.parquet",), Of.INCLUDED),)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"chosen": 4}, "chosen = 4 of subtasks = 4"),
        ({"subtasks": 3, "chosen": 5}, "chosen = 5 of subtasks = 3"),
        ({"test_cases": ((6, 3), (4, 4))}, "test_cases[1] = [4, 4]; allowed"),
        ({"test_cases": ((6,),)}, "test_cases[0] = [6]"),
        ({"events": 1}, "nothing is learned"),
        ({"levels": (60.0, 60.0)}, "names one of them twice"),
        ({"learner_repetitions": 1}, "no confidence interval"),
        ({"sweep": {"alpha": (0.1,) * 400, "tau": (0.1,) * 300}}, "120,000 cells (alpha 400 × tau 300)"),
        ({"sweep": {"chosen": (5.0,), "subtasks": (4.0,)}}, "nowhere below"),
        ({"sweep": {"chosen": (4.0, 5.0)}}, "nowhere below"),
    ],
)
def test_contradictions_are_named(changes, match):
    mistakes = simulate.check(dataclasses.replace(SMALL, **changes))
    assert any(match in m for m in mistakes), mistakes


@pytest.mark.parametrize(
    ("name", "value"),
    [("tnr_hh", 101.0), ("tpr_rh", -0.1), ("alpha", 0.0), ("tau", 0.0), ("episodes", 0), ("chosen", 0), ("events", 0)],
)
def test_limits_are_declared(name, value):
    meta = {f.name: f.metadata for f in dataclasses.fields(simulate.Config)}[name]
    low, high = meta["low"], meta["high"]
    assert value < low or (meta["open_low"] and value <= low) or value > high


def test_the_module_is_light():
    code = "import sys, hrcneuro.stages.simulate; sys.exit(any(m in sys.modules for m in ('numpy', 'pandas', 'mne')))"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_the_wide_sweep_is_large_and_allowed():
    from hrcneuro.analyses.sweep import points

    config = dataclasses.replace(SMALL, sweep=WIDE)
    assert "10,125 cells (accuracy 15 × subtasks 5" in simulate.notes(config)[0]
    assert simulate.notes(dataclasses.replace(SMALL, sweep={"accuracy": (55.0, 60.0)})) == []
    assert simulate.check(config) == []
    assert len(points(config)) == 10_125


def test_a_sweep_does_not_depend_on_how_it_is_cut(tmp_path):
    import pandas as pd

    from hrcneuro.analyses.sweep import part_table

    config = dataclasses.replace(SMALL, sweep={"accuracy": (55.0, 80.0), "subtasks": (2.0, 4.0)}, sweep_repetitions=20)
    whole = part_table(config, 0, 1)
    cut = pd.concat([part_table(config, i, 3) for i in range(3)], ignore_index=True)
    pd.testing.assert_frame_equal(whole, cut)
    assert simulate.parts(dataclasses.replace(config, sweep={})) == ()
    assert len(simulate.parts(dataclasses.replace(config, sweep=WIDE))) == simulate.SWEEP_PARTS


@pytest.fixture
def swept(tmp_path):
    """Return a function that sweeps in one part, and returns the summary and the table of what is needed."""

    def run(**changes):
        config = dataclasses.replace(SMALL, episodes=60, sweep_repetitions=100, **changes)
        folders = {unit: tmp_path / unit for unit in simulate.parts(config)}
        for unit, folder in folders.items():
            folder.mkdir()
            simulate.run_part(config, Inputs(unit, {}), folder)
        (tmp_path / "out").mkdir()
        summary = simulate.run_sweep(config, Inputs.of("sweep", simulate=folders), tmp_path / "out")
        return summary, read_table(tmp_path / "out" / "needed.parquet")

    return run


def test_one_axis_tells_how_good_a_decoder_must_be(swept):
    summary, table = swept(sweep={"accuracy": (52.0, 56.0, 60.0, 80.0)})
    assert summary["axes"] == ["accuracy"]
    assert [row["trial_s"] for row in summary["needed"]] == [1.0, 2.0]
    quick, slow = table.to_dict("records")
    assert (quick["episode"], slow["episode"]) == (60, 30)  # episodes of ten events
    assert 52 < quick["low"] < quick["accuracy"] < quick["high"] < slow["high"] < 80
    assert quick["accuracy"] < slow["accuracy"]
    assert quick["below"] < quick["accuracy"] <= quick["above"]


def test_where_tasks_change_the_end_counts_and_not_the_clock(swept):
    _, table = swept(sweep={"accuracy": (55.0, 99.0), "period": (0.0, 20.0)})
    assert table.groupby("period")["episode"].apply(list).to_dict() == {0: [60, 30], 20: [60, 60]}


def test_a_sweep_without_accuracy_names_the_design_that_learns_soonest(swept):
    summary, _ = swept(sweep={"alpha": (0.001, 0.1)})
    assert summary["accuracy"] == 57.0
    assert summary["soonest"]["design"] == {"alpha": 0.1}
    quick, slow = (summary["soonest"][f"minutes_{trial}"] for trial in ("1s", "2s"))
    assert 0 < quick == pytest.approx(slow / 2, abs=1e-5)


def test_of_many_designs_those_one_step_from_the_usual_are_told(swept):
    axes = {"accuracy": (55.0, 80.0), "alpha": (0.05, 0.1, 0.2, 0.4), "tau": (0.05, 0.1, 0.2), "subtasks": (2.0, 4.0)}
    summary, table = swept(sweep=axes)
    assert len(table) == 2 * 4 * 3 * 2
    usual = {"alpha": 0.05, "tau": 0.1, "subtasks": 4.0}
    told = [row["design"] for row in summary["needed"]]
    assert len(told) == 2 * (1 + 3 + 2 + 1)
    # m follows n, and is no step of its own.
    assert all(sum(design[axis] != value for axis, value in usual.items()) <= 1 for design in told)


def test_the_simulations_know_nothing_of_the_sweep():
    names = {f.name for f in dataclasses.fields(simulate.Config)}
    for side in simulate.STAGE.sides:
        assert {name for name in names if name.startswith(side.unit)} == set(side.options)
        assert not side.asked(simulate.Config())


@pytest.mark.parametrize("change", [{"ddof": 1}, {"carry_over": True}])
def test_a_sweep_hears_every_option_of_the_learning(change):
    from hrcneuro.analyses.sweep import part_table

    config = dataclasses.replace(SMALL, sweep={"accuracy": (60.0, 70.0)})
    assert not part_table(dataclasses.replace(config, **change), 0, 1).equals(part_table(config, 0, 1))


def test_learners_differ_and_say_by_how_much(plain):
    out, _ = plain
    table = read_table(out / "learners.parquet")
    one = table[(table.simulation == "SIM1") & (table.measure == "mean")].set_index("learner")
    assert one.loc["paper", "difference"] == 0
    assert one.loc["bayes_graded", "difference"] > 3 * one.loc["bayes_graded", "half_width"]
    assert one["behind_best"].max() == 0
    assert tuple(one.index) == simulate.LEARNERS
    curves = read_table(out / "learner_curves.parquet").groupby(["simulation", "variant", "learner"])["mean"]
    means = table[table.measure == "mean"].set_index(["simulation", "variant", "learner"])["value"]
    pd.testing.assert_series_equal(curves.mean().sort_index(), means.sort_index(), check_names=False)


def test_expectation_is_within_the_band_of_the_curve(plain):
    out, _ = plain
    table = read_table(out / "analytic.parquet")
    assert set(table.simulation) == {"SIM1", "SIM2", "SIM4"}  # tasks stay
    inside = (table.difference.abs() < np.maximum(table.half_width, 0.01)).groupby(table.variant).mean()
    assert inside.mean() > 0.85


def test_a_decoder_of_errors_teaches_nothing(plain):
    out, _ = plain
    final = read_table(out / "confound.parquet").query("episode == 200").set_index("variant")["mean"]
    assert final["anticipation"] > 0.8
    assert final["errors, before takeovers as logged"] > 0.8
    assert abs(final["errors, whoever acts next"] - 0.5) < 0.06


RATES = {"s01": (52.0, 50.0, 55.0, 53.0), "s02": (54.0, 56.0, 65.0, 67.0)}  # HH, HR, RR, RH in per cent


def _decoded(folder, rates, *, scenario="iC", problems=("HHvsHR", "RRvsRH")):
    """Write decode artifacts of one subject that score ``rates``, with the decode stage's own schemas."""
    from hrcneuro.io.tables import write_table
    from hrcneuro.tables.decode import PREDICTIONS, SCORES

    folder.mkdir(parents=True)
    rng = np.random.default_rng(7)
    scores, rows = [], []
    for problem, tnr, tpr in zip(problems, rates[::2], rates[1::2], strict=True):
        key = {"scenario": scenario, "problem": problem, "decoder": "rlda"}
        known = {**key, "tnr": tnr, "tpr": tpr, "class1": "a", "class2": "b", "note": "too few trials"}
        known |= {"n1": 100, "n2": 100, "n_folds": 2, "n_repeats": 2}
        scores.append({name: known.get(name, np.nan) for name in SCORES.columns})
        for repeat in range(2):
            right = np.concatenate([np.arange(100) < tnr, np.arange(100) < tpr])[order := rng.permutation(200)]
            label = np.repeat([0, 1], 100)[order]
            score = np.where(right == (label == 1), 1, -1) * rng.exponential(size=200)
            at = np.arange(200)
            rows.append(
                pd.DataFrame(
                    {
                        **key,
                        "repeat": repeat,
                        "fold": at % 2,
                        "epoch": at,
                        "block": at // 20,
                        "episode": at // 5,
                        "trial": at % 5,
                        "label": label,
                        "score": score,
                    }
                )
            )
    write_table(pd.DataFrame(scores), folder / "scores.parquet", SCORES)
    predictions = pd.concat(rows, ignore_index=True)[list(PREDICTIONS.columns)]
    write_table(predictions.sample(frac=1, random_state=1), folder / "predictions.parquet", PREDICTIONS)
    return folder


@pytest.mark.parametrize("rates", ["decode", "replay"])
def test_this_runs_decoding_closes_the_chain(tmp_path, rates):
    inputs = Inputs.of("group", decode={unit: _decoded(tmp_path / unit, r) for unit, r in RATES.items()})
    config = simulate.Config(rates=rates, repetitions=150, episodes=60, learner_repetitions=60, test_cases=())
    (tmp_path / "out").mkdir()
    summary = simulate.run_group(config, inputs, tmp_path / "out")
    sim1 = {name: episodes["40"] for name, episodes in summary["SIM1"].items()}
    assert set(sim1) == {"emp", "s01", "s02"}
    assert sim1["s01"] + 0.1 < sim1["emp"] < sim1["s02"]  # who is decoded better teaches better
    assert sim1["s02"] > 0.8


def test_mean_rates_of_the_run_are_used(tmp_path):
    from hrcneuro.analyses.empirical import empirical

    inputs = Inputs.of("group", decode={unit: _decoded(tmp_path / unit, r) for unit, r in RATES.items()})
    for rates in ("decode", "replay"):
        found = empirical(dataclasses.replace(PLAIN, rates=rates), inputs).rates
        assert found.by_case == pytest.approx([60.0, 60.0, 53.0, 53.0])  # RR, RH, HR, HH


@pytest.mark.parametrize("rates", ["decode", "replay"])
@pytest.mark.parametrize(
    ("artifact", "changes", "match"),
    [
        ({"problems": ("HHvsHR", "RRvsHH")}, {}, "no problem 'RRvsRH'.*did you mean 'RRvsHH'.*it has HHvsHR, RRvsHH"),
        ({"scenario": "sC"}, {}, "s01 has no scenario 'iC'.*it has sC"),
        ({}, {"decoder": "xdawn"}, "no decoder 'xdawn'; it has rlda"),
    ],
)
def test_decode_artifacts_that_lack_something_are_refused(tmp_path, rates, artifact, changes, match):
    inputs = Inputs.of("group", decode={"s01": _decoded(tmp_path / "s01", RATES["s01"], **artifact)})
    with pytest.raises(DataError, match=match):
        simulate.run_group(dataclasses.replace(PLAIN, rates=rates, **changes), inputs, tmp_path)


def test_missing_rates_and_subjects_are_refused(tmp_path):
    inputs = Inputs.of("group", decode={"s01": _decoded(tmp_path / "s01", (50.0, np.nan, 50.0, 50.0))})
    with pytest.raises(DataError, match="no rates of HHvsHR in scenario iC: too few trials"):
        simulate.run_group(dataclasses.replace(PLAIN, rates="decode"), inputs, tmp_path)
    with pytest.raises(DataError, match="needs decoded subjects"):
        simulate.run_group(dataclasses.replace(PLAIN, rates="replay"), NOTHING, tmp_path)
