"""What a run has to say on single printed results, from tables and summaries as the stages leave them."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hrcneuro.config import settings as config
from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.published import SOA_MS
from hrcneuro.report import measured_brain, measured_learning, measured_moves
from hrcneuro.report.results import Results

DECODERS = ("emp", "60", "70", "80")


def curves(levels, *, sd=0.15, n=100, episode=measured_learning._EARLY):
    """Return the curves at one episode; ``levels`` is curve -> mean."""
    lines = [(*name.split(" ", 1), episode, mean, sd, n) for name, mean in levels.items()]
    return pd.DataFrame(lines, columns=["simulation", "variant", "episode", "mean", "sd", "n"])


def sizes(four, six, ten, **how):
    cases = {"SIM2 {}": four, "SIM4 6/3 {}": six, "SIM4 10/5 {}": ten}
    return curves({case.format(v): mean for case, mean in cases.items() for v in DECODERS}, **how)


@pytest.mark.parametrize(
    ("means", "sd", "expected"),
    [
        ((0.80, 0.76, 0.72), 0.15, True),
        ((0.80, 0.79, 0.78), 0.15, None),  # in order, by chance
        ((0.80, 0.79, 0.78), 0.01, True),
        ((0.72, 0.76, 0.80), 0.15, False),
        ((0.80, 0.79, 0.85), 0.15, False),
    ],
)
def test_more_subtasks_are_slower_only_beyond_the_monte_carlo_error(means, sd, expected):
    found = measured_learning._fourth(sizes(*means, sd=sd))["sim4"]
    assert found.agrees is expected
    assert ("within twice its Monte-Carlo error" in found.why) == (expected is None)


@pytest.mark.parametrize(("two", "expected"), [(0.85, True), (0.78, None), (0.70, False)])
def test_how_subtasks_are_shared_is_told_only_beyond_the_monte_carlo_error(two, expected):
    table = {"SIM4 10/5 emp": 0.77, "SIM4 10/2 emp": two, "SIM4 10/8 emp": 2 * 0.77 - two}
    found = measured_learning._fourth(curves(table, episode=measured_learning._LATE))
    assert found["sim4 2"].agrees is expected
    assert found["sim4 8"].agrees is expected


@pytest.mark.parametrize(("two", "eight", "alike"), [(0.78, 0.76, True), (0.85, 0.76, False), (0.78, 0.70, False)])
def test_imbalance_matters_where_it_exceeds_the_monte_carlo_error(two, eight, alike):
    table = {"SIM4 10/5 emp": 0.77, "SIM4 10/2 emp": two, "SIM4 10/8 emp": eight}
    found = measured_learning._fourth(curves(table, episode=measured_learning._LATE))["sim4 balance"]
    assert found.agrees is alike
    assert "5 of 10: 77 %" in found.text


@pytest.mark.parametrize(("soa_s", "expected"), [(0.87, False), (1.9, True), (2.6, False)])
def test_a_trial_of_two_seconds_is_measured_not_taken(soa_s, expected):
    found = measured_moves._durations(pd.DataFrame({"scenario": ["sC", "iC"] * 50, "soa_s": soa_s}))
    assert found["soa 2 s"].agrees is expected


@pytest.mark.parametrize(
    ("shift", "stretch", "expected"), [(0, 1, True), (30, 1, False), (0, 1.2, False), (0, 0, False)]
)
def test_durations_agree_in_mean_and_spread(shift, stretch, expected):
    z = np.resize([-1.0, 1.0], 1000)
    parts = [
        pd.DataFrame({"scenario": scenario, "soa_s": (mean + shift + stretch * sd * z) / 1000})
        for scenario, (mean, sd) in SOA_MS.items()
    ]
    found = measured_moves._durations(pd.concat(parts))
    assert [found[f"soa {scenario}"].agrees for scenario in SOA_MS] == [expected, expected]


def brain(*assignments):
    """Return what is measured of maps in which nothing is significant."""
    times, channels, hz = np.arange(-0.2, 1.2, 0.1), ["Fz", "C3", "T7"], np.arange(2.0, 31.0, 2.0)
    cases = [("all", contrast) for contrast in measured_brain.PANELS.values()]
    cases += [(scenario, measured_brain.BEFORE) for scenario in ("sC", "iC")]
    tested = {}
    for stage, shape, bins in (("erp", (3, 14), np.zeros(0)), ("ersp", (3, len(hz), 14), hz)):
        nothing = SignificanceMap(11, channels, times, np.zeros(shape), np.zeros(shape, dtype=bool), bins)
        tested[stage] = dict.fromkeys(cases, nothing)
    settings = config.load(None, list(assignments))
    results = SimpleNamespace(settings=settings, maps=tested.get, included=lambda stage: [])
    return measured_brain.measure(results)


def test_what_a_simulation_has_planted_follows_its_settings():
    always_absent = {"ersp D", "ersp 3 early"}
    assert {k for k, m in brain().items() if not m.planted} == always_absent
    without = {k for k, m in brain("acquire.eeg.effect=none").items() if not m.planted}
    assert without == always_absent | {"erp C", "erp iC", "ersp C theta", "ersp 3 theta", "ersp 3 more"}
    alike = {k for k, m in brain("acquire.eeg.sequential_share=1").items() if not m.planted}
    assert alike == always_absent | {"ersp 3 more"}


@pytest.mark.parametrize("events", [5, 10])
def test_the_printed_minutes_are_those_of_ten_events_an_episode(events, tmp_path):
    curves({"SIM1 emp": 0.7}).to_parquet(tmp_path / "curves.parquet")
    found = learned(tmp_path, f"simulate.events={events}")
    assert found["minutes 35"].text == "11.7 min at 2 s, 5.8 at 1 s a trial"
    assert found["minutes 35"].agrees is False


def learned(folder, *assignments):
    """Return what is measured of a run of simulate that left its tables in a folder."""
    artifacts = {path.name: path for path in folder.iterdir()}
    item = SimpleNamespace(stage="simulate", unit="group", state="hit", artifacts=artifacts, summary={})
    return measured_learning.measure(Results(config.load(None, list(assignments)), [item]))


@pytest.mark.parametrize(
    ("reasons", "text", "agrees"),
    [({}, "0", True), ({"boundary": 3}, "0 (3 for other reasons)", True), ({"amplitude": 2, "marked": 1}, None, False)],
)
def test_epochs_are_counted_as_excluded_for_their_amplitude_alone(reasons, text, agrees):
    summary = {"reasons": reasons, "rejected": sum(reasons.values()), "outlier": False}
    item = SimpleNamespace(stage="epoch", unit="s01", state="hit", artifacts={}, summary=summary)
    found = measured_moves.measure(Results(config.load(None), [item]))["rejected"]
    assert found.agrees is agrees
    assert found.text == (text or "2 (1 for other reasons)")


def test_too_few_episodes_are_told_from_a_stage_that_has_not_run(tmp_path):
    curves({"SIM1 emp": 0.7}, episode=35).to_parquet(tmp_path / "curves.parquet")
    found = learned(tmp_path, "simulate.episodes=50")
    assert found["sim 35"].agrees is not None
    for key in ("sim 100", "sim4 2", "sim4 8", "sim4 balance"):
        assert found[key].agrees is None
        assert "simulate.episodes = 50" in found[key].why
    assert "sim4" not in found
