import pytest

from hrcneuro.arms.connection import Connection


@pytest.mark.parametrize(
    ("backend", "host", "simulated", "there_once"),
    [
        ("sim", "", True, False),
        ("ursim", "", True, False),
        ("ur", "127.0.0.9", True, True),
        ("ur", "192.168.0.10", False, True),
        # A name may stand for any robot, whatever it begins with.
        ("ur", "127.a-robot.example", False, True),
        ("ur", "localhost", False, True),
        ("ros", "", False, True),
    ],
)
def test_which_arms_are_real_and_which_are_there_once(backend, host, simulated, there_once):
    connection = Connection(backend=backend, host=host)
    assert (connection.simulated, connection.there_once) == (simulated, there_once)
