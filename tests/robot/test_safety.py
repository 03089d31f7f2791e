import pytest

from hrcneuro.robot.backend import EMERGENCY, NORMAL, PAUSED, PROTECTIVE, STOPPED, Cause, Packet
from hrcneuro.robot.parameters import Safety
from hrcneuro.robot.safety import Supervisor


def packet(**changes) -> Packet:
    return Packet(**({"stamp": 1.0, "q": [0.0] * 6, "qd": [0.0] * 6} | changes))


def test_a_sound_packet_passes():
    assert Supervisor(Safety()).check(packet(), 1.0) is None
    assert Supervisor(Safety()).check(packet(), 1.020) is None


@pytest.mark.parametrize(
    ("changes", "cause", "word"),
    [
        ({"safety": PROTECTIVE}, Cause.PROTECTIVE_STOP, "protective stop"),
        ({"safety": EMERGENCY | PROTECTIVE}, Cause.EMERGENCY_STOP, "emergency stop"),
        ({"safety": 0}, Cause.NOT_NORMAL, "0x0"),
        ({"safety": NORMAL | 1 << 1}, Cause.SAFETY_BITS, "0x3"),
        ({"stamp": 0.979}, Cause.PACKETS_LOST, "21 ms"),
        ({"runtime": STOPPED}, Cause.PROGRAM, "not running (runtime_state 1"),
        ({"runtime": PAUSED}, Cause.PROGRAM, "paused (runtime_state 4"),
        ({"scaling": 0.5}, Cause.SLIDER, "50 %"),
    ],
)
def test_each_cause_is_named(changes, cause, word):
    trip = Supervisor(Safety()).check(packet(**changes), 1.0)
    assert trip is not None
    assert trip.cause is cause
    assert word in trip.problem


def test_the_gravest_cause_is_named_first():
    everything = packet(safety=PROTECTIVE, runtime=STOPPED, scaling=0.1, stamp=0.0)
    trip = Supervisor(Safety()).check(everything, 1.0)
    assert trip is not None
    assert trip.cause is Cause.PROTECTIVE_STOP


def test_a_stopped_arm_is_not_asked_to_brake():
    assert not Supervisor(Safety()).check(packet(safety=PROTECTIVE), 1.0).brake
    assert Supervisor(Safety()).check(packet(stamp=0.0), 1.0).brake


def test_a_protective_stop_says_that_it_is_never_unlocked():
    trip = Supervisor(Safety()).check(packet(safety=PROTECTIVE), 1.0)
    assert "never unlocks" in trip.problem


def test_the_message_of_a_late_packet_names_the_option_and_what_was_held_up():
    supervisor = Supervisor(Safety())
    assert supervisor.check(packet(stamp=0.2), 0.2, late=0.03) is None
    in_time = supervisor.check(packet(stamp=1.3), 1.332).problem
    assert in_time.startswith(
        "the last packet is 32 ms old; 20 ms are safe (robot.max_packet_age_s); this session's own"
    )
    assert "began in time" in in_time
    assert supervisor.check(packet(stamp=1.35), 1.35, late=0.005) is None
    assert supervisor.check(packet(stamp=1.36), 1.36, late=0.011) is None
    busy = supervisor.check(packet(stamp=1.37), 1.392).problem
    assert "2 began late, by up to 11 ms: this machine was busy" in busy


def test_patience_counts_late_packets_and_ends_where_none_come():
    supervisor = Supervisor(Safety(patient=True))
    for age in (0.0, 0.02, 0.032, 0.5, 0.1):
        assert supervisor.check(packet(), 1.0 + age) is None
    assert (supervisor.late_packets, supervisor.oldest) == (3, pytest.approx(0.5))
    gone = supervisor.check(packet(), 1.501)
    assert gone.cause is Cause.PACKETS_LOST
    assert "500 ms are borne with robot.patient" in gone.problem
    assert supervisor.late_packets == 3


@pytest.mark.parametrize("changes", [{"safety": PROTECTIVE}, {"runtime": PAUSED}, {"scaling": 0.5}])
def test_patience_bears_nothing_else(changes):
    assert Supervisor(Safety(patient=True)).check(packet(**changes), 1.1) is not None
    assert Supervisor(Safety(patient=True)).check(packet(), 1.1, late=0.11).cause is Cause.LATE
    full = Supervisor(Safety(patient=True), keeper=lambda: "the disk is full").check(packet(), 1.1)
    assert full.cause is Cause.NOT_KEPT
