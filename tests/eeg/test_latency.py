"""Latencies: delays that were planted lie in their intervals as often as these promise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.eeg import latency as lat


@pytest.mark.parametrize("draw", ["normal", "laplace", "exponential"])
def test_the_interval_of_the_median_holds_it_in_95_of_100_cases_whatever_the_distribution(draw):
    rng = np.random.default_rng(1)
    middle = {"normal": 37.0, "laplace": 37.0, "exponential": 37.0 + np.log(2)}[draw]
    hits = 0
    for _ in range(1000):
        found = lat.latency(37.0 + getattr(rng, f"standard_{draw}" if draw != "laplace" else draw)(size=200)).delay
        hits += found.low <= middle <= found.high
    assert 0.93 <= hits / 1000 <= 0.985


def test_what_some_latencies_amount_to():
    found = lat.latency(np.array([1.0, 2.0, 3.0, 4.0, 10.0, np.nan]))
    assert (found.n, found.delay.value, found.low, found.high, found.worst) == (5, 3.0, 1.0, 10.0, 7.0)
    assert found.sd == pytest.approx(np.std([1, 2, 3, 4, 10], ddof=1))
    assert lat.latency(np.array([5.0])).sd == 0
    assert lat.latency(np.array([])).n == 0


def test_a_slope_agrees_with_scipy():
    from scipy.stats import linregress, t

    rng = np.random.default_rng(2)
    x = rng.random(50)
    y = 3 * x + 0.1 * rng.standard_normal(50)
    found, wanted = lat.slope(x, y), linregress(x, y)
    assert found.value == pytest.approx(wanted.slope)
    assert found.half == pytest.approx(t.ppf(0.975, 48) * wanted.stderr)
    assert np.isnan(lat.slope(x[:2], y[:2]).value)
    assert np.isnan(lat.slope(np.ones(5), np.arange(5.0)).value)


@pytest.mark.parametrize("kind", ["normal", "uniform", "laplace"])
def test_the_jitter_lies_in_its_interval_about_as_often_as_that_promises(kind):
    rng = np.random.default_rng(3)
    true = {"normal": 1.0, "uniform": 1 / np.sqrt(12), "laplace": np.sqrt(2)}[kind]
    found = [lat.latency(getattr(rng, kind)(size=400)).jitter for _ in range(400)]
    assert 0.9 < np.mean([one.low <= true <= one.high for one in found]) < 0.99


@pytest.mark.parametrize("ppm", [-200.0, 0.0, 50.0])
def test_drift_lies_in_its_interval_as_often_as_that_promises(ppm):
    rng = np.random.default_rng(3)
    hits = 0
    for _ in range(300):
        when = np.sort(rng.random(500) * 1800)
        found = lat.drift_ppm(np.rint(when * 1000 * (1 + ppm * 1e-6)), when, 1000.0)
        hits += found.low <= ppm <= found.high
        assert found.half < 0.1
    assert 0.9 < hits / 300 < 0.99


def test_events_in_step_with_the_samples_leave_the_drift_as_uncertain_as_a_sample_is_long():
    when = np.arange(60.0)
    found = lat.drift_ppm(when * 1000, when, 1000.0)
    assert found.value == pytest.approx(0, abs=1e-6)
    assert found.half == pytest.approx(1.96e6 / np.sqrt(12) / 1000 / np.sqrt(60 * (60**2 - 1) / 12), rel=1e-3)


@given(
    st.lists(st.floats(0, 100), min_size=1, max_size=20),
    st.lists(st.floats(0, 100), max_size=20).map(sorted),
    st.floats(0.01, 5),
    st.floats(-1, 1),
)
def test_the_nearest_is_the_nearest(events, others, window, expected):
    found = lat.nearest(np.array(events), np.array(others), window=window, expected=expected)
    for event, at in zip(events, found, strict=True):
        distances = np.abs(np.array(others) - (event + expected))
        best = distances.min(initial=np.inf)
        assert (at >= 0) == (best <= window)
        assert at < 0 or distances[at] == best
