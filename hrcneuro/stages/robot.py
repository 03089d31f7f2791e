"""The arm that replays a subject's moves at 125 Hz, how well and how punctually (paper §2.3.1, 2.3.2, 2.3.4)."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.arms.connection import Connection
from hrcneuro.contract import Inputs, Read, Sessions, Stage, Work, option
from hrcneuro.errors import ConfigError, DataError, HardwareError, HrcError, StageError, StageInterrupted, cured
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.parameters import Durations, Pace, Safety, Selection
from hrcneuro.robot.tracking import Tracking

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import pandas as pd

    from hrcneuro.robot.backend import Backend, Clock
    from hrcneuro.robot.loop import Loop, OnOnset
    from hrcneuro.robot.plan import PlannedMove
    from hrcneuro.robot.session import Executed
    from hrcneuro.robot.workspace import Workspace


@dataclass(frozen=True)
class Config(Pace, Safety, Tracking, Durations, Selection, Connection):
    """Which moves are replayed, on which arm, how it is driven, and who is told of every onset."""

    markers: str = option(
        "none", "lsl: each motion onset also goes out on the lab streaming layer; not from sim, whose clock is virtual",
        choices=("none", "lsl"),
    )  # fmt: skip
    recorder_wait_s: float = option(
        0.0, "wait so long for a recorder of the markers before anything moves; 0: do not wait", unit="s", low=0.0,
        high=3600.0, keyed=False,
    )  # fmt: skip
    stim_rate_hz: float | None = option(
        None, "rate of the recording that takes the markers in its stim channel; none: the log's", unit="Hz", low=1.0,
        high=1e6,
    )  # fmt: skip
    rescue_folder: str = option(
        "robot-stopped",
        "where records of stopped sessions are kept, by subject and number",
        path=True,
        keyed=False,
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

    Raises:
        DataError: The trial table holds no moves on the grid, or they do not hang together.
        ConfigError: The selection is empty, a tile is out of reach, a way leads near a singularity or out of the box,
            or a duration breaks a joint's limit.
        HardwareError: Another session drives the arm; it was stopped, and the record until then is in
            ``rescue_folder``; or the markers' stream cannot be opened.
    """
    from hrcneuro.arms.cures import with_cure
    from hrcneuro.io.tables import read_table
    from hrcneuro.robot.plan import sampling_rate
    from hrcneuro.robot.session import run_session

    trials = read_table(inputs.path("acquire", "trials.parquet"))
    moves, workspace = _plan(config, trials)
    rate = config.stim_rate_hz or sampling_rate(trials)
    stamps: dict[int, float] = {}
    executed: list[Executed] = []
    loop: Loop | None = None
    try:
        with contextlib.ExitStack() as stack:
            on_onset = _on_onset(config, inputs.unit, moves, stamps, stack)
            loop = stack.enter_context(_loop(config, workspace, inputs.unit, on_onset, stack))
            run_session(loop, workspace, moves, lead=config.lead_s, pace=config, on_executed=executed.append)
    except BaseException as error:
        reason = with_cure(error)
        if loop is not None and loop.record.telemetry().command.any():
            # The pipeline throws away what a failed stage wrote; of a session on an arm, nothing may be lost.
            folder = Path(config.rescue_folder) / inputs.unit
            kept = _rescue(folder, lambda place: _write(loop, executed, workspace, place, rate, stamps))
            reason = _with_record(reason, f"{kept}; it ended {_reached(loop, moves)}")
        if reason is error:
            raise
        raise reason from error
    return _write(loop, executed, workspace, out, rate, stamps)


def _plan(config: Config, trials: pd.DataFrame) -> tuple[list[PlannedMove], Workspace]:
    """Return the moves, all of which the arm can make, and where it makes them."""
    from hrcneuro.arms.cures import with_cure
    from hrcneuro.robot.plan import TooQuick, check_durations, check_paths, grid_moves, plan, select
    from hrcneuro.robot.workspace import CellError, Workspace

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
        workspace = Workspace(config.cell)
        check_durations(moves, workspace, acceleration=config.max_acceleration)
        check_paths(moves, workspace)
    except (CellError, TooQuick) as error:
        raise with_cure(error) from error
    return moves, workspace


def _rescue(folder: Path, write: Callable[[Path], object]) -> str:
    """Write into the next numbered folder, so that no attempt overwrites another's record; return what became of it."""
    place = folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
        number = max([int(p.name) for p in folder.iterdir() if p.name.isdecimal()], default=0) + 1
        place = folder / str(number)
        place.mkdir()
        write(place)
    except Exception as flaw:
        # What stopped the arm matters more.
        return f"the record in {place} is not whole ({type(flaw).__name__}: {flaw})"
    return f"the record is in {place}"


def _reached(loop: Loop, moves: Sequence[PlannedMove]) -> str:
    last = int(loop.record.telemetry().move.max())
    if last < 0:
        return "before the first move"
    move = moves[last]
    practice = "practice " if move.practice else ""
    return f"in {practice}block {move.block}, episode {move.episode}, trial {move.trial}"


def _with_record(error: BaseException, record: str) -> BaseException:
    """Return the error with where the record is, and how to go on."""
    anew = "the same command begins the session anew; robot.blocks and robot.episodes choose what is left of it"
    if isinstance(error, KeyboardInterrupt):
        return StageInterrupted(f"interrupted; {record}", cure=anew)
    if isinstance(error, HrcError):
        kind = HardwareError if isinstance(error, HardwareError) else StageError
        return kind(f"{error.problem}; {record}", cure=f"{error.cure}; {anew}" if error.cure else anew)
    if isinstance(error, Exception):
        return StageError(f"{type(error).__name__}: {error}; {record}", cure=anew)
    return error


def _on_onset(
    config: Config, subject: str, moves: Sequence[PlannedMove], stamps: dict[int, float], stack: contextlib.ExitStack
) -> OnOnset | None:
    if config.markers != "lsl":
        return None
    from hrcneuro.live.markers import MarkerOutlet

    outlet = stack.enter_context(MarkerOutlet(f"hrcneuro robot {subject}"))
    if config.recorder_wait_s:
        outlet.wait(config.recorder_wait_s)

    def mark(age: Callable[[], float], move: int) -> None:
        stamps[move] = outlet.send(moves[move].marker(subject), age)

    return mark


def _write(
    loop: Loop, executed: list[Executed], workspace: Workspace, out: Path, rate: float, stamps: dict[int, float]
) -> dict[str, Any]:
    from hrcneuro.io.tables import write_table
    from hrcneuro.robot import measure
    from hrcneuro.tables import robot as tables

    telemetry = loop.record.telemetry()
    tip = measure.tip(telemetry, tool=workspace.cell.tool)
    measures = measure.measure_moves(executed, telemetry, tip, workspace)
    measures |= measure.marker_timing(executed, rate=rate)
    moves = tables.moves(executed, measures, stamps)
    latencies = {name: measures[f"{name}_latency_ms"] for name in ("trigger", "marker", "stim")}
    timing = measure.timing(telemetry, latencies, measures["behind_log_ms"])
    columns = tables.telemetry(telemetry, tip, measure.commanded_angles(telemetry))
    write_table(columns, out / "telemetry.parquet", tables.TELEMETRY)
    write_table(moves, out / "moves.parquet", tables.MOVES)
    write_table(tables.timing(timing), out / "timing.parquet", tables.TIMING)
    write_table(tables.reach(workspace), out / "reach.parquet", tables.REACH)
    return measure.summarise(telemetry, moves, stops=loop.stops, lead=loop.lead)


def _loop(
    config: Config, workspace: Workspace, subject: str, on_onset: OnOnset | None, stack: contextlib.ExitStack
) -> Loop:
    from hrcneuro.robot.limits import Limits
    from hrcneuro.robot.loop import Loop
    from hrcneuro.robot.safety import Supervisor
    from hrcneuro.robot.tracking import ResolvedRate
    from hrcneuro.robot.workspace import DOWN

    arm, clock = _arm(config, workspace, subject, stack)
    tool = config.cell.tool
    return Loop(
        arm,
        clock,
        law=ResolvedRate(config, tool=tool, orientation=DOWN.tolist()),
        limits=Limits(config, box=workspace.box, tool=tool),
        supervisor=Supervisor(config),
        stop=config.stop,
        on_onset=on_onset,
    )


def _arm(config: Config, workspace: Workspace, subject: str, stack: contextlib.ExitStack) -> tuple[Backend, Clock]:
    if config.backend == "sim":
        from hrcneuro.robot.sim import SimArm, VirtualClock

        virtual = VirtualClock()
        return SimArm(virtual, workspace.home().tolist()), virtual

    from hrcneuro.arms import connect
    from hrcneuro.arms.lock import exclusive

    if config.there_once:
        stack.enter_context(exclusive(config.backend, config.host, subject))
    arm, clock = connect(config.backend, host=config.host, driver=config.driver)
    stack.callback(clock.restore_priority)
    return arm, clock


STAGE = Stage(
    name="robot",
    title="The arm",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "pyarrow", "ruckig"),
    check=check,
    subject=Work(run, (Read("acquire", ("trials.parquet",)),)),
    sessions=sessions,
)
