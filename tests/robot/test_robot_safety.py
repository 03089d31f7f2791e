import pytest

from hrcneuro.robot.backend import EMERGENCY, NORMAL, PAUSED, PROTECTIVE, STOPPED, State
from hrcneuro.robot.safety import Supervisor


def packet(**changes) -> State:
    return State(**({"stamp": 1.0, "q": [0.0] * 6, "qd": [0.0] * 6} | changes))


def test_a_sound_packet_passes():
    assert Supervisor().check(packet(), 1.0) is None
    assert Supervisor().check(packet(), 1.020) is None


@pytest.mark.parametrize(
    ("changes", "name", "word"),
    [
        ({"safety": PROTECTIVE}, "protective_stop", "protective stop"),
        ({"safety": EMERGENCY | PROTECTIVE}, "emergency_stop", "emergency stop"),
        ({"safety": 0}, "not_normal", "0x0"),
        ({"safety": NORMAL | 1 << 1}, "safety_bits", "0x3"),
        ({"stamp": 0.979}, "packets_lost", "21 ms"),
        ({"runtime": STOPPED}, "program", "not running (runtime_state 1"),
        ({"runtime": PAUSED}, "program", "paused (runtime_state 4"),
        ({"scaling": 0.5}, "slider", "50 %"),
    ],
)
def test_each_cause_is_named_with_a_cure(changes, name, word):
    trip = Supervisor().check(packet(**changes), 1.0)
    assert trip is not None
    assert trip.name == name
    assert word in trip.problem
    assert trip.cure


def test_the_gravest_cause_is_named_first():
    everything = packet(safety=PROTECTIVE, runtime=STOPPED, scaling=0.1, stamp=0.0)
    trip = Supervisor().check(everything, 1.0)
    assert trip is not None
    assert trip.name == "protective_stop"


def test_a_stopped_arm_is_not_asked_to_brake():
    assert not Supervisor().check(packet(safety=PROTECTIVE), 1.0).brake
    assert Supervisor().check(packet(stamp=0.0), 1.0).brake


def test_a_protective_stop_says_that_it_is_never_unlocked():
    trip = Supervisor().check(packet(safety=PROTECTIVE), 1.0)
    assert "never unlocks" in trip.problem
    assert "on the pendant" in trip.cure
