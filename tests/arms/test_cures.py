"""What the numbers raise reaches people with a cure and the exit code of its kind."""

import pytest

from hrcneuro.arms.cures import with_cure
from hrcneuro.errors import ConfigError, HardwareError, StageError
from hrcneuro.robot.backend import ArmError, Cause, Stopped
from hrcneuro.robot.plan import TooQuick
from hrcneuro.robot.rehearsal import Foreseen
from hrcneuro.robot.trajectory import NoPath
from hrcneuro.robot.workspace import CellError, Flaw, WayError


@pytest.mark.parametrize("cause", Cause)
def test_every_cause_has_a_cure(cause):
    error = with_cure(ArmError(cause, "the arm does something odd"))
    assert isinstance(error, HardwareError)
    assert (error.exit_code, error.problem) == (4, "the arm does something odd")
    assert error.cure


@pytest.mark.parametrize("cause", [Cause.EMERGENCY_STOP, Cause.PROTECTIVE_STOP, Cause.NOT_NORMAL, Cause.PACKETS_LOST])
def test_after_a_stop_the_session_goes_on_with_its_episode(cause):
    error = with_cure(Stopped(cause, "the arm is odd", rests=True))
    assert error.cure.endswith("then start the session again with the episode it stopped in (robot.episodes)")
    assert error.problem == "the arm is odd; the arm was stopped"


@pytest.mark.parametrize("cause", Cause)
def test_an_arm_that_may_be_moving_asks_for_the_emergency_stop_first(cause):
    error = with_cure(Stopped(cause, "the arm is odd", rests=False))
    assert error.cure.startswith("press the emergency stop; ")
    assert error.problem.endswith("was not seen at rest: it may be moving")


def test_a_protective_stop_is_unlocked_by_people():
    assert "on the pendant" in with_cure(Stopped(Cause.PROTECTIVE_STOP, "…", rests=True)).cure


def test_a_stopped_program_is_cured_with_what_a_cb3_has():
    cure = with_cure(Stopped(Cause.PROGRAM, "…", rests=True)).cure
    assert "remote" not in cure
    assert "pendant" in cure


@pytest.mark.parametrize("cause", Cause)
def test_what_is_foreseen_is_a_matter_of_options(cause):
    error = with_cure(Foreseen(cause, "on the approach the session would be stopped"))
    assert (error.exit_code, error.problem) == (2, "on the approach the session would be stopped")
    assert "robot." in error.cure


@pytest.mark.parametrize("flaw", Flaw)
@pytest.mark.parametrize(("kind", "prefix"), [(CellError, "robot.cell: "), (WayError, "")])
def test_every_flaw_of_a_cell_has_a_cure_that_names_its_options(flaw, kind, prefix):
    error = with_cure(kind(flaw, "tile (6, 6) is far"))
    assert isinstance(error, ConfigError)
    assert error.problem == f"{prefix}tile (6, 6) is far"
    assert "robot.cell." in error.cure


def test_a_move_that_is_too_quick_is_told_the_least_duration():
    error = with_cure(TooQuick("t_f 0.2 s asks too much", least_s=0.324))
    assert isinstance(error, ConfigError)
    assert "robot.t_f_s of at least 0.32 s" in error.cure


def test_bounds_without_a_path_are_named():
    error = with_cure(NoPath("no jerk-limited path: jerk 0"))
    assert isinstance(error, StageError)
    assert "robot.approach_*" in error.cure


def test_other_errors_pass():
    other = KeyError("x")
    assert with_cure(other) is other


def test_patience_is_offered_where_the_controller_is_the_sessions_own():
    lost, other = (Stopped(cause, "…", rests=True) for cause in (Cause.PACKETS_LOST, Cause.LATE))
    assert "--patient" in with_cure(lost, may_be_patient=True).cure
    assert "--patient" not in with_cure(lost).cure
    assert "--patient" not in with_cure(other, may_be_patient=True).cure
