import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.robot.minimum_jerk import minimum_jerk, minimum_jerk_cost
from hrcneuro.robot.parameters import Bounds
from hrcneuro.robot.trajectory import BoundedPath, MovingStart, NoPath, Stop, TileMove

APPROACH = Bounds(0.25, 1.0, 10.0)


def test_equation_2_as_printed():
    t_f, t = 0.9, np.linspace(0, 0.9, 50)
    printed = 6 / t_f**5 * t**5 - 15 / t_f**4 * t**4 + 10 / t_f**3 * t**3
    assert np.allclose(minimum_jerk(t / t_f)[0], printed, atol=1e-14)


def test_derivatives_are_derivatives():
    u = np.linspace(0.001, 0.999, 500)
    h = 1e-5
    for k in range(3):
        slope = (minimum_jerk(u + h)[k] - minimum_jerk(u - h)[k]) / (2 * h)
        assert np.abs(slope - minimum_jerk(u)[k + 1]).max() < 1e-6


@settings(deadline=None)
@given(st.floats(-2, 3))
def test_minimum_jerk_is_symmetric_and_rests_outside(u):
    s, rate, bend, _ = (float(v) for v in minimum_jerk(np.float64(u)))
    mirrored = [float(v) for v in minimum_jerk(np.float64(1 - u))]
    assert s + mirrored[0] == pytest.approx(1.0, abs=1e-12)
    assert rate == pytest.approx(mirrored[1], abs=1e-12)
    if u <= 0 or u >= 1:
        assert (s, rate, bend) == (float(u >= 1), 0.0, 0.0)


def test_known_peaks_and_cost():
    u = np.linspace(0, 1, 200001)
    _, rate, bend, jerk = minimum_jerk(u)
    assert rate.max() == pytest.approx(1.875)  # 15/8 (Flash & Hogan, J Neurosci 1985)
    assert np.abs(bend).max() == pytest.approx(10 / np.sqrt(3), rel=1e-6)
    assert np.mean(jerk**2) == pytest.approx(720.0, rel=1e-3)
    assert minimum_jerk_cost(0.07, 0.6) == pytest.approx(720 * 0.07**2 / 0.6**5)


def test_no_other_quintic_through_the_same_ends_has_less_jerk():
    u = np.linspace(0, 1, 2001)
    s = minimum_jerk(u)[0]
    best = np.mean(np.diff(s, 3) ** 2)
    for amplitude in (-0.05, 0.02, 0.1):
        other = s + amplitude * (u * (1 - u)) ** 3
        assert np.mean(np.diff(other, 3) ** 2) > best


def test_a_tile_move_follows_equation_1():
    move = TileMove((0.1, -0.2, 0.3), (0.17, -0.2, 0.3), 0.8)
    for t in (-1.0, 0.0, 0.1, 0.4, 0.79, 0.8, 2.0):
        at, v = move.at(t)
        s, rate, _, _ = minimum_jerk(np.float64(t / 0.8))
        assert np.allclose(at, (0.1 + 0.07 * s, -0.2, 0.3), atol=1e-15)
        assert np.allclose(v, (0.07 * rate / 0.8, 0, 0), atol=1e-15)


@pytest.mark.parametrize("t", [0.0, 0.2, 0.45, 0.9])
def test_states_are_derivatives(t):
    move = TileMove((0.1, -0.2, 0.3), (0.17, -0.2, 0.3), 0.9)
    taken = MovingStart(move.state(0.8), (0.17, -0.13, 0.3), 0.9)
    for path in (move, taken):
        h = 1e-6
        position, velocity, acceleration = path.state(t)
        assert path.at(t) == (position, velocity)
        if 0 < t < 0.9:
            low, high = path.at(t - h), path.at(t + h)
            assert np.allclose(np.subtract(high[0], low[0]) / (2 * h), velocity, atol=1e-8)
            assert np.allclose(np.subtract(high[1], low[1]) / (2 * h), acceleration, atol=1e-7)


def test_a_move_that_takes_over_is_continuous_and_ends_at_rest():
    motion = TileMove((0.1, -0.2, 0.3), (0.17, -0.2, 0.3), 0.9).state(0.8)
    taken = MovingStart(motion, (0.17, -0.13, 0.3), 0.7)
    assert np.allclose(taken.state(0.0), motion, atol=1e-15)
    assert np.allclose(taken.state(0.7), ((0.17, -0.13, 0.3), (0, 0, 0), (0, 0, 0)), atol=1e-12)
    assert np.allclose(taken.state(9.0), taken.state(0.7))


def test_from_rest_it_is_equation_1():
    start, end = (0.1, -0.2, 0.3), (0.17, -0.2, 0.3)
    taken, move = MovingStart((start, (0.0,) * 3, (0.0,) * 3), end, 0.8), TileMove(start, end, 0.8)
    for t in np.linspace(0, 0.8, 9):
        assert np.allclose(taken.state(t), move.state(t), atol=1e-12)


def test_an_approach_is_straight_and_within_bounds():
    start, end = np.array([-0.8, 0.2, -0.08]), np.array([-1.2, -0.14, -0.08])
    path = BoundedPath(start, end, APPROACH)
    t = np.arange(0, path.duration, 0.002)
    states = np.array([path.state(x) for x in t])
    position, velocity, acceleration = states[:, 0], states[:, 1], states[:, 2]
    way = end - start
    across = np.cross(position - start, way / np.linalg.norm(way))
    assert np.abs(across).max() < 1e-9
    assert np.abs(velocity).max() <= APPROACH.velocity + 1e-9
    assert np.abs(acceleration).max() <= APPROACH.acceleration + 1e-9
    assert np.abs(np.diff(acceleration, axis=0)).max() / 0.002 <= APPROACH.jerk + 1e-6
    assert np.allclose(path.at(path.duration)[0], end)
    assert np.allclose(path.at(99.0)[1], 0.0)


def test_retargeting_on_the_move_is_continuous():
    first = BoundedPath((-0.8, 0.0, -0.08), (-1.0, 0.0, -0.08), APPROACH)
    state = first.state(0.4 * first.duration)
    second = BoundedPath(state[0], (-1.0, 0.14, -0.08), APPROACH, velocity=state[1], acceleration=state[2])
    assert np.allclose(second.state(0.0), state, atol=1e-12)
    assert np.allclose(second.at(second.duration)[0], (-1.0, 0.14, -0.08))


def test_a_path_of_no_length_takes_no_time():
    assert BoundedPath((1.0, 2.0), (1.0, 2.0), APPROACH).duration == 0.0


def test_an_impossible_path_is_refused():
    with pytest.raises(NoPath, match="nan"):
        BoundedPath((0.0, 0.0, 0.0), (float("nan"), 0.0, 0.0), APPROACH)
    with pytest.raises(NoPath, match="no jerk-limited path"):
        BoundedPath((0.0,), (1.0,), Bounds(0.0, 0.0, 0.0))


def test_a_stop_is_jerk_limited_and_keeps_direction():
    bounds = Bounds(4.0, 8.0, 200.0)
    qd = np.array([0.8, -0.4, 0.2, 0.0, 0.1, -0.05])
    stop = Stop(qd.tolist(), bounds)
    t = np.arange(0, stop.duration, 0.001)
    values = np.array([stop.at(x) for x in t])
    assert np.allclose(values[0], qd)
    assert not np.any(stop.at(stop.duration))
    acceleration = np.diff(values, axis=0) / 0.001
    assert np.abs(acceleration).max() <= 8.0 + 1e-6
    assert np.abs(np.diff(acceleration, axis=0)).max() / 0.001 <= 200.0 + 1e-3
    share = values[:, :1] / qd[0]
    assert np.allclose(values, share * qd, atol=1e-9)
    assert stop.duration < 0.25
