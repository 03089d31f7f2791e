import dataclasses

import numpy as np
import pytest

from hrcneuro.robot import record
from hrcneuro.robot.backend import ArmError, Cause
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.identify import response_lead
from hrcneuro.robot.kinematics import forward
from hrcneuro.robot.measure import fit_onset, measure_moves, stim_sample, timing, tip
from hrcneuro.robot.minimum_jerk import minimum_jerk
from hrcneuro.robot.parameters import Pace, Safety
from hrcneuro.robot.plan import PlannedMove
from hrcneuro.robot.safety import Supervisor
from hrcneuro.robot.session import find_lead, go_home, run_session
from hrcneuro.robot.workspace import DOWN, Flaw, WayError, Workspace

PACE = Pace(pause_s=0.1)


def move(start, end, *, first=False, t_f=0.7, gap=np.nan) -> PlannedMove:
    return PlannedMove("iC", False, 1, 1, 0, start, end, first, t_f, gap)


def session(make_loop, workspace, moves, *, pace=PACE, **changes):
    loop, done = make_loop(workspace.home(), **changes), []
    with loop:
        run_session(loop, workspace, moves, lead=0.027, most_lead=0.05, pace=pace, on_executed=done.append)
    telemetry = loop.record.telemetry()
    return loop, done, telemetry, tip(telemetry, tool=0.1)


@pytest.mark.parametrize(("lag", "lead"), [(0.015, 0.027), (0.030, 0.042), (0.005, 0.017)])
def test_the_lead_is_found(make_loop, workspace, lag, lead):
    """One cycle of delay, the lag, and half a cycle for the hold of the commands."""
    loop = make_loop(lag=lag, lead=0.0)
    assert find_lead(loop, workspace) == pytest.approx(lead, abs=1e-3)


@pytest.mark.parametrize(("uneven", "rounds"), [(0, 1), (1, 2), (5, 3)])
def test_the_lead_is_sought_again_where_a_cycle_came_late(make_loop, workspace, uneven, rounds):
    """A machine that is busy for a moment must not spoil the whole session."""
    loop = make_loop(lead=0.0, supervisor=Supervisor(Safety(max_packet_age_s=0.1)))
    wait, due = loop._clock.wait_until, [1.0 + 4.0 * i for i in range(uneven)]

    def stumble(t):
        wait(t)
        if due and t > due[0]:
            due.pop(0)
            wait(t + 0.030)

    loop._clock.wait_until = stumble
    lead = find_lead(loop, workspace)
    even = make_loop(lead=0.0)
    find_lead(even, workspace)
    assert len(loop.record) == pytest.approx(rounds * len(even.record), rel=0.05)
    assert lead == pytest.approx(0.027, abs=1e-3 if uneven < 5 else 3e-3)


def test_an_arm_that_answers_late_all_the_time_does_not_start(make_loop, workspace):
    """Every packet is as late as the quickest, so that none looks old: only the lead shows it."""
    loop, done = make_loop(workspace.home(), lag=0.060), []
    with pytest.raises(ArmError, match=r"the measured lead is 7\d ms: .*; 50 ms are allowed") as caught, loop:
        run_session(
            loop, workspace, [move((3, 3), (3, 4), first=True)], lead=None, most_lead=0.05, pace=PACE,
            on_executed=done.append,
        )  # fmt: skip
    assert caught.value.cause is Cause.SLOW_ANSWER
    assert not done
    assert set(loop.record.telemetry().move) == {-1}


def test_an_arm_that_does_not_move_has_no_lead(make_loop, workspace):
    loop = make_loop()
    loop.rest(loop.now() + 0.5)
    with pytest.raises(ArmError, match="did not move") as caught:
        response_lead(loop.record.telemetry())
    assert caught.value.cause is Cause.NO_RESPONSE


def test_an_arm_that_obeys_someone_else_has_no_lead(make_loop, workspace):
    loop = make_loop(lead=0.0)
    find_lead(loop, workspace)
    telemetry = loop.record.telemetry()
    telemetry.q[:, 0] += 0.05 * np.sin(telemetry.time)
    with pytest.raises(ArmError, match=r"does not follow its commands: \d+\.\d %"):
        response_lead(telemetry)


def test_homing_from_elsewhere_in_the_cell(make_loop, workspace):
    goal = np.array(workspace.position(3, 3)) + (0, 0, 0.10)
    for start in (workspace.reach.q[6, 0], workspace.home() + (0.2, -0.1, -0.1, 0.3, 0.2, -0.3)):
        loop = make_loop(start)
        go_home(loop, workspace, pace=PACE)
        telemetry = loop.record.telemetry()
        tips = forward(telemetry.q, tool=0.1)
        assert np.linalg.norm(tips[-1, :3, 3] - goal) < 1.5e-3
        assert np.allclose(tips[-1, :3, :3], DOWN, atol=2e-3)
        assert np.abs(telemetry.command).max() <= 1.2
        assert np.abs(np.diff(telemetry.command, axis=0)).max() / 0.008 < 8.0
        assert (telemetry.phase[1:] == record.HOME).sum() > 50
        assert tips[:, 2, 3].min() > workspace.height - 8e-4


def test_homing_from_a_tile_lifts_before_it_crosses(make_loop, workspace):
    loop = make_loop(workspace.reach.q[0, 6])
    go_home(loop, workspace, pace=PACE)
    tips = forward(loop.record.telemetry().q, tool=0.1)[:, :3, 3]
    low = tips[:, 2] < workspace.height + 0.05
    assert np.linalg.norm(tips[low, :2] - tips[0, :2], axis=1).max() < 1e-3


def test_homing_is_refused_from_outside_or_with_another_elbow(make_loop, workspace):
    high = workspace.home() + np.array([0, -0.8, 0, 0, 0, 0])
    loop = make_loop(high)
    with pytest.raises(ArmError, match="outside the keep-inside box"):
        go_home(loop, workspace, pace=PACE)
    assert not loop.record.telemetry().command.any()
    turned = workspace.home() + np.array([0, 0, 0, 0, 0, np.pi])
    with pytest.raises(ArmError, match=r"joint 6 stands at .*another elbow or wrist"):
        go_home(make_loop(turned), workspace, pace=PACE)


def test_turning_home_out_of_the_box_is_refused_before_anything_moves(make_loop, workspace):
    """Both ends lie in the box; the joints' straight line between them does not."""
    start = workspace.home() + (-0.21, 0.85, -1.08, -1.31, 1.08, -1.19)
    assert workspace.inside(forward(start, tool=0.1)[:3, 3])
    loop = make_loop(start)
    with pytest.raises(WayError, match="the way home, by joints, leads through"):
        go_home(loop, workspace, pace=PACE)
    assert not loop.record.telemetry().command.any()


def test_a_session_replays_the_log_at_its_pace(make_loop, workspace):
    moves = [
        move((1, 1), (1, 2), first=True, gap=1.0),
        move((1, 2), (2, 2), gap=0.9),
        move((2, 2), (2, 2), gap=0.8),
        move((2, 2), (3, 2)),
        move((6, 6), (5, 6), first=True, gap=30.0),
        move((5, 6), (4, 6)),
    ]
    _, done, telemetry, at = session(make_loop, workspace, moves)
    onsets = [d.track.onset if np.isfinite(d.track.onset) else d.track.start for d in done]
    assert np.diff(onsets)[[0, 1, 2]] == pytest.approx([1.0, 0.9, 0.8], abs=0.0081)
    assert np.diff(onsets)[4] == pytest.approx(PACE.longest_gap_s, abs=0.0081)
    for one in done:
        end = at.position[one.track.last - 1]
        assert 1e3 * np.linalg.norm(end - workspace.position(*one.move.end)) <= 0.1
    dwelt = done[2].track
    assert not telemetry.command[dwelt.first : dwelt.last].any()
    assert set(telemetry.move[dwelt.first : dwelt.last]) == {2}
    approach = telemetry.phase == record.APPROACH
    assert np.nanmax(np.linalg.norm(at.position - telemetry.reference, axis=1)[approach]) < 2e-3
    assert np.abs(at.position[approach & (telemetry.time > onsets[0]), 2] - workspace.height).max() < 8e-4


def test_in_radius_the_moves_flow_into_each_other(make_loop, workspace):
    moves = [
        move((3, 3), (3, 4), first=True),
        move((3, 4), (4, 4)),
        move((4, 4), (4, 4)),
        move((4, 4), (5, 4), gap=1.5),
        move((5, 4), (5, 3)),
    ]
    pace = dataclasses.replace(PACE, start_next="in_radius")
    _, done, telemetry, at = session(make_loop, workspace, moves, pace=pace)
    assert [one.flowed for one in done] == [False, True, False, False, False]
    first, second = done[0].track, done[1].track
    assert second.first == first.last
    assert second.onset - first.onset == pytest.approx(0.846 * 0.7, abs=0.02)
    handover = slice(first.last - 5, second.first + 5)
    assert np.abs(np.diff(telemetry.command[handover], axis=0)).max() / 0.008 < 6.0
    assert telemetry.command[first.last - 1].any()
    # The log's own gap is kept where it is longer than the way into the radius.
    assert done[4].track.onset - done[3].track.onset == pytest.approx(1.5, abs=0.0081)
    found = measure_moves(done, telemetry, at, workspace)
    assert np.isnan(found["trigger_latency_ms"]).tolist() == [False, True, True, False, False]
    assert 0.5 < found["end_error_mm"][0] <= 2.0
    assert found["end_error_mm"][1] <= 0.1
    assert np.nanmax(found["max_error_mm"]) < 1.0


def test_a_way_through_a_singular_region_is_refused(workspace):
    inside = workspace.position(3, 3)
    workspace.check_way(inside, workspace.position(6, 6), near=workspace.reach.q[3, 3])
    with pytest.raises(WayError, match=r"through \(-1\.314, .*outside the keep-inside box") as caught:
        workspace.check_way(inside, (-1.5, 0.0, 0.0), near=workspace.reach.q[3, 3])
    assert caught.value.flaw is Flaw.OUT_OF_BOX
    wide = Workspace(Cell(margin=0.5, ceiling=1.5, min_singular_value=0.1))
    with pytest.raises(WayError, match=r"value of the Jacobian is 0\.0\d+; at least 0\.1 is"):
        wide.check_way(inside, (-1.30, 0.0, -0.05), near=wide.reach.q[3, 3])
    with pytest.raises(WayError, match=r"through \(-1\.275, .*does not reach"):
        Workspace(Cell(margin=0.5, ceiling=1.5, min_singular_value=0.0)).check_way(
            (-1.2, 0.0, 0.3), (-1.5, 0.0, 0.3), near=wide.reach.q[6, 3]
        )


def test_a_stopped_session_keeps_what_it_has(make_loop, workspace):
    from hrcneuro.robot.backend import Stopped
    from hrcneuro.robot.sim import Disturbance

    moves = [move((3, 3), (3, 4), first=True), move((3, 4), (3, 5)), move((3, 5), (3, 4))]
    loop, done = make_loop(workspace.home(), disturbances=(Disturbance("protective_stop", 2.0),)), []
    with pytest.raises(Stopped, match="protective"), loop:
        run_session(loop, workspace, moves, lead=0.027, most_lead=0.05, pace=PACE, on_executed=done.append)
    assert [one.index for one in done] == [0]
    assert loop.record.telemetry().time[-1] >= 2.0


def test_figures_of_a_move(make_loop, workspace):
    moves = [move((3, 3), (4, 3), first=True, t_f=0.6), move((4, 3), (4, 3)), move((4, 3), (4, 4), t_f=1.2)]
    _, done, telemetry, at = session(make_loop, workspace, moves)
    found = measure_moves(done, telemetry, at, workspace)
    fast, dwelt, slow = ({k: v[i] for k, v in found.items()} for i in range(3))
    assert np.isnan(list(dwelt.values())).all()
    assert fast["peak_speed_m_s"] == pytest.approx(1.875 * 0.07 / 0.6, rel=0.03)
    assert slow["peak_speed_m_s"] == pytest.approx(1.875 * 0.07 / 1.2, rel=0.03)
    assert fast["t_2mm_s"] == pytest.approx(0.846 * 0.6, abs=0.01)
    assert slow["t_2mm_s"] == pytest.approx(0.846 * 1.2, abs=0.01)
    for one in (fast, slow):
        assert one["jerk_cost"] == pytest.approx(1.0, abs=0.15)
        assert abs(one["trigger_latency_ms"]) < 3.0
        assert one["end_error_mm"] <= 0.1


@pytest.mark.parametrize("t_f", [0.6, 0.9, 1.2])
def test_onset_fit_is_exact_where_a_threshold_is_late(t_f):
    time = np.arange(-0.1, t_f + 0.1, 0.008)
    s, rate, _, _ = minimum_jerk((time - 0.0123) / t_f)
    noise = np.random.default_rng(1).normal(0, 1e-4, len(time))
    assert fit_onset(time, s, t_f) == pytest.approx(0.0123, abs=1e-9)
    assert fit_onset(time, s + noise, t_f) == pytest.approx(0.0123, abs=1e-4)
    # the measured lateness of a threshold of 5 mm/s: 24, 44, 68 ms
    late = time[np.argmax(0.07 * rate / t_f > 0.005)] - 0.0123
    assert 1e3 * late == pytest.approx({0.6: 24, 0.9: 44, 1.2: 68}[t_f], abs=9)


def test_timing_of_a_session(make_loop, workspace):
    moves = [move((3, 3), (3, 4), first=True), move((3, 4), (3, 3))]
    _, _, telemetry, _ = session(make_loop, workspace, moves)
    nothing = np.full(3, np.nan)
    spread = timing(telemetry, {"trigger": np.array([1.0, 3.0, np.nan]), "stim": nothing}, nothing)
    assert spread["cycle"]["mean"] == pytest.approx(8.0)
    assert spread["cycle_jitter"]["high"] < 1e-6
    assert (spread["trigger_latency"]["n"], spread["trigger_latency"]["mean"]) == (2, 2.0)
    assert spread["trigger_jitter"]["high"] == 1.0
    assert not {"behind_log", "stim_latency", "stim_jitter"} & set(spread)


@pytest.mark.parametrize("rate", [125.0, 500.0, 512.0, 1000.0, 2048.0])
def test_a_stim_channel_shows_a_marker_in_the_next_sample(rate):
    times = np.r_[np.arange(500) * 0.008, np.random.default_rng(0).uniform(0, 9000, 500)]
    sample = stim_sample(times, rate)
    assert (sample == np.rint(sample)).all()
    assert (sample / rate - times > -2e-3 / rate).all()
    assert (sample / rate - times < 1 / rate).all()
    # Onsets on a clock that adds up its cycles are off by rounding, which must not cost a sample.
    assert np.array_equal(stim_sample(np.cumsum(np.full(100_000, 0.008)), 1000.0), 8.0 * np.arange(1, 100_001))
    assert np.isnan(stim_sample(np.array([np.nan, 1.0]), np.nan)).all()


def test_the_rotation_vector_keeps_its_branch(make_loop, workspace):
    _, _, telemetry, at = session(make_loop, workspace, [move((3, 3), (3, 4), first=True)])
    assert np.allclose(at.rotation, (0, np.pi, 0), atol=0.01)
    assert np.allclose(at.position, forward(telemetry.q, tool=0.1)[:, :3, 3])
