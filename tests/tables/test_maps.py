"""Tables of erp and ersp read back as the maps that were written."""

import mne
import numpy as np
import pytest

from hrcneuro.eeg.contrasts import GrandAverage, GroupContrast, summarise
from hrcneuro.eeg.permutation import sign_flip_test
from hrcneuro.tables import contrasts as tables
from hrcneuro.tables import maps

AXES = {"channel": ["Fz", "Cz", "Pz"], "frequency_hz": [4.0, 8.0], "times": np.arange(-2, 5) / 10}
ERP_AXES = {name: AXES[name] for name in ("channel", "times")}


def contrast(rng, scenario, name, n, shape):
    data = rng.standard_normal((n, *shape))
    test = sign_flip_test(data, rng) if n > 1 else None
    units = tuple(f"s{i}" for i in range(n))
    return GroupContrast(scenario, name, f"{name}+", f"{name}-", units, summarise(data, test))


def test_tested_contrasts_of_scenarios_and_strata(tmp_path):
    rng = np.random.default_rng(1)
    places = ["all", "all", "iC", "iC", "sC"]
    tested = [contrast(rng, p, "ba"[i % 2], 7 - i, (3, 2, 7)) for i, p in enumerate(places)]
    tables.write_tested(tested, AXES, tmp_path / "x.parquet", tables.ERSP_STATS, subjects=7, gap_s=0.6)
    found = maps.read_tested(tmp_path / "x.parquet")
    assert (found.subjects, found.gap_s) == (7, 0.6)
    assert found.whole == [("all", "b"), ("all", "a")]
    assert found.by_scenario == [("iC", "b"), ("sC", "b"), ("iC", "a")]
    assert found.of_half_the_group == list(found.maps)[:4]
    for one in tested:
        key = (one.scenario, one.name)
        assert found.conditions[key] == (one.plus, one.minus)
        assert found.maps[key].n == len(one.units)
        np.testing.assert_allclose(found.maps[key].difference, one.result.difference, rtol=1e-6)
        np.testing.assert_array_equal(found.maps[key].significant, one.result.test.significant)
        np.testing.assert_allclose(found.maps[key].times, AXES["times"], atol=1e-12)
        assert list(found.maps[key].frequencies) == AXES["frequency_hz"]

    strata = [contrast(rng, place, "a", 1, (3, 2, 7)) for place in ("iC, turn no", "iC, turn yes")]
    tables.write_tested(strata, AXES, tmp_path / "y.parquet", tables.ERSP_STRATA, subjects=7, gap_s=np.nan)
    within = maps.read_tested(tmp_path / "y.parquet")
    assert list(within.maps) == [("iC, turn no", "a"), ("iC, turn yes", "a")]
    assert np.isnan(within.gap_s)
    assert not within.maps["iC, turn no", "a"].tested


def test_one_channels_waves(tmp_path):
    rng = np.random.default_rng(2)
    tested = [contrast(rng, "all", "a", 5, (3, 7)), contrast(rng, "sC", "a", 1, (3, 7))]
    own = [tuple(GrandAverage.of("", "", rng.standard_normal((len(t.units), 3, 7))) for _ in "+-") for t in tested]
    path = tmp_path / "erp_stats.parquet"
    tables.write_tested(tested, ERP_AXES, path, tables.ERP_STATS, subjects=5, gap_s=0.6, own=own)
    waves = maps.read_contrast_waves(path, "Cz")
    assert list(waves) == [("all", "a"), ("sC", "a")]
    np.testing.assert_allclose(waves["all", "a"].plus, own[0][0].mean[1], rtol=1e-6)
    np.testing.assert_allclose(waves["all", "a"].minus_error, own[0][1].sd[1] / np.sqrt(5), rtol=1e-6)
    np.testing.assert_allclose(waves["all", "a"].sd, tested[0].result.sd[1], rtol=1e-6)
    assert np.isnan(waves["sC", "a"].plus_error).all()


def test_a_study_without_contrasts_has_none_tested(tmp_path):
    tables.write_tested([], ERP_AXES, tmp_path / "x.parquet", tables.ERP_STATS, subjects=3, gap_s=0.6)
    found = maps.read_tested(tmp_path / "x.parquet")
    assert found.maps == {}
    assert found.whole == found.by_scenario == found.of_half_the_group == []


def test_positions_are_those_of_the_channels_that_are_asked_for(tmp_path):
    from hrcneuro.io.tables import write_table

    info = mne.create_info(["Cz", "Fz", "E1"], 100.0, "eeg")
    places = {"Cz": (0.0, 0.0, 0.1), "Fz": (0.0, 0.06, 0.08)}
    info.set_montage(mne.channels.make_dig_montage(places, coord_frame="head"), on_missing="ignore")
    write_table(tables.positions(info), tmp_path / "channels.parquet", tables.CHANNELS)
    places = maps.read_positions(tmp_path / "channels.parquet", ["E1", "Fz"])
    assert np.isnan(places[0]).all()
    assert places[1] == pytest.approx(info["chs"][1]["loc"][:3])
