"""The group's tables of transfer, of scores that are known."""

import json

import numpy as np
import pandas as pd
import pytest

from hrcneuro.analyses import transfer_group
from hrcneuro.decoding.group import holm
from hrcneuro.tables.transfer import SCORES

SIZES = {"own": ("2", "10", "all"), "pooled": ("none",), "recentred": ("none", "2", "all"), "joint": ("all",)}
MEANS = {("own", "2"): 52.0, ("own", "10"): 58.0, ("own", "all"): 60.0, ("pooled", "none"): 55.0}
MINUTES = {"none": 0.0, "2": 1.0, "10": 4.0, "all": 20.0}


def rows(n=6, **means):
    """Scores of subjects who all lie ±1 about the mean of their way."""
    found = []
    for way, sizes in SIZES.items():
        for size in sizes:
            for i in range(n):
                value = (MEANS | means).get((way, size), 57.0) + (-1) ** i
                place = {"signal": "offline", "scenario": "iC", "problem": "RRvsRH", "way": way, "calibration": size}
                found.append({**place, "subject": f"s{i}", "bacc": value, "minutes": MINUTES[size], "pairs": 1.0})
    return pd.DataFrame(found).reindex(columns=list(SCORES.columns))


def tables(scores):
    return {name.removesuffix(".parquet"): frame for name, (_, frame) in transfer_group.tables(scores, 1).items()}


def test_a_curve_goes_from_no_calibration_to_all_and_says_what_a_point_costs():
    curves = tables(rows())["curves"]
    own = curves[curves["way"] == "own"]
    assert own["calibration"].tolist() == ["2", "10", "all"]
    assert own["bacc"].tolist() == [52.0, 58.0, 60.0]
    np.testing.assert_allclose(own["minutes_per_point"], [np.nan, 0.5, 8.0])
    flat = curves[curves["way"] == "recentred"]
    assert flat["calibration"].tolist() == ["none", "2", "all"]
    assert flat["minutes_per_point"].isna().all()


def test_a_size_that_fewer_subjects_reach_has_no_price():
    scores = rows()
    scores = scores[~((scores["calibration"] == "10") & (scores["subject"] == "s0"))]
    own = tables(scores)["curves"].query("way == 'own'")
    assert own["n"].tolist() == [6, 5, 6]
    assert own["minutes_per_point"].isna().all()


def test_each_way_is_tested_without_and_with_all_calibration_and_corrected_together():
    tests = tables(rows())["tests"]
    assert list(zip(tests["way"], tests["calibration"], strict=True)) == [
        *(("own", "all"), ("pooled", "none"), ("recentred", "none"), ("recentred", "all"), ("joint", "all"))
    ]
    assert (tests["p"] == 1 / 64).all()
    np.testing.assert_allclose(tests["p_holm"], holm(tests["p"].to_numpy()))
    assert not tests["significant"].any()
    assert tables(rows(n=8))["tests"]["significant"].all()


def test_at_chance_nothing_is_significant():
    scores = rows(n=8)
    scores["bacc"] -= scores.groupby(["way", "calibration"])["bacc"].transform("mean") - 50
    tests = tables(scores)["tests"]
    assert (tests["p"] > 0.4).all()


def test_ways_are_compared_with_own_by_subject_and_said_to_be_worth_minutes():
    compared = tables(rows())["compared"].set_index(["way", "calibration"])
    assert ("own", "all") not in compared.index
    pooled = compared.loc[("pooled", "none")]
    assert pooled["difference"] == -5.0
    assert pooled["sd"] == pytest.approx(0.0)
    assert pooled["p"] == 2 / 64
    # Halfway between 52 % after 1 min and 58 % after 4 min.
    assert pooled["worth_minutes"] == pytest.approx(2.5)
    never = tables(rows(**{}).assign(bacc=lambda t: np.where(t["way"] == "joint", 70.0, t["bacc"])))["compared"]
    assert np.isnan(never.set_index("way").loc["joint", "worth_minutes"])


def test_without_own_decoders_nothing_is_compared():
    found = tables(rows().query("way != 'own'"))
    assert found["compared"].empty
    assert len(found["tests"]) == 4


def test_the_summary_is_json_and_has_every_way():
    scores = rows()
    summary = transfer_group.summary(scores, transfer_group.tables(scores, 1))
    json.dumps(summary, allow_nan=False)
    ways = summary["decoded"]["iC"]["RRvsRH, offline"]
    assert set(ways) == {"own", "pooled", "recentred, none", "recentred, all", "joint"}
    assert ways["pooled"]["difference_to_own"] == -5.0
    assert "difference_to_own" not in ways["own"]


def test_no_score_makes_empty_tables():
    found = tables(pd.DataFrame(columns=list(SCORES.columns)))
    assert all(frame.empty for frame in found.values())
