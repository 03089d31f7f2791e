"""Which tasks move an arm in real time, and who may order them."""

import pytest
from tiny_study import write_tiny

from hrcneuro.config import settings as config
from hrcneuro.errors import ConfigError
from hrcneuro.pipeline import graph

UR = ["robot.backend=ur", "robot.host=127.0.0.9"]


@pytest.fixture
def robot(tmp_path):
    """Settings and tasks of a stage ``robot``, with these assignments and subjects."""
    write_tiny(tmp_path)

    def tasks(assignments, *subjects):
        settings = config.load(tmp_path / "tiny.toml", ["robot.at_the_robot=true", *assignments])
        return settings, graph.closure(settings, graph.targets(settings, ["robot"], subjects))

    return tasks


def test_on_a_virtual_clock_anybody_may_order_sessions(robot):
    settings, tasks = robot(["robot.backend=sim"])
    assert graph.in_real_time(settings, tasks) is False
    graph.check_unattended(settings, tasks)


@pytest.mark.parametrize("arm", [UR, ["robot.backend=ursim"], ["robot.backend=ros"]])
def test_an_arm_in_real_time_is_left_to_no_engine_of_others_not_even_for_one_subject(robot, arm):
    settings, tasks = robot(arm, "s01")
    assert graph.in_real_time(settings, tasks) is True
    with pytest.raises(ConfigError, match="drives one arm in real time, and a subject is asked of it") as refused:
        graph.check_unattended(settings, tasks)
    assert refused.value.cure.startswith("hrcneuro robot s01 ")
    other = graph.closure(settings, graph.targets(settings, ["epoch"], []))
    graph.check_unattended(settings, other)


def test_an_arm_that_is_there_once_takes_one_subject_a_command(robot):
    with pytest.raises(ConfigError, match=r"2 subjects are asked of it \(s01, s02\); allowed: one subject a command"):
        graph.in_real_time(*robot(UR))
    assert graph.in_real_time(*robot(["robot.backend=ursim"])) is True
