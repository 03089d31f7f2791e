import numpy as np
import pytest

from hrcneuro.robot.limits import ACCELERATION, BOX, INVALID, MAX_SPEED, RANGE, SPEED, Limits
from hrcneuro.robot.parameters import Safety
from hrcneuro.robot.tracking import tip

STEP = 12.0 * 0.008


@pytest.fixture
def limits(workspace):
    return Limits(Safety(), box=workspace.box, tool=0.1)


@pytest.fixture
def q(workspace):
    return workspace.reach.q[3, 3].tolist()


def test_a_modest_command_passes_untouched(limits, q):
    qd = [0.05, -0.02, 0.03, 0.0, 0.01, 0.0]
    assert limits(q, qd, [0.0] * 6) == (qd, 0)


def test_the_manuals_joint_speeds():
    assert np.allclose(np.degrees(MAX_SPEED), (120, 120, 180, 180, 180, 180))


@pytest.mark.parametrize("joint", range(6))
def test_speed_is_scaled_uniformly(joint, workspace):
    wide = Limits(Safety(max_acceleration=1e6), box=((-9,) * 3, (9,) * 3), tool=0.1)
    asked = [0.3, -0.3, 0.2, 0.1, -0.2, 0.3]
    asked[joint] = -10.0
    sent, met = wide([0.0] * 6, list(asked), [0.0] * 6)
    assert met == SPEED
    assert max(abs(v) / m for v, m in zip(sent, MAX_SPEED, strict=True)) == pytest.approx(1.0)
    assert np.allclose(np.array(sent) / asked, sent[joint] / asked[joint])


def test_acceleration_scales_the_whole_change(limits, q):
    last = [0.1, 0.0, -0.1, 0.0, 0.0, 0.0]
    sent, met = limits(q, [0.5, 0.0, -0.3, 0.0, 0.0, 0.0], last)
    assert met == ACCELERATION
    change = np.subtract(sent, last)
    assert np.abs(change).max() == pytest.approx(STEP)
    assert change[2] / change[0] == pytest.approx(-0.2 / 0.4)


def test_a_joint_brakes_before_the_end_of_its_range():
    wide = Limits(Safety(), box=((-9,) * 3, (9,) * 3), tool=0.1)
    for sign in (1, -1):
        q, qd = np.zeros(6), [0.0] * 6
        q[5] = sign * 5.5
        met_range = False
        for _ in range(500):
            qd, met = wide(q.tolist(), [0.0] * 5 + [sign * 3.0], qd)
            met_range |= bool(met & RANGE)
            q = q + np.multiply(qd, 0.008)
        assert met_range
        assert abs(q[5]) <= 2 * np.pi
        assert abs(q[5]) > 6.15


def test_a_command_out_of_the_box_is_refused(limits, workspace):
    q = workspace.reach.q[6, 3].tolist()
    down = [0.0, -2.0, 0.0, 0.0, 0.0, 0.0]
    for sign in (1, -1):
        last = [sign * v * 0.3 for v in down]
        sent, met = limits(q, [sign * v for v in down], last)
        if met & BOX:
            assert abs(sent[1]) < abs(last[1])
            break
    else:
        pytest.fail("neither direction left the box")


def test_the_box_is_never_left_whatever_is_asked(limits, workspace):
    """A hostile caller: random full-speed commands for a second each; a refused command is followed by a stop."""
    rng = np.random.default_rng(1)
    low, high = np.array(workspace.box)
    for _ in range(30):
        q, qd = workspace.reach.q[rng.integers(7), rng.integers(7)], [0.0] * 6
        asked, stopping = rng.uniform(-3, 3, 6).tolist(), False
        for _ in range(125):
            qd, met = limits(q.tolist(), [0.0] * 6 if stopping else asked, qd)
            stopping |= bool(met & BOX)
            q = q + np.multiply(qd, 0.008)
            at = np.array(tip(q.tolist(), 0.1))
            assert (at >= low - 1e-9).all()
            assert (at <= high + 1e-9).all()


def test_what_is_seen_to_be_free_at_once_is_not_scaled(limits):
    """The quick look never lets through what the long one would slow down; nearly always it is the quick one."""
    rng, free = np.random.default_rng(0), 0
    for _ in range(3000):
        q = (rng.choice([-1, 1], 6) * rng.uniform(0, 2 * np.pi, 6) ** rng.choice([0.5, 1])).tolist()
        qd = (np.array(MAX_SPEED) * rng.uniform(-1.02, 1.02, 6)).tolist()
        if limits._is_free(q, qd):
            free += 1
            assert limits._scaled(q, qd) == (qd, 0)
    assert 300 < free < 2700


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_what_is_no_number_becomes_a_stop(limits, q, bad):
    sent, met = limits(q, [0.0, bad, 0.0, 0.0, 0.0, 0.0], [0.05] * 6)
    assert met == INVALID
    assert sent == [0.0] * 6
