import dataclasses
import json

import numpy as np
import pandas as pd
import pytest
from epoch_factory import CHANNELS, trial_table, write_subject
from overlapping import overlapping

from hrcneuro.contract import Inputs
from hrcneuro.eeg.evoked import within
from hrcneuro.errors import ConfigError
from hrcneuro.io.tables import read_lists, read_table
from hrcneuro.stages import rerp
from hrcneuro.tables.rerp import PLAIN, REST, read_coefficients, read_parts, read_tested

pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword")

KEPT = rerp.Config(
    formula="takeover + prev_error", overlap="keep", contrasts={"RH-RR_before": ("RH_before", "RR_before")}
)


def moves(seed, n=200):
    """Trials of robot's moves, of which takeovers mostly follow an error."""
    rng = np.random.default_rng(seed)
    table = trial_table(rng, n).assign(actor="robot", error=False, practice=False)
    takeover = rng.random(n) < 0.4
    table["condition_before"] = np.where(takeover, "RH", "RR")
    table["prev_error"] = rng.random(n) < np.where(takeover, 0.7, 0.25)
    return table


def group(folder, config=KEPT, n_subjects=6, **options):
    """Run subjects whose effect is on RH_before at 500 ms, and the group; return summary and folders."""
    units = {}
    for i in range(n_subjects):
        unit = f"s{i + 1:02d}"
        write_subject(folder / "epoch" / unit, unit, seed=i, table=moves(i), **options)
        units[unit] = folder / "rerp" / unit
        units[unit].mkdir(parents=True)
        rerp.run(config, Inputs.of(unit, epoch=folder / "epoch" / unit), units[unit])
    out = folder / "rerp" / "group"
    out.mkdir()
    return rerp.run_group(config, Inputs.of("group", rerp=units), out), units, out


def test_neighbours_responses_and_sizes_are_told_apart(tmp_path):
    """Each move's response is that of its actor and of a takeover; without noise nothing but rounding remains."""

    def sizes(trials):
        trials["actor"] = np.where(np.arange(len(trials)) % 3, "robot", "human")
        trials["error"] = False
        return 1.0 + 0.5 * (trials["actor"] == "robot") + 2.0 * trials["condition_before"].isin(["HR", "RH"])

    response, times = overlapping(tmp_path, sizes=sizes)
    response = response - response[within(times, -0.2, 0)].mean()
    inputs = Inputs.of("s01", **{name: tmp_path / name for name in ("acquire", "preprocess", "epoch")})
    config = rerp.Config(formula="actor + takeover", contrasts={}, split="")
    found = {}
    for overlap in ("keep", "regress"):
        out = tmp_path / overlap
        out.mkdir()
        summary = rerp.run(dataclasses.replace(config, overlap=overlap), inputs, out)
        found[overlap] = read_coefficients(out / "rerp.parquet")
    free, kept = found["regress"], found["keep"]
    for name, size in (("Intercept", 1.0), ("actor[T.robot]", 0.5), ("takeover", 2.0)):
        np.testing.assert_allclose(free.maps["all", name], [size * response, 2 * size * response], atol=2e-3)
        assert np.abs(kept.maps["all", name][0] - size * response).max() > 0.1
    assert np.isnan(free.gap_s)
    assert kept.gap_s > 0.5
    assert summary["shortest_gap_s"] is None


def test_a_takeovers_own_effect_is_found_and_the_previous_errors_is_none(tmp_path):
    summary, _, out = group(tmp_path, effect_uv=12)
    tested = read_tested(out / "rerp_stats.parquet")
    assert tested.subjects == 6
    for scenario in ("iC", "sC"):
        one, other = (tested.maps[scenario, name] for name in ("takeover", "prev_error"))
        row, at = one.channels.index("Fz"), int(np.argmin(np.abs(one.times - 0.5)))
        assert one.difference[row, at] == pytest.approx(12.5, abs=4)
        assert abs(other.difference[row, at]) < 3
        found = summary["coefficients"][scenario]["takeover"]
        assert found["n"] == 6
        assert found["peak"]["channel"] == "Fz"
        assert found["flips"] == 64
    json.dumps(summary, allow_nan=False)


def test_parts_add_up_to_the_plain_difference(tmp_path):
    _, units, out = group(tmp_path, effect_uv=6)
    for path in (*(folder / "parts.parquet" for folder in units.values()), out / "rerp_parts.parquet"):
        parts = read_parts(path)
        for scenario in ("iC", "sC"):
            own = {part.name: part for part in parts if part.scenario == scenario}
            assert set(own) == {PLAIN, "takeover", "prev_error", REST}
            total = sum(own[name].map for name in ("takeover", "prev_error", REST))
            np.testing.assert_allclose(total, own[PLAIN].map, atol=1e-4)
            assert own["takeover"].difference == 1.0
            assert 0.2 < own["prev_error"].difference < 0.7
    subject = read_coefficients(units["s01"] / "rerp.parquet")
    part = next(p for p in read_parts(units["s01"] / "parts.parquet") if p.name == "prev_error")
    coefficient = subject.maps[part.scenario, "prev_error"]
    np.testing.assert_allclose(part.map, part.difference * coefficient, atol=1e-4)


def test_the_table_of_predictors_says_what_was_known(tmp_path):
    table = moves(0)
    table.loc[::10, "soa_s"] = np.nan
    write_subject(tmp_path / "epoch", "s01", seed=0, table=table)
    out = tmp_path / "out"
    out.mkdir()
    summary = rerp.run(KEPT, Inputs.of("s01", epoch=tmp_path / "epoch"), out)
    rows = read_table(out / "predictors.parquet").set_index(["scenario", "coefficient"])
    known = table[(table["scenario"] == "iC") & table["soa_s"].notna()]
    one = rows.loc[("iC", "takeover")]
    assert (one["trials"], one["unknown"]) == (len(known), 10) == (summary["trials"]["iC"], summary["unknown"]["iC"])
    assert one["nonzero"] == (known["condition_before"] == "RH").sum()
    assert one["inflation"] == pytest.approx(1.2, abs=0.2)
    assert list(read_table(out / "channels.parquet")["channel"]) == list(CHANNELS)


def test_a_coefficient_that_not_all_have_is_tested_over_those_that_do(tmp_path):
    config = dataclasses.replace(KEPT, formula="takeover + event")
    units = {}
    for i, unit in enumerate(("s01", "s02", "s03")):
        table = moves(i).assign(event=np.where(np.arange(200) % 4, "move", "pause") if i else "move")
        write_subject(tmp_path / "epoch" / unit, unit, seed=i, table=table)
        units[unit] = tmp_path / unit
        units[unit].mkdir()
        rerp.run(config, Inputs.of(unit, epoch=tmp_path / "epoch" / unit), units[unit])
    out = tmp_path / "group"
    out.mkdir()
    summary = rerp.run_group(config, Inputs.of("group", rerp=units), out)
    assert summary["coefficients"]["iC"]["event[T.pause]"]["n"] == 2
    assert summary["coefficients"]["iC"]["takeover"]["n"] == 3
    assert any("event[T.pause]: without s01" in warning for warning in summary["warnings"])
    assert any("nothing can be significant" in warning for warning in summary["warnings"])


def test_clusters_and_one_subject(tmp_path):
    summary, _, out = group(tmp_path, dataclasses.replace(KEPT, correction="cluster"), n_subjects=1)
    assert summary["coefficients"]["iC"]["takeover"]["p_min"] is None
    assert any("one subject cannot be tested" in warning for warning in summary["warnings"])
    assert not read_lists(out / "rerp_stats.parquet", "significant").any()
    summary, _, _ = group(tmp_path / "more", dataclasses.replace(KEPT, correction="cluster"), effect_uv=25)
    assert summary["coefficients"]["iC"]["takeover"]["significant"] > 0


@pytest.mark.parametrize(
    ("formula", "words", "cure"),
    [
        ("takeover + eror", r"names the column 'eror' \(did you mean 'error'\?\)", "prev_error, turn"),
        ("takeover +", "cannot be read", "terms joined by"),
        ("turn ~ takeover", "more than the right side", "terms joined by"),
        (
            "actor + case",
            r"cannot be told apart; .*case\[T.RR\] = actor\[T.robot\] - case\[T.HR\]",
            "leave one of them",
        ),
        ("takeover + I(takeover * error)", r"I\(takeover \* error\) is 0 in every trial", "leave one of them"),
    ],
)
def test_a_formula_that_cannot_be_is_refused_before_anything_runs(formula, words, cure):
    with pytest.raises(ConfigError, match=words) as caught:
        rerp.ready(rerp.Config(formula=formula))
    assert cure in caught.value.cure


def test_what_the_study_allows_passes():
    for formula in (
        rerp.Config().formula,
        "actor * takeover + error + prev_error + turn + soa",
        "C(block) + key_wrong",
    ):
        rerp.ready(rerp.Config(formula=formula))
    # Of another study only the columns are known beforehand.
    rerp.ready(rerp.Config(formula="actor + case", split=""))


@pytest.mark.parametrize(
    ("formula", "changes", "words"),
    [
        ("takeover + I(3 * takeover)", {}, r"s01, iC: .*I\(3 \* takeover\) = 3 takeover"),
        ("takeover + target", {}, "s01, iC: .*'target'"),
        ("takeover + turn", {"turn": None}, "s01, iC: .*'turn', which has no value here"),
    ],
)
def test_a_formula_that_does_not_fit_a_subject_is_refused_with_the_scenario(tmp_path, formula, changes, words):
    table = moves(0).assign(**changes)
    write_subject(tmp_path, "s01", seed=0, table=table)
    with pytest.raises(ConfigError, match=words):
        rerp.run(dataclasses.replace(KEPT, formula=formula), Inputs.of("s01", epoch=tmp_path), tmp_path)


def test_a_study_without_moves_is_fitted_on_its_own_columns(tmp_path):
    table = pd.DataFrame({"event": ["square", "rt"] * 15, "scenario": None, "condition_before": None, "soa_s": np.nan})
    write_subject(tmp_path, "demo", seed=0, table=table)
    config = rerp.Config(formula="event", overlap="keep", conditions={"x": "event == 'x'"}, contrasts={})
    summary = rerp.run(config, Inputs.of("demo", epoch=tmp_path), tmp_path)
    assert summary["trials"] == {"all": 30}
    assert set(summary["coefficients"]["all"]) == {"Intercept", "event[T.square]"}
    assert not len(read_table(tmp_path / "parts.parquet"))


def test_contradictions_are_found(tmp_path):
    assert rerp.check(rerp.Config()) == []
    assert "baseline_s = [0.0, -0.2]" in rerp.check(rerp.Config(baseline_s=(0.0, -0.2)))[0]
    write_subject(tmp_path, "s01", seed=0, table=moves(0))
    with pytest.raises(ConfigError, match=r"baseline -1…-0\.5 s"):
        rerp.run(dataclasses.replace(KEPT, baseline_s=(-1, -0.5)), Inputs.of("s01", epoch=tmp_path), tmp_path)
