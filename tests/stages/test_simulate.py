import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest

from hrcneuro.contract import Inputs
from hrcneuro.io.tables import describe, read_table
from hrcneuro.stages import simulate

SMALL = simulate.Config(repetitions=20, episodes=12, period=5)
NOTHING = Inputs("group", {})


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    out = tmp_path_factory.mktemp("simulate")
    return out, simulate.run_group(simulate.Config(), NOTHING, out)


def test_tables_hold_what_artifacts_md_says(plain):
    out, _ = plain
    curves = read_table(out / "curves.parquet")
    assert list(curves) == ["simulation", "variant", "episode", "mean", "sd", "n"]
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
    assert set(summary) == {"SIM1", "SIM2", "SIM3", "SIM4"}
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
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        simulate.run_group(SMALL, NOTHING, tmp_path / name)
    files = sorted(p.name for p in (tmp_path / "one").iterdir())
    assert files == ["curves.parquet", "fig4.png", "milestones.parquet", "relearning.parquet"]
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    assert set(simulate.FIGURES) <= set(files)


def test_short_runs_and_no_cases_work(tmp_path):
    config = dataclasses.replace(SMALL, episodes=1, test_cases=(), levels=())
    assert simulate.check(config) == []
    summary = simulate.run_group(config, NOTHING, tmp_path)
    assert summary["SIM1"]["emp"].keys() == {"1"}
    assert "SIM4" not in summary


def test_inputs_follow_the_rates():
    asked = {r: simulate.inputs(dataclasses.replace(SMALL, rates=r)) for r in ("paper", "decode", "replay")}
    assert asked["paper"] == {} == simulate.GROUP_INPUTS
    assert asked["decode"] == {"decode": ("scores.parquet",)}
    assert asked["replay"] == {"decode": ("predictions.parquet",)}


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"chosen": 4}, "chosen = 4 of subtasks = 4"),
        ({"subtasks": 3, "chosen": 5}, "chosen = 5 of subtasks = 3"),
        ({"test_cases": ((6, 3), (4, 4))}, "test_cases[1] = [4, 4]; allowed"),
        ({"test_cases": ((6,),)}, "test_cases[0] = [6]"),
        ({"events": 1}, "nothing is learned"),
        ({"levels": (60.0, 60.0)}, "names one of them twice"),
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
