"""The arm that replays a subject's moves at 125 Hz, how well and how punctually (paper §2.3.1, 2.3.2, 2.3.4)."""

from __future__ import annotations

import contextlib
import gc
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import interrupts
from hrcneuro.arms.connection import Connection
from hrcneuro.contract import Inputs, Read, Sessions, Stage, Work, option, params
from hrcneuro.errors import ConfigError, DataError, cured
from hrcneuro.live import triggers
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.parameters import Durations, Pace, Safety, Selection
from hrcneuro.robot.tracking import Tracking

if TYPE_CHECKING:
    import pandas as pd

    from hrcneuro.analyses.driven import Driven
    from hrcneuro.robot.backend import Backend, Clock
    from hrcneuro.robot.plan import PlannedMove
    from hrcneuro.robot.workspace import Workspace


@dataclass(frozen=True)
class Config(Pace, Safety, Tracking, Durations, Selection, Connection):
    """Which moves are replayed, on which arm, how it is driven, and who is told of every onset."""

    markers: str = option(
        "none", "lsl: each motion onset also goes out on the lab streaming layer; not from sim, whose clock is virtual",
        choices=("none", "lsl"),
    )  # fmt: skip
    trigger: triggers.TriggerOptions = option(
        triggers.TriggerOptions(), "each motion onset also goes out on a trigger port"
    )
    truth: bool = option(
        False, "ursim: also tell hrcneuro amp what a person who knows the log would expect", keyed=False
    )
    recorder_wait_s: float = option(
        0.0, "wait so long for a recorder of the markers before anything moves; 0: do not wait", unit="s", low=0.0,
        high=3600.0, keyed=False,
    )  # fmt: skip
    stim_rate_hz: float | None = option(
        None, "rate of the recording that takes the markers in its stim channel; none: the log's", unit="Hz", low=1.0,
        high=1e6,
    )  # fmt: skip
    rescue_folder: str = option(
        "recordings",
        "where what an arm did is kept, by subject and start; unnamed, in the working folder; nothing deletes it",
        path=True,
        keyed=False,
        recordings=True,
    )
    cell: Cell = option(Cell(), "where table, screen and arm stand")


def check(config: Config) -> list[str]:
    """Return the contradictions between values."""
    mistakes = []
    if len(config.t_f_range_s) != 2 or config.t_f_range_s[0] > config.t_f_range_s[-1]:
        mistakes.append(f"t_f_range_s = {list(config.t_f_range_s)}; allowed: [least, greatest]")
    if len(config.cell.seed_deg) != 6:
        mistakes.append(f"cell.seed_deg has {len(config.cell.seed_deg)} angles; allowed: six")
    cell = config.cell
    if not cell.floor < min(cell.hover, cell.home) or not max(cell.hover, cell.home) < cell.ceiling:
        mistakes.append(
            f"cell.hover = {cell.hover} and cell.home = {cell.home}; allowed: between cell.floor = {cell.floor} and "
            f"cell.ceiling = {cell.ceiling}"
        )
    if config.markers == "lsl" and config.backend == "sim":
        mistakes.append(
            "markers = 'lsl' with backend = 'sim': its clock is virtual and runs faster than any recording; allowed "
            "with ursim, ur and ros"
        )
    if config.trigger.port != "none" and config.backend == "sim":
        mistakes.append(
            f"trigger.port = {config.trigger.port!r} with backend = 'sim': its clock is virtual; allowed with ursim, "
            "ur and ros"
        )
    mistakes += triggers.mistakes(config.trigger, "trigger")
    if config.truth and config.backend != "ursim":
        mistakes.append(
            f"truth = true with backend = {config.backend!r}; allowed with ursim, beside a simulated person"
        )
    if config.patient and config.backend == "sim":
        mistakes.append(
            "patient = true with backend = 'sim': it runs in this process and has no packets that could be late; "
            "allowed with ursim"
        )
    elif config.patient and config.backend != "ursim":
        # An address on loopback may be the near end of a tunnel to a real arm.
        mistakes.append(
            f"patient = true with backend = {config.backend!r}: a real arm is never driven on old packets; allowed "
            "with ursim, whose controller is the session's own"
        )
    if config.lead_s is not None and config.lead_s > config.max_lead_s:
        mistakes.append(
            f"lead_s = {config.lead_s:g} is above max_lead_s = {config.max_lead_s:g}: an arm that takes so long is not "
            "driven, and with such a lead another one leaves its path; allowed: less, or none (it is then measured)"
        )
    if not config.named_soundly:
        mistakes.append(f"host = {config.host!r} is no address; allowed: a number such as 192.168.0.10, or a name")
    if not config.rescue_folder:
        mistakes.append("rescue_folder is empty; allowed: the name of a folder, such as recordings")
    return mistakes + _unsafe(config)


def _unsafe(config: Config) -> list[str]:
    if config.backend == "ur" and not config.host:
        return ["backend = 'ur' needs the address of the arm's controller: robot.host, or --host"]
    if not config.simulated and not config.at_the_robot:
        return [
            f"backend = {config.backend!r} moves a real arm: stand at its emergency stop and say --i-am-at-the-robot "
            "(robot.at_the_robot = true)"
        ]
    return []


def sessions(config: Config) -> Sessions:
    """Return how many sessions may run at a time: any on a virtual clock, one in real time, one a command on an arm."""
    if config.backend == "sim":
        return Sessions.SIDE_BY_SIDE
    return Sessions.ONE_A_COMMAND if config.there_once else Sessions.ONE_AT_A_TIME


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Replay the subject's moves; write ``telemetry``, ``moves``, ``timing`` and ``reach.parquet``.

    What an arm did, other than ``sim``, is a recording in ``rescue_folder``, of which these tables are a copy.

    Raises:
        DataError: The trial table holds no moves on the grid, or they do not hang together.
        ConfigError: The selection is empty, a tile is out of reach, a way leads near a singularity or out of the box,
            a duration breaks a joint's limit, or a limit would stop the session on its way.
        StageError: The disk has no room for the session, or its recording cannot be written.
        HardwareError: Another session drives the arm; it was stopped, and what it did until then is in
            ``rescue_folder``; or the markers' stream cannot be opened.
    """
    from hrcneuro.analyses.driven import Driven
    from hrcneuro.arms.cures import with_cure
    from hrcneuro.arms.words import Words
    from hrcneuro.io.tables import read_table
    from hrcneuro.robot.plan import sampling_rate

    trials = read_table(inputs.path("acquire", "trials.parquet"))
    moves, workspace = _plan(config, trials)
    rate = config.stim_rate_hz or sampling_rate(trials)
    with interrupts.whole(), Words(f"robot {inputs.unit}") as words:
        may_be_patient = config.backend == "ursim" and not config.patient
        folder = Path(config.rescue_folder)
        driven = Driven(inputs.unit, moves, workspace, rate, folder, words, may_be_patient=may_be_patient)
        if config.backend != "sim":
            driven.begin_recording(config, about=params(config), copy=out)
        try:
            _drive(config, driven, trials)
        except BaseException as error:
            interrupts.hold()
            reason = driven.stopped(with_cure(error, may_be_patient=may_be_patient))
            if reason is error:
                raise
            raise reason from error
        return driven.ended(out)


def _drive(config: Config, driven: Driven, trials: pd.DataFrame) -> None:
    """Drive the arm through the session; why it ends early is said at once, and whatever ends it leaves it at rest."""
    from hrcneuro.analyses.onset_senders import on_onset_of
    from hrcneuro.robot.assembly import make_loop
    from hrcneuro.robot.session import run_session

    with contextlib.ExitStack() as stack:
        # A pass of Python's collector over all that the libraries have loaded takes many cycles.
        gc.collect()
        gc.freeze()
        stack.callback(gc.unfreeze)
        on_onset = on_onset_of(config, driven, trials, stack)
        arm, clock = _arm(config, driven.workspace, stack)
        loop = make_loop(
            arm, clock, driven.workspace, tracking=config, safety=config, keeper=driven.fault, on_onset=on_onset,
            on_stop=driven.tell_stop, on_rest=driven.tell_rest,
        )  # fmt: skip
        driven.follow(stack.enter_context(loop))
        interrupts.once(driven.tell_patience)
        run_session(
            loop,
            driven.workspace,
            driven.moves,
            lead=config.lead_s,
            most_lead=config.max_lead_s,
            pace=config,
            on_executed=driven.take,
        )
        # Driven to its end: from here on Ctrl-C waits until all is kept.
        interrupts.hold(driven.tell_end())


def _plan(config: Config, trials: pd.DataFrame) -> tuple[list[PlannedMove], Workspace]:
    """Return the moves, all of which the arm can make, and where it makes them."""
    from hrcneuro.arms.cures import with_cure
    from hrcneuro.robot.assembly import rehearsing
    from hrcneuro.robot.plan import TooQuick, check_durations, check_paths, grid_moves, plan, select
    from hrcneuro.robot.rehearsal import Foreseen, rehearse
    from hrcneuro.robot.workspace import CellError, workspace_of

    foreign = "the robot stage replays the grid study only; leave it out for other paradigms"
    with cured({ValueError: (DataError, foreign)}):
        logged = grid_moves(trials)
    try:
        chosen = select(logged, config)
    except ValueError as error:
        cure = (
            "choose among what the log has; robot.blocks and robot.episodes left empty are all, and robot.practice = "
            "true adds the practice blocks"
        )
        raise ConfigError(f"robot.{error}", cure=cure) from error
    with cured({ValueError: (DataError, "the log lost a row or is of another study: acquire the subject again")}):
        moves = plan(chosen, config)
    try:
        workspace = workspace_of(config.cell)
        check_durations(moves, workspace, acceleration=config.max_acceleration)
        check_paths(moves, workspace)
        given = config.lead_s is not None
        rehearsed = rehearsing(workspace, tracking=config, safety=config)
        rehearse(moves, workspace, pace=config, lead_given=given, make_loop=rehearsed)
    except (CellError, TooQuick, Foreseen) as error:
        raise with_cure(error) from error
    return moves, workspace


def _arm(config: Config, workspace: Workspace, stack: contextlib.ExitStack) -> tuple[Backend, Clock]:
    from hrcneuro.arms.held import held_arm

    return held_arm(config, workspace, stack, max_delay=config.max_lead_s, real_time=False)


STAGE = Stage(
    name="robot",
    title="The arm",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "pyarrow", "ruckig"),
    check=check,
    subject=Work(run, (Read("acquire", ("trials.parquet",)),)),
    sessions=sessions,
    moves=True,
)
