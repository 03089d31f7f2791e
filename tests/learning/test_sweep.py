from dataclasses import replace

import numpy as np
import pytest

from hrcneuro.learning.grid import GridPoint, grid, parts
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.sweep import columns, episodes_in_time, needed, run_points

BASE = GridPoint(events=10, subtasks=4, chosen=2, period=0, accuracy=57.0, alpha=0.05, tau=0.1)
RUN = {"episodes": 40, "repetitions": 60, "seed": 1}


def test_grid_is_full_sorted_and_possible():
    points = grid({"accuracy": (60, 55), "subtasks": (2, 4, 10)}, otherwise=BASE)
    assert len(points) == 6
    assert points == sorted(points)
    assert {(c.subtasks, c.chosen) for c in points} == {(2, 1), (4, 2), (10, 5)}  # m keeps its share
    some = grid({"subtasks": (2, 4), "chosen": (1, 3)}, otherwise=BASE)
    assert {(c.subtasks, c.chosen) for c in some} == {(2, 1), (4, 1), (4, 3)}
    assert grid({}, otherwise=BASE) == [BASE]
    with pytest.raises(ValueError, match="'beta' is no axis; allowed: events"):
        grid({"beta": (1,)}, otherwise=BASE)


def test_workers_change_nothing():
    points = grid({"accuracy": (55, 70), "subtasks": (2, 4), "alpha": (0.05, 0.2), "period": (0, 10)}, otherwise=BASE)
    whole = run_points(points, None, **RUN)
    for count in (3, 5, 100):
        split = parts(points, count)
        assert [c for part in split for c in part] == points
        assert [r for part in split for r in run_points(part, None, **RUN)] == whole


def test_a_better_decoder_is_faster_and_the_expectation_agrees():
    points = grid({"accuracy": (51, 58, 65, 80)}, otherwise=BASE)
    found = run_points(points, None, episodes=60, repetitions=300, seed=3)
    assert found[0].episode is None
    assert found[0].expected_episode is None
    episodes = [r.episode for r in found[1:]]
    assert episodes == sorted(episodes, reverse=True)
    for r in found[1:]:
        assert r.expected_episode == pytest.approx(r.episode, abs=max(2, 0.15 * r.episode))


def test_expectation_is_left_out_where_there_is_none():
    kind = kinds(alpha=0.05, ddof=0, horizon=40)["adaptive"]
    points = grid({"accuracy": (80,), "period": (0, 10)}, otherwise=BASE)
    assert [r.expected_episode is None for r in run_points(points, None, **RUN)] == [False, True]
    assert [r.expected_episode is None for r in run_points(points, kind, **RUN)] == [True, True]


def test_another_learner_can_be_swept():
    kind = kinds(alpha=0.05, ddof=0, horizon=40)["bayes_graded"]
    point = [GridPoint(10, 4, 2, 0, 57.0, 0.05, 0.1)]
    assert run_points(point, kind, **RUN)[0].final > run_points(point, None, **RUN)[0].final + 0.05


def test_ddof_is_a_change_of_scale():
    # Eq 6 with N - 1 leaves a memory smaller by c: the same as steps and temperature larger by 1 / c.
    c = np.sqrt(7 / 8)
    point = replace(BASE, accuracy=65.0)
    one = run_points([point], None, ddof=1, **RUN)[0]
    scaled = run_points([replace(point, alpha=point.alpha / c, tau=point.tau / c)], None, **RUN)[0]
    assert one.final == pytest.approx(scaled.final, abs=1e-6)
    assert (one.episode, one.expected_episode) == (scaled.episode, scaled.expected_episode)
    assert one.final != pytest.approx(run_points([point], None, **RUN)[0].final, abs=2e-5)


@pytest.mark.parametrize("kind", [None, kinds(alpha=0.05, ddof=0, horizon=40)["bayes"]])
def test_an_episode_of_two_events_teaches_twice_with_carry_over(kind):
    point = replace(BASE, events=2, accuracy=75.0)
    once, twice = (run_points([point], kind, carry_over=carry_over, **RUN)[0] for carry_over in (False, True))
    assert twice.final > once.final + 0.02
    assert twice.episode == pytest.approx(once.episode / 2, rel=0.25)
    if kind is None:
        assert twice.expected_episode == pytest.approx(once.expected_episode / 2, abs=1)


def test_columns_are_flat_and_missing_is_nan():
    found = run_points(grid({"accuracy": (50, 80)}, otherwise=BASE), None, **RUN)
    table = columns(found)
    assert table["accuracy"].tolist() == [50, 80]
    assert np.isnan(table["episode"]).tolist() == [True, False]
    assert (table["final_half_width"] > 0).all()


def test_what_is_needed_lies_where_the_line_between_two_values_crosses_the_level():
    found = needed(np.array([50.0, 60.0, 70.0]), np.array([0.5, 0.7, 0.9]), np.array([0.1, 0.1, 0.1]))
    assert (found.accuracy, found.low, found.high) == pytest.approx((65, 60, 70))
    assert (found.below, found.above) == (60, 70)


def test_what_is_needed_may_lie_outside_what_was_swept():
    accuracy, half = np.array([50.0, 60.0]), np.array([0.05, 0.05])
    least = needed(accuracy, np.array([0.9, 0.95]), half)
    assert (least.accuracy, least.above) == (50, 50)
    assert np.isnan(least.below)
    most = needed(accuracy, np.array([0.5, 0.78]), half)
    assert np.isnan([most.accuracy, most.high, most.above]).all()
    assert 50 < most.low < most.below == 60


@pytest.mark.parametrize(
    ("events", "trial_s", "episodes", "last"),
    [(10, 1.0, 200, 60), (10, 2.0, 200, 30), (7, 1.0, 200, 85), (10, 1.0, 40, 40), (1000, 2.0, 40, 1)],
)
def test_ten_minutes_are_so_many_episodes(events, trial_s, episodes, last):
    assert episodes_in_time(events, trial_s, episodes) == last
