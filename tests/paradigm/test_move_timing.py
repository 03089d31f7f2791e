"""Onsets: never before the arm is ready, never before a human can react, in the published spread."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.paradigm.conditions import annotate
from hrcneuro.paradigm.timing import IN_RADIUS, TimingParams, assign_onsets

WAYS = st.sampled_from(["at_rest", "in_radius"])


def moves(actors, *, episodes=None, blocks=None):
    n = len(actors)
    return pd.DataFrame(
        {
            "practice": False,
            "block": blocks or [1] * n,
            "episode": episodes or [1] * n,
            "actor": ["human" if a == "H" else "robot" for a in actors],
        }
    )


def timed(trials, seed=0, **params):
    return assign_onsets(trials, rng=np.random.default_rng(seed), params=TimingParams(**params))


@settings(max_examples=30, deadline=None)
@given(st.text("HR", min_size=1, max_size=60), WAYS, st.integers(0, 1000))
def test_no_move_starts_before_the_arm_is_ready_nor_sooner_than_600_ms(actors, start_next, seed):
    out = timed(moves(actors), seed, start_next=start_next)
    ready = out["t_f_s"] if start_next == "at_rest" else IN_RADIUS * out["t_f_s"]
    gap = np.diff(out["onset_s"])
    assert (gap >= ready[:-1] - 1e-9).all()
    assert (gap >= 0.6 - 1e-9).all()
    assert out["t_f_s"].between(0.6, 1.2).all()
    assert out["onset_s"].iloc[0] == TimingParams().lead_in_s


def test_the_robot_starts_at_rest_at_once_and_a_human_needs_time_to_react():
    out = timed(moves("R" * 500))
    np.testing.assert_allclose(np.diff(out["onset_s"]), out["t_f_s"][:-1], atol=1e-9)
    human = timed(moves("H" * 500))
    wait = np.diff(human["onset_s"]) - IN_RADIUS * human["t_f_s"].to_numpy()[:-1]
    pressed = wait[np.diff(human["onset_s"]) > human["t_f_s"].to_numpy()[:-1] + 1e-9]
    assert 0.1 < pressed.mean() < 0.4
    assert np.diff(human["onset_s"]).mean() > np.diff(out["onset_s"]).mean() + 0.05


def test_the_next_mover_decides_about_the_wait():
    out = timed(moves("HR" * 1000), reaction_mean_s=0.5)
    wait = np.diff(out["onset_s"]) - out["t_f_s"].to_numpy()[:-1]
    np.testing.assert_allclose(wait[0::2], 0, atol=1e-9)  # human, then robot
    assert wait[1::2].mean() > 0.3


def test_the_arms_travel_has_the_asked_mean_and_spread():
    t_f = timed(moves("R" * 20000), t_f_mean_s=0.9, t_f_sd_s=0.1)["t_f_s"]
    assert t_f.mean() == pytest.approx(0.9, abs=0.005)
    assert t_f.std() == pytest.approx(0.1, abs=0.005)
    assert (timed(moves("RR"), t_f_sd_s=0.0)["t_f_s"] == TimingParams().t_f_mean_s).all()


def test_a_spread_that_does_not_fit_is_refused_with_its_limits():
    with pytest.raises(ValueError, match=r"0\.81 ± 0\.5 s does not fit between 0\.6 and 1\.2 s"):
        timed(moves("RR"), t_f_mean_s=0.81, t_f_sd_s=0.5)


def test_pauses_lie_between_episodes_and_breaks_between_blocks():
    out = timed(moves("RRRR", episodes=[1, 2, 2, 1], blocks=[1, 1, 1, 2]), pause_s=2.0, break_s=10.0)
    rest = np.diff(out["onset_s"]) - out["t_f_s"].to_numpy()[:-1]
    assert 2.0 <= rest[0] <= 3.0
    assert rest[1] == pytest.approx(0)
    assert 12.0 <= rest[2] <= 18.0


def test_times_given_to_the_logs_have_the_published_durations(logs):
    tables = [annotate(assign_onsets(t, rng=np.random.default_rng(i))) for i, t in enumerate(logs.values())]
    both = pd.concat(tables)
    soa = both[~both["practice"]].groupby("scenario")["soa_s"]
    for scenario, mean, sd in (("sC", 0.8759, 0.1339), ("iC", 0.8723, 0.1314)):
        assert soa.mean()[scenario] == pytest.approx(mean, abs=0.02)
        assert soa.std()[scenario] == pytest.approx(sd, abs=0.02)
    assert all(t["onset_s"].is_monotonic_increasing for t in tables)
