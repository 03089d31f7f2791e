"""What a person can do when a session cannot begin or go on, in the user's words: options, cables, the pendant."""

from __future__ import annotations

from hrcneuro.errors import ConfigError, HardwareError, StageError
from hrcneuro.robot.backend import ArmError, Cause, Stopped
from hrcneuro.robot.plan import TooQuick
from hrcneuro.robot.rehearsal import Foreseen
from hrcneuro.robot.trajectory import NoPath
from hrcneuro.robot.workspace import CellError, Flaw, WayError

AGAIN = "then start the session again with the episode it stopped in (robot.episodes)"

_CAUSES = {
    Cause.EMERGENCY_STOP: (
        f"see that the cell is safe, release the emergency stop and start the arm on its pendant, {AGAIN}"
    ),
    Cause.PROTECTIVE_STOP: f"find what it touched, free it, unlock the protective stop on the pendant, {AGAIN}",
    Cause.NOT_NORMAL: f"read the pendant, clear what it names, {AGAIN}",
    Cause.SAFETY_BITS: f"leave reduced or recovery mode and clear safeguard stops, {AGAIN}",
    Cause.PACKETS_LOST: f"check the cable and what else loads this machine, {AGAIN}",
    # A CB3 has no remote control mode, unlike the e-Series: its pendant, or whoever sends a program, stops this one.
    Cause.PROGRAM: (
        "on the pendant close what message it shows, and leave its play, pause and stop alone; let no other program or "
        f"client send to the robot, {AGAIN}"
    ),
    Cause.LATE: f"keep this machine awake and free of other work, and let nothing suspend the session, {AGAIN}",
    Cause.NOT_KEPT: f"free space where recordings lie (robot.rescue_folder), {AGAIN}",
    Cause.ALONE: "see why the command that asked for the motions has ended, then start it again",
    Cause.SLIDER: f"set it to 100 %, {AGAIN}",
    Cause.NO_NUMBER: "check robot.cell and the path that was asked for",
    Cause.OUT_OF_BOX: "check robot.cell and the path that was asked for",
    Cause.OFF_PATH: (
        "see that nothing holds the arm, that robot.lead_s (best left out: it is measured) and robot.gain suit it, and "
        f"that nothing delays this machine, {AGAIN}"
    ),
    Cause.TIP_ASTRAY: "see that nothing holds the arm, and that robot.lead_s and robot.gain suit it",
    Cause.JOINT_ASTRAY: "see that nothing holds the arm",
    Cause.STARTS_OUTSIDE: "bring it above the screen with the pendant, or correct robot.cell",
    Cause.STARTS_FOLDED: "bring the arm near its home position with the pendant",
    Cause.SLOW_ANSWER: "connect the robot by a cable of its own, without radio, tunnel or busy switches in between",
    Cause.NO_RESPONSE: "see that its program runs and takes velocities, or give robot.lead_s",
    Cause.OTHER_RESPONSE: "look for other programs that command it, or give robot.lead_s",
}


_FLAWS = {
    Flaw.NO_ROOM: "choose robot.cell.hover and robot.cell.home between robot.cell.floor and ceiling",
    Flaw.OUT_OF_BOX: "widen the box: robot.cell.margin, floor and ceiling",
    Flaw.OUT_OF_REACH: "bring the cell nearer to the arm: robot.cell.base_height, near_edge, tool or home",
    Flaw.OUT_OF_RANGE: "choose robot.cell.seed_deg nearer to zero: a whole turn less is the same pose",
    Flaw.SINGULAR: "move the cell away from the arm's singular region: robot.cell.base_height, near_edge or tool",
}


_FORESEEN = {
    Cause.OUT_OF_BOX: (
        "lower robot.approach_speed, approach_acceleration and approach_jerk, stop harder (robot.stop_deceleration, "
        "stop_jerk), or widen the box: robot.cell.margin, floor and ceiling"
    ),
    Cause.OFF_PATH: (
        "lower robot.approach_speed, approach_acceleration and approach_jerk, raise robot.t_f_s, or allow more "
        "(robot.max_path_error_mm); see that robot.gain and damping suit the arm"
    ),
}


_PATIENCE = "or let the session bear packets that come late: --patient"


def with_cure(error: BaseException, *, may_be_patient: bool = False, again: str = AGAIN) -> BaseException:
    """Return what the numbers of a session raise with what a person can do about it; any other error as it is.

    Args:
        error: What was raised.
        may_be_patient: Whether the session's own controller is driven, and could be driven on late packets.
        again: How the session goes on once the cause is mended.
    """
    if isinstance(error, Foreseen):
        return ConfigError(error.problem, cure=_FORESEEN.get(error.cause, _FORESEEN[Cause.OFF_PATH]))
    if isinstance(error, ArmError):
        cure = _CAUSES[error.cause].replace(AGAIN, again)
        if may_be_patient and error.cause is Cause.PACKETS_LOST:
            cure = f"{cure}; {_PATIENCE}"
        if isinstance(error, Stopped) and not error.rests:
            cure = f"press the emergency stop; {cure}"
        return HardwareError(error.problem, cure=cure)
    if isinstance(error, CellError):
        place = "" if isinstance(error, WayError) else "robot.cell: "
        return ConfigError(f"{place}{error.problem}", cure=_FLAWS[error.flaw])
    if isinstance(error, TooQuick):
        cure = f"robot.t_f_s of at least {error.least_s:.2f} s suits every move of the selection"
        return ConfigError(str(error), cure=cure)
    if isinstance(error, NoPath):
        return StageError(str(error), cure="check the bounds robot.approach_*, robot.homing_* and robot.stop_*")
    return error
