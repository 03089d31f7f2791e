"""PolyScope's states and the arm's motions, on a virtual clock."""

import math

import numpy as np
import pytest

from hrcneuro.ur10 import controller as modes
from hrcneuro.ur10.arm import MAX_SPEED, START
from hrcneuro.ur10.faults import KINDS, Network, Schedule, parse

SPIN = "def program():\n while True:\n speedj([0, 0.3, 0, 0, 0, 0], 5, 0.008)\n end\nend\n"


def trace(robot, script, seconds=10.0):
    """Return target speeds, (n, 6), over a script's run."""
    robot.controller.start(robot.compile(script))
    rows = []
    until = robot.controller.now + seconds
    while robot.controller.now < until:
        robot.controller.cycle()
        rows.append(list(robot.controller.arm.target_qd))
        if robot.controller.program is None and len(rows) > 1:
            break
    return np.array(rows)


@pytest.mark.parametrize(("a", "v"), [(1.4, 1.05), (0.5, 3.0), (10.0, 0.2)])
def test_movej_keeps_its_acceleration_and_speed(robot, a, v):
    q = list(START)
    q[1] += 0.3
    q[3] -= 0.5
    speeds = trace(robot, f"movej({q}, a={a}, v={v})\n")
    assert np.abs(speeds).max() <= v * 1.0001
    assert np.abs(np.diff(speeds, axis=0)).max() / 0.008 <= a * 1.01
    robot.wait(0.2)
    np.testing.assert_allclose(robot.controller.arm.q, q, atol=1e-6)
    np.testing.assert_allclose(speeds[:, 1] / 0.3, speeds[:, 3] / -0.5, atol=1e-9)


def test_movej_in_time(robot):
    q = list(START)
    q[0] += 0.4
    speeds = trace(robot, f"movej({q}, t=2)\n")
    assert len(speeds) * 0.008 == pytest.approx(2.0, abs=0.05)


def test_movel_is_straight_and_movec_round(robot):
    arm = robot.controller.arm
    start = arm.pose()
    goal = [start[0], start[1] + 0.2, start[2], *start[3:]]
    robot.controller.start(robot.compile(f"movel(p{goal}, a=1, v=0.25)\n"))
    robot.controller.cycle()
    while robot.controller.program is not None:
        robot.controller.cycle()
        assert abs(arm.target_pose()[0] - start[0]) < 1e-9
        assert abs(arm.target_pose()[2] - start[2]) < 1e-9
    np.testing.assert_allclose(arm.target_pose(), goal, atol=1e-9)
    via = [goal[0] + 0.1, goal[1] - 0.1, *goal[2:]]
    robot.controller.start(robot.compile(f"movec(p{via}, p{start}, a=1, v=0.25)\n"))
    robot.controller.cycle()
    while robot.controller.program is not None:
        robot.controller.cycle()
        x, y, *_ = arm.target_pose()
        assert math.hypot(x - start[0], y - start[1] - 0.1) == pytest.approx(0.1, abs=1e-9)
    np.testing.assert_allclose(arm.target_pose(), start, atol=1e-8)


def test_speedl_moves_the_tool_as_asked(robot):
    trace(robot, "speedl([0, 0.1, 0, 0, 0, 0], 1, 0.5)\n", seconds=0.4)
    robot.wait(0.08)
    from hrcneuro.ur10.variables import tcp_speed

    np.testing.assert_allclose(tcp_speed(robot.controller), [0, 0.1, 0, 0, 0, 0], atol=2e-3)


@pytest.mark.parametrize("stop", ["stopj(5)", "stopl(5)"])
def test_stops_bring_a_moving_arm_to_rest(robot, stop):
    robot.run(f"def program():\nspeedj([0.3,0.2,0,0,0,0], 5, 0.5)\n{stop}\nsleep(0.1)\nend\n")
    assert robot.controller.arm.at_rest


def test_servoj_reaches_its_goal_within_the_speed_limits(robot):
    q = [v + 0.05 for v in START]
    step = f"servoj({q}, t=0.008, lookahead_time=0.1, gain=300)"
    speeds = trace(robot, f"def program():\ni = 0\nwhile i < 100:\n{step}\ni = i + 1\nend\nend\n")
    np.testing.assert_allclose(robot.controller.arm.target_q, q, atol=1e-3)
    assert (np.abs(speeds) <= MAX_SPEED).all()


def test_a_speed_ends_with_its_program(robot):
    robot.run("speedj([0, 0.3, 0, 0, 0, 0], 5, 0.1)\n")
    robot.wait(0.3)
    assert robot.controller.arm.at_rest


def test_lines_that_follow_each_other_keep_the_arm_moving(robot):
    speeds = []
    for _ in range(100):
        robot.controller.start(robot.compile("speedj([0,0.2,0,0,0,0],5,0.1)\n"))
        robot.controller.cycle()
        speeds.append(robot.controller.arm.target_qd[1])
    np.testing.assert_allclose(speeds[10:], 0.2)


@pytest.mark.parametrize("what", ["speedj([3, 0, 0, 0, 0, 0], 40, 1)", "speedj([0, 0, 0, 0, 0, 2], 40, 9)"])
def test_beyond_its_limits_the_arm_goes_into_a_protective_stop(robot, what):
    robot.run(f"def program():\n{what}\nend\n", seconds=8.0)
    c = robot.controller
    assert c.safety_mode == modes.PROTECTIVE
    assert c.runtime_state == modes.PAUSED
    assert c.safety_bits & 1 << 2
    assert "limit" in robot.errors[-1] or "range" in robot.errors[-1]


def test_a_protective_stop_is_unlocked_after_five_seconds_only(robot):
    c = robot.controller
    robot.run(SPIN, seconds=0.5)
    c.protective_stop("test")
    robot.wait(0.3)
    assert c.arm.at_rest
    assert not c.unlock_protective_stop()
    robot.wait(5.0)
    assert c.unlock_protective_stop()
    robot.wait(0.1)
    assert c.arm.at_rest, "nothing moves before someone presses play"
    assert c.resume()
    robot.wait(0.3)
    assert c.arm.target_qd[1] == pytest.approx(0.3)


def test_two_threads_cannot_move_the_arm_at_once(robot):
    other = "thread other():\nwhile True:\nspeedj([0, 0.1, 0, 0, 0, 0], 5, 0.008)\nend\nend\n"
    move = f"movej({list(START)})\n"
    robot.run(f"def program():\n{other}run other()\nsleep(0.1)\n{move}end\n")
    assert "another thread is already controlling the robot" in robot.errors[-1]
    robot.wait(0.3)
    assert robot.controller.arm.at_rest
    robot.run(f"def program():\n{other}h = run other()\nsleep(0.1)\nkill h\n{move}textmsg(1)\nend\n")
    assert robot.log[-1] == ("text", "1"), robot.errors


def test_an_emergency_stop_ends_the_program_and_takes_the_power(robot):
    c = robot.controller
    robot.run(SPIN, seconds=0.5)
    c.emergency_stop(True)
    robot.wait(0.5)
    assert (c.robot_mode, c.program, c.safety_bits & 0xC0) == (modes.POWER_OFF, None, 0xC0)
    c.release_brakes()
    robot.wait(3.0)
    assert c.robot_mode == modes.POWER_OFF
    c.emergency_stop(False)
    c.release_brakes()
    seen = set()
    for _ in range(400):
        c.cycle()
        seen.add(c.robot_mode)
    assert seen >= {modes.POWER_ON, modes.IDLE, modes.RUNNING}
    assert c.robot_mode == modes.RUNNING


def test_without_power_nothing_runs(new_robot):
    robot = new_robot(powered=False)
    robot.run(SPIN, seconds=0.2)
    assert robot.controller.program is None
    assert "not running" in robot.errors[-1]


def test_a_watchdog_stops_what_is_not_kept_awake(robot):
    script = 'def program():\nrtde_set_watchdog("input_int_register_0", 10, "stop")\n' + SPIN.split("\n", 1)[1]
    robot.controller.start(robot.compile(script))
    for _ in range(50):
        robot.controller.cycle()
        robot.controller.wrote("input_int_register_0")
    assert robot.controller.arm.target_qd[1] == pytest.approx(0.3)
    robot.wait(0.24)
    assert robot.controller.program is None
    assert max(map(abs, robot.controller.arm.qd)) < 0.01


def test_the_slider_slows_moves_and_speeds(robot):
    robot.controller.slider = 0.5
    robot.run(SPIN, seconds=0.5)
    assert robot.controller.arm.target_qd[1] == pytest.approx(0.15)


@pytest.mark.parametrize("text", ["protective_stop@5", "drop=0.2", "slider=0", "cut@1", "silence=0.5@2"])
def test_faults_are_read(text):
    assert parse(text).kind in KINDS


@pytest.mark.parametrize(("text", "part"), [("protectiv_stop", "did you mean 'protective_stop'"), ("drop=2", "0 … 1"),
                                            ("drop=x", "not a number"), ("cut@-1", "negative")])  # fmt: skip
def test_wrong_faults_are_named(text, part):
    from hrcneuro.errors import ConfigError

    with pytest.raises(ConfigError, match=part):
        parse(text)


def test_faults_come_when_they_are_due(robot):
    network = Network()
    schedule = Schedule(robot.controller, network, [parse("slider=0.3@0.1"), parse("drop=0.25")])
    lost = 0
    for _ in range(100):
        schedule.cycle()
        robot.controller.cycle()
        lost += network.loses(robot.controller.now)
    assert lost == 25
    assert robot.controller.slider == 0.3


def test_an_hour_neither_drifts_nor_grows(robot):
    import gc

    c = robot.controller
    script = (
        "def program():\nwhile True:\nspeedj([0, 0.2, 0, 0, 0, 0], 5, 0.4)\nspeedj([0, -0.2, 0, 0, 0, 0], 5, 0.4)\n"
        "write_output_integer_register(0, 1)\nend\nend\n"
    )
    c.start(robot.compile(script))
    robot.wait(80.0)
    gc.collect()
    before = len(gc.get_objects())
    robot.wait(400.0)  # the benchmark does the hour
    gc.collect()
    assert len(gc.get_objects()) - before < 50
    assert c.program is not None
    late = [a - 0.008 * v for a, v in zip(c.arm.target_q, c.arm.target_qd, strict=True)]
    np.testing.assert_allclose(c.arm._late_q, late, atol=1e-9)
