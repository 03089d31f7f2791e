"""PolyScope's states and the arm's motions, on a virtual clock."""

import math

import numpy as np
import pytest

from hrcneuro.ur10 import controller as modes
from hrcneuro.ur10 import geometry, internal, streams
from hrcneuro.ur10.arm import MAX_SPEED, START
from hrcneuro.ur10.faults import KINDS, Network, Schedule, parse
from hrcneuro.ur10.modes import POSITION, TEACH

SPIN = "def program():\n while True:\n speedj([0, 0.3, 0, 0, 0, 0], 5, 0.008)\n end\nend\n"


def control_mode(c):
    """Return the control mode that the primary and secondary ports tell."""
    return streams.state(c)[5 + 5 + 8 + 7 + 1]


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


@pytest.mark.parametrize("slider", [1.0, 0.5, 0.25])
def test_the_slider_slows_a_velocity_s_time_so_that_the_way_stays(robot, slider):
    robot.controller.slider = slider
    before = robot.controller.arm.target_q[5]
    speeds = trace(
        robot, "def p():\nspeedj([0, 0, 0, 0, 0, 0.8], 1000, 0.08)\nspeedj([0, 0, 0, 0, 0, 0], 1000, 0.08)\nend\n"
    )
    assert np.count_nonzero(speeds[:, 5]) == 10 / slider
    assert robot.controller.arm.target_q[5] - before == pytest.approx(0.8 * 0.08)


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


@pytest.mark.parametrize("action", ["stop", "STOP"])
def test_a_watchdog_stops_what_is_not_kept_awake(robot, action):
    script = f'def program():\nrtde_set_watchdog("input_int_register_0", 10, "{action}")\n' + SPIN.split("\n", 1)[1]
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


@pytest.mark.parametrize("what", [
    "movej([0, 0, 0, 0, 0, 0])", "speedj([0, 0.1, 0, 0, 0, 0], 1, 0.1)", "stopj(1)", "servoj([0, 0, 0, 0, 0, 0])",
    "sleep(0.1)", "sleep(0.001)", "sync()", "popup('x', blocking=True)", "while True:\nx = 1\nend", "run t()",
    "x = 1 / 0",
])  # fmt: skip
def test_a_secondary_program_neither_moves_nor_waits_and_the_main_one_goes_on(robot, what):
    robot.run(SPIN, seconds=0.5)
    main, before = robot.controller.program, robot.controller.arm.target_qd[:]
    thread = "thread t():\nset_flag(1, True)\nend\n"
    robot.controller.start(robot.compile(f"sec s():\n{thread}set_flag(0, True)\n{what}\nset_flag(2, True)\nend\n"))
    robot.wait(0.1)
    assert len(robot.errors) == 1
    assert robot.controller.memory.flags[:3] == [True, False, False]
    assert robot.controller.program is main
    assert robot.controller.arm.target_qd == before


def test_a_move_that_a_joint_cannot_follow_is_slower(robot):
    pose = robot.controller.arm.pose()
    goal = [pose[0], pose[1] + 0.3, *pose[2:]]
    speeds = trace(robot, f"movel(p{goal}, a=40, v=9)\n")
    assert (np.abs(speeds) <= np.array(MAX_SPEED) * 1.0001).all()
    assert len(speeds) > 0.3 / 9 / 0.008
    np.testing.assert_allclose(robot.controller.arm.target_pose(), goal, atol=1e-6)


@pytest.mark.parametrize("t", [0.01, 0.05, 0.1, 1.0])
@pytest.mark.parametrize("way", [0.5, 3.14])
def test_a_time_that_a_joint_cannot_keep_is_longer(robot, t, way):
    q = list(START)
    q[0] += way
    speeds = trace(robot, f"movej({q}, t={t})\n")
    assert not robot.errors
    assert np.abs(speeds).max() <= MAX_SPEED[0] * 1.0001
    assert len(speeds) * 0.008 >= max(t, way / MAX_SPEED[0])
    assert robot.controller.arm.target_q[0] == pytest.approx(q[0])


@pytest.mark.parametrize("way", [0.2, 0.6])
@pytest.mark.parametrize("t", [0.01, 0.05, 0.1])
def test_a_tool_s_way_in_too_short_a_time_is_slower(robot, t, way):
    pose = robot.controller.arm.pose()
    goal = [pose[0], pose[1] + way, *pose[2:]]
    speeds = trace(robot, f"movel(p{goal}, t={t})\n")
    assert not robot.errors
    assert (np.abs(speeds) <= np.array(MAX_SPEED) * 1.0001).all()
    np.testing.assert_allclose(robot.controller.arm.target_pose(), goal, atol=1e-6)


def test_the_arm_is_steady_after_half_a_second_at_rest(robot):
    said = robot.run("def p():\nspeedj([0, 0.1, 0, 0, 0, 0], 5, 0.1)\nstopj(5)\nsleep(0.4)\ntextmsg(is_steady())\n"
                     "sleep(0.2)\ntextmsg(is_steady())\nend\n")  # fmt: skip
    assert said == ["False", "True"]


def test_what_polyscope_and_drivers_send_is_no_script(robot):
    c = robot.controller
    robot.run(SPIN, seconds=0.1)
    for line, done in (
        ("pause program", lambda: c.runtime_state == modes.PAUSED),
        ("resume program", lambda: c.runtime_state == modes.PLAYING),
        ("set speed 0.5", lambda: c.slider == 0.5),
        ("stop program", lambda: c.program is None),
        ("set robotmode freedrive", lambda: control_mode(c) == TEACH),
        ("set robotmode run", lambda: control_mode(c) == POSITION),
        ("set robotmode freedrive", lambda: c.freedrive),
        ("power off", lambda: c.robot_mode == modes.POWER_OFF),
        ("power on\r", lambda: c.robot_mode == modes.IDLE),
        ("set robotmode freedrive", lambda: not c.freedrive),
        ("set robotmode run", lambda: c.robot_mode == modes.RUNNING),
    ):
        assert internal.obey(c, line)
        robot.wait(2.5)
        assert done(), line
    c.protective_stop("test")
    assert internal.obey(c, "set unlock protective stop")
    robot.wait(4.7)
    assert c.safety_mode == modes.PROTECTIVE, "not at once"
    robot.wait(0.15)
    assert c.safety_mode == modes.NORMAL, "but seen to be done within 5 s of the order"
    for line in ("set speed 2", "set speed fast", "power", "set_digital_out(0, True)"):
        assert not internal.obey(c, line)


def test_a_program_s_protective_stop_has_ur_s_number(robot):
    said = []
    robot.controller.outlets.append(said.append)
    robot.run("protective_stop()\n", seconds=0.1)
    assert [notice.number for notice in said if notice.kind == "error"] == [209]


def test_a_program_ends_freedrive_and_is_not_ended_by_it(robot):
    c = robot.controller
    internal.obey(c, "set robotmode freedrive")
    robot.run("sec s():\nset_flag(0, True)\nend\n", seconds=0.1)
    assert c.freedrive
    robot.run(SPIN, seconds=0.1)
    assert not c.freedrive
    internal.obey(c, "set robotmode freedrive")
    robot.wait(0.1)
    assert not c.freedrive
    assert c.runtime_state == modes.PLAYING


def test_deviations_are_told_once_each_while_a_program_asks_for_it(robot):
    turns = "speedj([0, 1, 0, 0, 0, 0], 10, 0.4)\nstopj(10)\nsleep(0.2)\n"
    said = robot.run(f"def p():\n{turns}position_deviation_warning(True, 0.1)\n{turns}{turns}"
                     f"position_deviation_warning(True)\n{turns}end\n")  # fmt: skip
    assert len(said) == 2
    assert all("Position deviation: 1" in text for text in said)
    assert len(robot.run(f"def p():\n{turns}end\n")) == 2


@pytest.mark.parametrize("axis", range(3))
def test_the_accelerometer_s_axis_that_points_upwards_reads_gravity(new_robot, axis):
    robot = new_robot()
    turn = {0: [0, -math.pi / 2, 0], 1: [math.pi / 2, 0, 0], 2: [0, 0, 0]}[axis]
    arm = robot.controller.arm
    tool = geometry.pose_trans(geometry.pose_inv([*arm.pose()[:3], 0, 0, 0]), arm.pose())
    arm.tcp = geometry.pose_trans(geometry.pose_inv(tool), [0, 0, 0, *turn])
    expected = [9.81 if i == axis else 0.0 for i in range(3)]
    np.testing.assert_allclose(arm.accelerometer(), expected, atol=1e-9)


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
