import itertools

import numpy as np
import pytest

from hrcneuro.robot import record
from hrcneuro.robot.backend import PERIOD, Cause, Stopped
from hrcneuro.robot.kinematics import forward, inverse
from hrcneuro.robot.measure import tip
from hrcneuro.robot.parameters import Bounds, Safety
from hrcneuro.robot.record import Track
from hrcneuro.robot.safety import Supervisor
from hrcneuro.robot.sim import Disturbance, SimArm, VirtualClock
from hrcneuro.robot.trajectory import BoundedPath, TileMove
from hrcneuro.robot.workspace import pose

TILES = list(itertools.product(range(7), range(7)))
WAYS = [((r, c), (r + dr, c + dc)) for r, c in TILES for dr, dc in ((0, 1), (1, 0)) if r + dr < 7 and c + dc < 7]


# For tests of what comes into play only far from the path, or where there is none.
ANYWHERE = Supervisor(Safety(max_path_error_mm=float("inf")))


def one_move(make_loop, workspace, way, t_f, **changes):
    """Return the telemetry and the track of one tile move from a standing arm."""
    loop = make_loop(workspace.reach.q[way[0]], **changes)
    path = TileMove(workspace.position(*way[0]), workspace.position(*way[1]), t_f)
    track = loop.follow(path, phase=record.MOVE, move=0)
    return loop.record.telemetry(), track


def errors(telemetry, track):
    rows = slice(track.first, track.last)
    at = tip(telemetry, tool=0.1)
    return 1e3 * np.linalg.norm(at.position[rows] - telemetry.reference[rows], axis=1), at


@pytest.mark.parametrize(("t_f", "without", "with_lead"), [(0.6, 2.96, 0.63), (0.9, 1.44, 0.31), (1.2, 0.86, 0.19)])
def test_tracking_as_measured(make_loop, workspace, t_f, without, with_lead):
    """The published table: largest error in mm over the 84 tile moves, without and with a lead of 27 ms.

    Its plant was discretised otherwise (ours integrates the lag exactly), hence the tolerance of 12 %.
    """
    worst = {}
    for lead in (0.0, 0.027):
        found = [errors(*one_move(make_loop, workspace, w, t_f, lead=lead))[0].max() for w in WAYS[::3]]
        worst[lead] = max(found)
    assert worst[0.0] == pytest.approx(without, rel=0.12)
    assert worst[0.027] == pytest.approx(with_lead, rel=0.12)


def test_all_84_moves_at_the_shortest_t_f_both_ways(make_loop, workspace):
    loop = make_loop()
    here, tracks = (3, 3), []
    for a, b in WAYS:
        if here != a:
            loop.follow(
                BoundedPath(workspace.position(*here), workspace.position(*a), Bounds(0.5, 4.0, 60.0)),
                phase=record.APPROACH,
            )
        for start, end in ((a, b), (b, a)):
            path = TileMove(workspace.position(*start), workspace.position(*end), 0.6)
            tracks.append((loop.follow(path, phase=record.MOVE, move=len(tracks)), end))
        here = a
    telemetry = loop.record.telemetry()
    at = tip(telemetry, tool=0.1)
    moving = telemetry.phase == record.MOVE
    off = np.linalg.norm(at.position - telemetry.reference, axis=1)[moving]
    assert 1e3 * off.max() <= 0.8
    assert 1e3 * np.abs(at.position[moving, 2] - workspace.height).max() <= 0.8
    assert np.degrees(at.tilt[moving].max()) <= 0.2
    assert not telemetry.limits.any()
    for track, end in tracks:
        goal = np.array(workspace.position(*end))
        distance = np.linalg.norm(at.position[track.first : track.last] - goal, axis=1)
        assert 1e3 * distance[-1] <= 0.1
        time = telemetry.time[track.first : track.last] - track.onset
        assert (distance[time >= 0.6] <= 0.002).all()
        assert track.end - track.onset < 0.72


def test_a_wrong_lead_costs_millimetres(make_loop, workspace):
    error, _ = errors(*one_move(make_loop, workspace, ((5, 3), (6, 3)), 0.6, lead=0.08, supervisor=ANYWHERE))
    assert error.max() > 2.0


def test_onset_is_the_first_command_that_is_not_zero(make_loop, workspace):
    marks = []
    telemetry, track = one_move(
        make_loop, workspace, ((3, 3), (3, 4)), 0.9, on_onset=lambda age, move: marks.append((age(), move))
    )
    moving = np.any(telemetry.command != 0, axis=1)
    assert marks == [(0.0, 0)], "the virtual clock stands still within a cycle"
    assert track.onset == track.marked == telemetry.time[np.argmax(moving)]
    assert not moving[-1]


def test_a_marker_that_takes_time_is_late_by_that(make_loop, workspace):
    """The marker is told how old the onset is, and the track how late the marker has gone out."""
    loop, ages = make_loop(on_onset=lambda age, move: late(age())), []
    clock, speed = loop._clock, loop._arm.speed

    def late(age):
        ages.append(age)
        clock.wait_until(clock.now() + 0.002)

    def slow(qd):
        speed(qd)
        clock.wait_until(clock.now() + 0.001)

    loop._arm.speed = slow
    path = TileMove(workspace.position(3, 3), workspace.position(3, 4), 0.9)
    track = loop.follow(path, phase=record.MOVE, move=0)
    assert ages == [pytest.approx(0.001)]
    assert track.marked - track.onset == pytest.approx(0.003)


def test_times_begin_with_the_session_whatever_the_clock_shows(make_loop, workspace):
    """A machine's clock counts from its start, the record from the session's."""
    first, track = one_move(make_loop, workspace, ((3, 3), (3, 4)), 0.9)
    clock = VirtualClock()
    clock.wait_until(1000.0)
    arm = SimArm(clock, workspace.reach.q[3, 3].tolist())
    late = make_loop(arm=arm, clock=clock)
    path = TileMove(workspace.position(3, 3), workspace.position(3, 4), 0.9)
    again = late.follow(path, phase=record.MOVE, move=0)
    assert late.record.telemetry().time == pytest.approx(first.time, abs=1e-9)
    for name in ("start", "onset", "marked", "end"):
        assert getattr(again, name) == pytest.approx(getattr(track, name), abs=1e-9)
    late.rest(late.now() + 0.1)
    assert len(late.record.telemetry().time) == pytest.approx(len(first.time) + 12, abs=1)


@pytest.mark.parametrize("late", [0.0005, 0.003, 0.0069, 0.0075, 0.012, 0.0295])
def test_a_late_cycle_does_not_move_the_beat(make_loop, late):
    """The loop keeps its place between two cycles of the controller, and never sends twice at once."""
    loop = make_loop(supervisor=Supervisor(Safety(max_packet_age_s=0.1)))
    wait = loop._clock.wait_until
    loop._clock.wait_until = lambda t: wait(t + (late if t == pytest.approx(0.08) else 0.0))
    loop.rest(0.2)
    time = loop.record.telemetry().time
    beat = time / PERIOD - np.rint(time / PERIOD)
    assert np.flatnonzero(np.abs(beat) > 1e-6).tolist() in ([10], [])
    assert time[10] == pytest.approx(0.08 + late)
    assert np.diff(time).min() >= 0.001 - 1e-9
    assert time[11] - 0.08 < late + 0.001 + PERIOD


def test_the_same_session_twice_gives_the_same_numbers(make_loop, workspace):
    first, _ = one_move(make_loop, workspace, ((2, 2), (3, 2)), 0.7)
    again, _ = one_move(make_loop, workspace, ((2, 2), (3, 2)), 0.7)
    for name in ("time", "q", "qd", "command", "reference"):
        assert np.array_equal(getattr(first, name), getattr(again, name), equal_nan=True)


def test_nothing_moves_on_connect(make_loop):
    loop = make_loop()
    with loop:
        q = loop.measured().q
        loop.rest(loop.now() + 0.5)
    telemetry = loop.record.telemetry()
    assert not telemetry.command.any()
    assert np.array_equal(telemetry.q, np.broadcast_to(q, telemetry.q.shape))
    assert loop.stops == 0


@pytest.mark.parametrize(
    ("kind", "cause", "word"),
    [
        ("protective_stop", Cause.PROTECTIVE_STOP, "protective stop"),
        ("emergency_stop", Cause.EMERGENCY_STOP, "emergency stop"),
        ("silence", Cause.PACKETS_LOST, "packet is 24 ms old"),
        ("slider", Cause.SLIDER, "slider stands at 50 %"),
        ("program", Cause.PROGRAM, "not running"),
    ],
)
def test_every_disturbance_ends_in_a_stop_with_its_cause(make_loop, workspace, kind, cause, word):
    loop = make_loop(disturbances=(Disturbance(kind, 0.3),))
    path = TileMove(workspace.position(3, 3), workspace.position(4, 3), 0.6)
    with pytest.raises(Stopped, match=word) as caught, loop:
        loop.follow(path, phase=record.MOVE, move=0)
    assert caught.value.cause is cause
    assert loop.stops == 1
    telemetry = loop.record.telemetry()
    assert telemetry.phase[-1] == record.STOP
    assert telemetry.time[-1] > 0.3
    if kind != "silence":
        assert np.abs(telemetry.qd[-1]).max() < 1e-3
        assert telemetry.time[-1] < 0.3 + 0.4


@pytest.mark.parametrize(("until", "known"), [(0.6, True), (float("inf"), False)])
def test_that_the_arm_was_stopped_is_said_only_where_it_was_seen(make_loop, workspace, until, known):
    loop = make_loop(disturbances=(Disturbance("silence", 0.3, until),))
    path = TileMove(workspace.position(3, 3), workspace.position(4, 3), 0.6)
    with pytest.raises(Stopped, match="packet is 24 ms old") as caught, loop:
        loop.follow(path, phase=record.MOVE, move=0)
    assert ("; the arm was stopped" in str(caught.value)) == known
    assert ("not seen at rest" in str(caught.value)) != known
    assert caught.value.rests == known


def test_an_arm_that_does_not_obey_is_not_called_stopped(make_loop, workspace):
    loop = make_loop(supervisor=ANYWHERE)
    state, speed = loop._arm.state, loop._arm.speed
    loop._arm.speed = lambda qd: None

    def runaway():
        speed([0.0, 0.0, 0.0, 0.0, 0.0, 0.2])
        return state()

    loop._arm.state = runaway
    with pytest.raises(Stopped, match=r"mm from its goal .* was not seen at rest: it may be moving") as caught:
        loop.follow(TileMove(workspace.position(3, 3), workspace.position(4, 3), 0.6), phase=record.MOVE, move=0)
    assert (caught.value.cause, caught.value.rests) == (Cause.TIP_ASTRAY, False)


def test_a_short_silence_does_not_stop(make_loop, workspace):
    _, track = one_move(make_loop, workspace, ((3, 3), (4, 3)), 0.9, disturbances=(Disturbance("silence", 0.3, 0.312),))
    assert track.end < 1.2


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_any_way_out_is_a_jerk_limited_stop(make_loop, workspace, error):
    loop = make_loop(on_onset=None)

    class Broken(TileMove):
        def at(self, t):
            if 0.3 < t < 0.5:
                raise error("in the middle")
            return super().at(t)

    with pytest.raises(error), loop:
        loop.follow(Broken(workspace.position(3, 3), workspace.position(4, 3), 0.6), phase=record.MOVE, move=0)
    telemetry = loop.record.telemetry()
    stop = telemetry.phase == record.STOP
    assert stop.sum() > 5
    assert np.abs(telemetry.qd[-1]).max() < 1e-3
    sent = telemetry.command[np.flatnonzero(stop)[0] - 1 :]
    assert np.abs(np.diff(sent, axis=0)).max() / PERIOD <= 8.0 + 1e-9
    assert telemetry.time[-1] - telemetry.time[stop][0] < 0.4
    assert loop.stops == 1


def test_a_path_out_of_the_box_stops_inside_it(make_loop, workspace):
    loop = make_loop()
    start = np.array(workspace.position(3, 3))
    with pytest.raises(Stopped, match="keep-inside box") as caught, loop:
        loop.follow(TileMove(start, start - (0, 0, 0.05), 1.0), phase=record.MOVE, move=0)
    assert caught.value.cause is Cause.OUT_OF_BOX
    assert forward(np.array(loop.record.telemetry().q), tool=0.1)[:, 2, 3].min() >= workspace.box[0][2]


STOPS = [Bounds(4.0, 8.0, 200.0), Bounds(4.0, 1.0, 200.0), Bounds(4.0, 8.0, 5.0), Bounds(4.0, 0.5, 5.0)]


@pytest.mark.parametrize("stop", STOPS, ids=lambda b: f"{b.acceleration:g}-{b.jerk:g}")
@pytest.mark.parametrize(
    "way", [(0.5, 0.0, 0.0), (-0.9, 0.0, 0.0), (0.0, 0.6, 0.0), (0.0, 0.0, -0.3), (0.0, 0.0, 0.6), (0.5, 0.5, -0.1)]
)
def test_no_stop_leaves_the_box(make_loop, workspace, way, stop):
    """The loop's own stop is what the limits look ahead by, however mild it is."""
    low, high = np.array(workspace.box)
    start = np.array(workspace.position(3, 3)) + (0, 0, 0.05)
    loop = make_loop(inverse(pose(start), workspace.reach.q[3, 3], tool=0.1), stop=stop, supervisor=ANYWHERE)
    with pytest.raises(Stopped, match="keep-inside box"), loop:
        loop.follow(TileMove(start, start + way, 1.0), phase=record.MOVE, move=0)
    at = tip(loop.record.telemetry(), tool=0.1).position
    assert (at >= low).all()
    assert (at <= high).all()


@pytest.mark.parametrize("stop", STOPS, ids=lambda b: f"{b.acceleration:g}-{b.jerk:g}")
def test_the_box_is_never_left_whatever_is_asked(make_loop, workspace, stop):
    """A hostile law: random joint speeds for up to a second, then an error in the midst of it."""
    rng = np.random.default_rng(1)
    low, high = np.array(workspace.box)
    start = workspace.position(3, 3)
    for _ in range(12):
        asked, until = rng.uniform(-3, 3, 6).tolist(), rng.uniform(0.05, 1.0)

        clock = VirtualClock()

        def law(q, at, v, asked=asked, until=until, clock=clock):
            if clock.now() > until:
                raise KeyboardInterrupt
            return list(asked), 1.0, 0.0, 0.0

        start_q = workspace.reach.q[rng.integers(7), rng.integers(7)]
        loop = make_loop(start_q, law=law, clock=clock, stop=stop, supervisor=ANYWHERE)
        with pytest.raises((Stopped, KeyboardInterrupt)), loop:
            loop.follow(TileMove(start, start, 2.0), phase=record.MOVE)
        telemetry = loop.record.telemetry()
        at = tip(telemetry, tool=0.1).position
        assert (at >= low).all()
        assert (at <= high).all()
        assert np.abs(telemetry.qd[-1]).max() < 1e-3


def test_a_mild_stop_never_speeds_up_or_turns_back(make_loop, workspace):
    """With a jerk of 5 rad/s³, an acceleration gone on with would carry the arm to several rad/s."""
    loop = make_loop(stop=Bounds(4.0, 8.0, 5.0))
    speeds = [0.3 * min(k, 4) / 4 for k in range(8)]
    for before, last in ((speeds[3], speeds[4]), (speeds[4], speeds[3])):
        loop._before, loop._last = [before] * 6, [last] * 6
        first = len(loop.record)
        loop.halt()
        sent = loop.record.telemetry().command[first:]
        assert sent.min() >= -1e-9
        assert (np.diff(sent, axis=0) <= 1e-9).all()
        assert sent.max() <= last


@pytest.mark.parametrize("stop", STOPS, ids=lambda b: f"{b.acceleration:g}-{b.jerk:g}")
def test_a_stop_keeps_its_way(make_loop, workspace, stop):
    """All joints in proportion: the limits look along that way, another one leads elsewhere."""
    loop = make_loop(stop=stop)
    loop._before = [-0.7403, 0.823, -1.4512, -0.1408, 0.148, 0.7861]
    loop._last = last = [-0.6913, 0.7685, -1.3552, -0.1315, 0.1383, 0.7341]
    loop.halt()
    sent = loop.record.telemetry().command
    assert len(sent) > 10
    assert np.allclose(sent, np.outer(sent[:, 2] / last[2], last), atol=1e-12)


@pytest.mark.parametrize("stop", STOPS, ids=lambda b: f"{b.acceleration:g}-{b.jerk:g}")
@pytest.mark.parametrize("until", [0.3, 0.45, 0.6, 0.8, 1.5])
def test_no_stop_leaves_a_joints_range(make_loop, workspace, stop, until):
    start = [*workspace.reach.q[3, 3][:5].tolist(), 4.5]

    def law(q, at, v):
        if loop.now() > until:
            raise KeyboardInterrupt
        return [0.0] * 5 + [3.0], 1.0, 0.0, 0.0

    loop = make_loop(start, law=law, stop=stop, supervisor=ANYWHERE)
    at = workspace.position(3, 3)
    with pytest.raises(KeyboardInterrupt), loop:
        loop.follow(TileMove(at, at, 2.0), phase=record.MOVE)
    assert 4.5 < loop.record.telemetry().q[:, 5].max() <= 2 * np.pi


def test_a_command_that_is_no_number_stops(make_loop, workspace):
    loop = make_loop()

    class Nowhere(TileMove):
        def at(self, t):
            at, v = super().at(t)
            return at, (float("nan"), 0.0, 0.0) if t > 0.3 else v

    with pytest.raises(Stopped, match="is no number"), loop:
        loop.follow(Nowhere(workspace.position(3, 3), workspace.position(4, 3), 0.6), phase=record.MOVE, move=0)
    assert np.isfinite(loop.record.telemetry().command).all()


def test_an_arm_that_does_not_arrive_is_reported(make_loop, workspace):
    far = np.array(workspace.position(3, 3)) - (0.2, 0.0, 0.0)
    loop = make_loop(supervisor=ANYWHERE)
    with pytest.raises(Stopped, match=r"stands \d+\.\d mm from its goal 0\.05 s after"), loop:
        # 20 cm in 20 ms: the limits hold the arm back.
        loop.follow(TileMove(workspace.position(3, 3), far, 0.02), phase=record.MOVE, move=0, patience=0.05)


@pytest.mark.parametrize(("lead", "most"), [(0.027, 8.0), (None, 24.0)])
def test_an_arm_that_leaves_its_path_is_stopped(make_loop, workspace, lead, most):
    """At once, not where it should have arrived; more is allowed while nothing makes up for the arm's lag."""
    loop, told = make_loop(on_stop=lambda error: told.append((error.cause, loop.now()))), []
    loop.lead = lead
    law = loop._law

    def sideways(q, at, v):
        qd, *error = law(q, at, v)
        return [qd[0] + 0.3 * (loop.now() > 0.2), *qd[1:]], *error

    loop._law = sideways
    with pytest.raises(Stopped, match=rf"mm off its path; {most:.1f} mm are allowed") as caught:
        loop.follow(TileMove(workspace.position(3, 3), workspace.position(3, 4), 0.9), phase=record.MOVE, move=0)
    assert caught.value.cause is Cause.OFF_PATH
    ((cause, when),) = told
    assert cause is Cause.OFF_PATH
    assert when < 0.7
    off, _ = errors(loop.record.telemetry(), Track(0, len(loop.record), 0.0, 0.0, 0.0))
    assert np.nanmax(off) < most + 3.0


def test_a_tip_that_nobody_has_seen_lately_is_not_called_astray(make_loop, workspace):
    """Where packets stop, the path goes on: what is missing are packets, and the cure is another."""
    old = Supervisor(Safety(max_packet_age_s=0.2))
    loop = make_loop(disturbances=(Disturbance("silence", 0.3),), supervisor=old)
    with pytest.raises(Stopped, match=r"the last packet is 208 ms old") as caught:
        loop.follow(TileMove(workspace.position(3, 3), workspace.position(4, 3), 0.6), phase=record.MOVE, move=0)
    assert caught.value.cause is Cause.PACKETS_LOST


@pytest.mark.parametrize("moving", [True, False])
@pytest.mark.parametrize("gap", [0.11, 5.0])
def test_a_session_that_was_held_up_ends(make_loop, workspace, moving, gap):
    """Nothing is commanded after the gap but the stop, at rest as in a move."""
    loop = make_loop(supervisor=Supervisor(Safety(max_packet_age_s=0.5)))
    wait, held, sent = loop._clock.wait_until, [], []
    speed = loop._arm.speed

    def suspended(t):
        wait(t)
        if t > 0.4 and not held:
            held.append(t)
            wait(t + gap)

    loop._clock.wait_until = suspended
    loop._arm.speed = lambda qd: (sent.append((loop._clock.now(), qd)), speed(qd))
    with pytest.raises(Stopped, match=rf"nobody watched the arm for {1e3 * gap:.0f} ms.*100 ms are safe") as caught:
        if moving:
            loop.follow(TileMove(workspace.position(3, 3), workspace.position(4, 3), 0.9), phase=record.MOVE, move=0)
        else:
            loop.rest(3.0)
    assert caught.value.cause is Cause.LATE
    assert max(when for when, _ in sent) <= held[0]


def test_a_gap_between_the_check_and_the_command_lets_no_command_out(make_loop, workspace):
    loop, sent = make_loop(supervisor=Supervisor(Safety(max_packet_age_s=0.5))), []
    law, speed = loop._law, loop._arm.speed

    def slow(q, at, v):
        if loop.now() > 0.4:
            loop._clock.wait_until(loop._clock.now() + 0.2)
        return law(q, at, v)

    loop._law = slow
    loop._arm.speed = lambda qd: (sent.append(loop._clock.now()), speed(qd))
    with pytest.raises(Stopped, match="nobody watched the arm for 200 ms"):
        loop.follow(TileMove(workspace.position(3, 3), workspace.position(4, 3), 0.9), phase=record.MOVE, move=0)
    assert max(sent) < 0.41


@pytest.mark.parametrize(("took", "pause"), [(0.0, 0.0), (0.030, 0.048), (0.2, None)])
def test_after_a_computation_the_loop_waits_for_fresh_packets(make_loop, took, pause):
    """Two cycles, on the same beat; not where it took no time, and not at all where nobody watched for too long."""
    loop = make_loop(supervisor=Supervisor(Safety(max_packet_age_s=0.5)))
    loop.rest(0.1)
    due = loop.now()
    loop._clock.wait_until(loop._next + took - PERIOD * (took == 0.0))
    if pause is None:
        with pytest.raises(Stopped, match="nobody watched the arm for 200 ms"):
            loop.resume()
        return
    loop.resume()
    assert loop.now() - due == pytest.approx(pause)


def test_a_session_that_cannot_be_written_down_ends(make_loop):
    loop, faults = make_loop(supervisor=Supervisor(Safety(), keeper=lambda: faults[0])), [""]
    loop.rest(0.1)
    faults[0] = "No space left on device"
    with pytest.raises(Stopped, match="written down any more: No space left") as caught:
        loop.rest(0.2)
    assert caught.value.cause is Cause.NOT_KEPT


@pytest.mark.parametrize("error", [KeyboardInterrupt, Stopped])
def test_why_it_stops_is_told_before_anything_is_done_and_then_whether_it_rests(make_loop, workspace, error):
    events = []
    loop = make_loop(
        disturbances=(Disturbance("slider", 0.3),) if error is Stopped else (),
        on_stop=lambda error: events.append(type(error).__name__),
        on_rest=lambda seen: events.append(seen),
        on_onset=None,
    )
    stop, speed = loop._arm.stop, loop._arm.speed
    loop._arm.stop = lambda deceleration: (events.append("brake"), stop(deceleration))

    def interrupted(qd):
        if error is KeyboardInterrupt and loop.now() > 0.3 and not events:
            raise error
        speed(qd)

    loop._arm.speed = interrupted
    with pytest.raises(error), loop:
        loop.follow(TileMove(workspace.position(3, 3), workspace.position(4, 3), 0.6), phase=record.MOVE, move=0)
    name = "ArmError" if error is Stopped else "KeyboardInterrupt"
    assert events == ([name, "brake", True, "brake"] if error is Stopped else [name, True, "brake"])


def test_a_dead_loop_leaves_the_simulated_arm_at_rest(workspace):
    clock = VirtualClock()
    arm = SimArm(clock, workspace.reach.q[3, 3].tolist())
    for k in range(20):
        clock.wait_until(k * PERIOD)
        arm.state()
        arm.speed([0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
    clock.wait_until(20 * PERIOD + 0.35)
    assert np.abs(arm.state().qd).max() < 1e-3
