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
