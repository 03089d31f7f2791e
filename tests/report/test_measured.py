"""What a run has to say on single printed results, from tables and summaries as the stages leave them."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hrcneuro.config import settings as config
from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.pipeline.item import Item, State
from hrcneuro.published import SOA_MS
from hrcneuro.report import measured_arm, measured_brain, measured_learning, measured_moves
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


@pytest.mark.parametrize(
    ("two", "eight", "n", "alike"),
    [
        (0.78, 0.76, 1000, True),
        (0.78, 0.76, 100, None),  # alike, or too few repetitions to see a difference
        (0.87, 0.76, 100, False),
        (0.78, 0.67, 100, False),
        (0.87, 0.76, 5, None),
    ],
)
def test_comparable_is_within_five_points_beyond_the_monte_carlo_error(two, eight, n, alike):
    table = {"SIM4 10/5 emp": 0.77, "SIM4 10/2 emp": two, "SIM4 10/8 emp": eight}
    found = measured_learning._fourth(curves(table, episode=measured_learning._LATE, n=n))["sim4 balance"]
    assert found.agrees is alike
    assert "5 of 10: 77 %" in found.text


@pytest.mark.parametrize(
    ("carry_over", "n", "expected"),
    [(False, 100, None), (True, 100, None), (False, 25_000, True), (True, 25_000, False)],
)
def test_sim1_tells_the_readings_of_the_first_event_apart_or_says_that_it_cannot(carry_over, n, expected):
    # Measured with 20,000 repetitions of each reading.
    means = (0.7108, 0.8110) if carry_over else (0.7013, 0.8020)
    for episode, mean in zip((35, 100), means, strict=True):
        found = measured_learning._first(curves({"SIM1 emp": mean}, sd=0.195, n=n, episode=episode))[f"sim {episode}"]
        assert found.agrees is expected
        assert ("simulate.repetitions = 25000" in found.why) == (expected is None)
        assert found.reading


def test_sim1_far_off_differs_however_few_the_repetitions():
    assert measured_learning._first(curves({"SIM1 emp": 0.55}, episode=35))["sim 35"].agrees is False


@pytest.mark.parametrize(
    ("loss", "half_width", "expected"),
    [(0.02, 0.02, True), (-0.2, 0.02, True), (0.02, 0.06, None), (0.12, 0.04, False)],
)
def test_no_notable_loss_is_more_than_a_loss_that_was_not_seen(loss, half_width, expected, tmp_path):
    table = {"variant": ["emp"], "assignment": [5], "loss": [loss], "loss_half_width": [half_width]}
    pd.DataFrame(table).to_parquet(tmp_path / "relearning.parquet")
    curves({"SIM1 emp": 0.7}).to_parquet(tmp_path / "curves.parquet")
    assert learned(tmp_path)["sim3"].agrees is expected


def kept(**by_case):
    """Return condition counts; case -> (trials in sC, in iC)."""
    rows = [
        (case, place, scenario, count)
        for case, counts in by_case.items()
        for place in ("before", "after")
        for scenario, count in zip(("sC", "iC"), counts, strict=True)
    ]
    return {"s01": pd.DataFrame(rows, columns=["case", "position", "scenario", "kept"])}


def test_half_is_half_of_each_condition():
    half = measured_moves._counts(kept(HH=(300, 300), HR=(70, 75), RR=(260, 270), RH=(100, 110)), exact=False)["half"]
    assert half.agrees is True
    lopsided = measured_moves._counts(kept(HH=(335, 276), HR=(62, 87), RR=(295, 236), RH=(59, 153)), exact=True)["half"]
    assert lopsided.agrees is False
    assert lopsided.text == "HH 55 %, HR 42 %, RR 56 %, RH 28 %; all together 50 %"
    one_sided = measured_moves._counts(kept(HH=(0, 276)), exact=False)["half"]
    assert one_sided.agrees is False


@pytest.mark.parametrize(
    ("cases", "expected"),
    [(["HH", "HR", "RR", "RH"], True), (["HR", "RH"], False), (["RR", "HR"], False), (["HH", "RR"], False)],
)
def test_not_every_mistake_leads_to_a_takeover(cases, expected):
    moves = pd.DataFrame({"prev_error": [True] * len(cases) + [False], "case": [*cases, "HH"]})
    assert measured_moves._mistakes(moves)["mistakes"].agrees is expected


@pytest.mark.parametrize(
    ("motion_ms", "jitter_ms", "expected"), [(5.0, 1.0, True), (5.0, 6.0, False), (60.0, 1.0, False)]
)
def test_markers_are_judged_by_how_far_they_are_from_the_motion(motion_ms, jitter_ms, expected, tmp_path):
    z = np.resize([-1.0, 1.0], 100)
    table = {"stim_latency_ms": np.nan, "marker_latency_ms": 0.5, "trigger_latency_ms": motion_ms + jitter_ms * z}
    pd.DataFrame(table).to_parquet(tmp_path / "moves.parquet")
    item = Item("robot", "s01", state=State.HIT, artifacts={"moves.parquet": str(tmp_path / "moves.parquet")})
    found = measured_arm.measure(Results(config.load(None), [item]))["timing"]
    assert found.agrees is expected
    assert found.rests_on == "arm"


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
        for scenario, (mean, sd) in ((s, printed.value) for s, printed in SOA_MS.items())
    ]
    found = measured_moves._durations(pd.concat(parts))
    assert [found[f"soa {scenario}"].agrees for scenario in SOA_MS] == [expected, expected]


def brain(*assignments):
    """Return what is measured of maps in which nothing is significant; there are no waveforms."""
    times, channels, hz = np.arange(-0.2, 1.2, 0.1), ["Fz", "C3", "T7"], np.arange(2.0, 31.0, 2.0)
    cases = [("all", contrast) for contrast in measured_brain.PANELS.values()]
    cases += [(scenario, measured_brain.BEFORE) for scenario in ("sC", "iC")]
    tested = {}
    for stage, shape, bins in (("erp", (3, 14), np.zeros(0)), ("ersp", (3, len(hz), 14), hz)):
        nothing = SignificanceMap(11, channels, times, np.zeros(shape), np.zeros(shape, dtype=bool), bins)
        tested[stage] = dict.fromkeys(cases, nothing)
    settings = config.load(None, list(assignments))
    results = SimpleNamespace(settings=settings, maps=tested.get, path=lambda *which: None)
    return measured_brain.measure(results)


def test_what_a_simulation_has_planted_follows_its_settings():
    always_absent = {"ersp D", "ersp 3 early"}
    assert {k for k, m in brain().items() if not m.planted} == always_absent
    without = {k for k, m in brain("acquire.eeg.effect=none").items() if not m.planted}
    assert without == always_absent | {"erp C", "erp iC", "ersp C theta", "ersp 3 theta", "ersp 3 more", "locked"}
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
    item = Item("simulate", "group", state=State.HIT, artifacts=artifacts)
    return measured_learning.measure(Results(config.load(None, list(assignments)), [item]))


@pytest.mark.parametrize(
    ("reasons", "text", "agrees"),
    [({}, "0", True), ({"boundary": 3}, "0 (3 for other reasons)", True), ({"amplitude": 2, "marked": 1}, None, False)],
)
def test_epochs_are_counted_as_excluded_for_their_amplitude_alone(reasons, text, agrees):
    summary = {"reasons": reasons, "rejected": sum(reasons.values()), "outlier": False}
    item = Item("epoch", "s01", state=State.HIT, summary=summary)
    found = measured_moves.measure(Results(config.load(None), [item]))["rejected"]
    assert found.agrees is agrees
    assert found.text == (text or "2 (1 for other reasons)")


def test_too_few_episodes_are_told_from_a_stage_that_has_not_run(tmp_path):
    curves({"SIM1 emp": 0.7}, episode=35).to_parquet(tmp_path / "curves.parquet")
    found = learned(tmp_path, "simulate.episodes=50")
    assert "simulate.episodes" not in found["sim 35"].why
    for key in ("sim 100", "sim4 2", "sim4 8", "sim4 balance"):
        assert found[key].agrees is None
        assert "simulate.episodes = 50" in found[key].why
    assert "sim4" not in found
