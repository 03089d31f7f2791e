"""The arm that replays a subject's moves at 125 Hz, how well and how punctually (paper §2.3.1, 2.3.2, 2.3.4)."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from ipaddress import IPv4Address
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.contract import Inputs, Read, Sessions, Stage, Work, option
from hrcneuro.errors import HardwareError, StageError, StageInterrupted
from hrcneuro.robot.cell import Cell

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hrcneuro.robot.backend import Backend, Clock
    from hrcneuro.robot.loop import Loop, OnOnset
    from hrcneuro.robot.plan import Move
    from hrcneuro.robot.session import Done, Pace
    from hrcneuro.robot.workspace import Workspace

FIGURES = {
    "robot.png": "The tip over the tiles, its distance from the reference, and when it comes into the 2 mm radius",
    "timing.png": "Timing (§ 2.3.4): from marker to motion onset, control cycles, and onsets behind the log's",
    "reach.png": "The cell, how far each of its tiles is from a singularity, and how fast the joints must turn there",
}


@dataclass(frozen=True)
class Config:
    """Which moves are replayed, on which arm, and how it is driven."""

    backend: str = option(
        "sim", "the arm: sim in-process on a virtual clock, ursim a simulated controller, ur a UR10, ros behind ROS",
        choices=("sim", "ursim", "ur", "ros"),
    )  # fmt: skip
    driver: str = option(
        "rtde", "how ur and ursim are driven: ur_rtde's speedJ, or speedj lines on port 30003 as in the paper",
        choices=("rtde", "script"),
    )  # fmt: skip
    # Part of the key, unlike other places: a simulated controller's session must not be taken for the real arm's.
    host: str = option("", "address of the arm's controller, for backend ur")
    at_the_robot: bool = option(False, "someone stands at the arm's emergency stop: a real arm needs it", keyed=False)
    max_packet_age_s: float = option(0.020, "an older packet stops the arm", unit="s", low=0.008, high=0.5)
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
    blocks: tuple[int, ...] = option((), "main blocks to replay; none: all", low=1)
    episodes: tuple[int, ...] = option((), "episodes of each block to replay; none: all", low=1)
    practice: bool = option(False, "also replay the practice blocks")
    t_f_s: float | None = option(None, "duration of every tile move; none: the log's", unit="s", low=0.05, high=5.0)
    t_f_range_s: tuple[float, ...] = option((0.6, 1.2), "where the log has onsets only, durations lie within", unit="s",
                                            low=0.05, high=5.0)  # fmt: skip
    t_f_default_s: float = option(0.9, "where the log has no times", unit="s", low=0.05, high=5.0)
    start_next: str = option(
        "at_rest", "when the next motion starts: once this one has ended, or within the radius, on the move",
        choices=("at_rest", "in_radius"),
    )  # fmt: skip
    pause_s: float = option(0.5, "rest on the start tile before an episode", unit="s", low=0.0, high=60.0)
    longest_gap_s: float = option(5.0, "a longer gap between onsets is cut to this", unit="s", low=0.0, high=600.0)
    gain: float = option(8.0, "feedback of the tracking law", unit="1/s", low=0.0, high=30.0)
    damping: float = option(0.01, "damping of the tracking law", low=1e-6, high=1.0)
    lead_s: float | None = option(None, "lead of the feed-forward; none: measured", unit="s", low=0.0, high=0.2)
    max_acceleration: float = option(12.0, "of every joint", unit="rad/s²", low=1.0, high=40.0)
    stop_deceleration: float = option(8.0, "of a controlled stop, every joint", unit="rad/s²", low=0.5, high=40.0)
    stop_jerk: float = option(200.0, "of a controlled stop, every joint", unit="rad/s³", low=5.0, high=2000.0)
    approach_speed: float = option(0.25, "between episodes, along each axis", unit="m/s", low=0.01, high=1.0)
    approach_acceleration: float = option(1.0, "between episodes", unit="m/s²", low=0.01, high=5.0)
    approach_jerk: float = option(10.0, "between episodes", unit="m/s³", low=0.1, high=100.0)
    homing_speed: float = option(0.5, "to the home position, every joint", unit="rad/s", low=0.01, high=2.0)
    homing_acceleration: float = option(1.0, "to the home position", unit="rad/s²", low=0.01, high=10.0)
    homing_jerk: float = option(10.0, "to the home position", unit="rad/s³", low=0.1, high=200.0)
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


def sessions(config: Config) -> Sessions:
    """Return how many sessions may run at a time: any on a virtual clock, one in real time, one a command on an arm.

    ``sim`` and ``ursim`` make an arm for each session; any other is there only once.
    """
    if config.backend == "sim":
        return Sessions.SIDE_BY_SIDE
    return Sessions.ONE_AT_A_TIME if config.backend == "ursim" else Sessions.ONE_A_COMMAND


def _unsafe(config: Config) -> list[str]:
    if config.backend == "ur" and not config.host:
        return ["backend = 'ur' needs the address of the arm's controller: robot.host, or --host"]
    simulated = config.backend in ("sim", "ursim") or (config.backend == "ur" and _loopback(config.host))
    if not simulated and not config.at_the_robot:
        return [
            f"backend = {config.backend!r} moves a real arm: stand at its emergency stop and say --i-am-at-the-robot "
            "(robot.at_the_robot = true)"
        ]
    return []


def _loopback(host: str) -> bool:
    # By its number: a name that begins with 127. may stand for any robot.
    try:
        return IPv4Address(host).is_loopback
    except ValueError:
        return False


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Replay the subject's moves; write ``telemetry``, ``moves``, ``timing``, ``reach.parquet`` and the figures.

    Raises:
        DataError: The trial table holds no moves on the grid.
        ConfigError: The selection is empty, a tile is out of reach, a way leads near a singularity or out of the box,
            or a duration breaks a joint's limit.
        HardwareError: Another session drives the arm; it was stopped, and the record until then is in
            ``rescue_folder``; or the markers' stream cannot be opened.
    """
    from hrcneuro.io.tables import read_table
    from hrcneuro.robot.plan import check_durations, check_paths, plan, sampling_rate, select
    from hrcneuro.robot.session import run_session
    from hrcneuro.robot.workspace import Workspace

    trials = read_table(inputs.path("acquire", "trials.parquet"))
    chosen = select(trials, blocks=config.blocks, episodes=config.episodes, practice=config.practice)
    least, most = config.t_f_range_s
    moves = plan(chosen, t_f=config.t_f_s, t_f_range=(least, most), default_t_f=config.t_f_default_s)
    workspace = Workspace(config.cell)
    check_durations(moves, workspace, acceleration=config.max_acceleration)
    check_paths(moves, workspace)

    rate = config.stim_rate_hz or sampling_rate(trials)
    stamps: dict[int, float] = {}
    done: list[Done] = []
    loop: Loop | None = None
    try:
        with contextlib.ExitStack() as stack:
            on_onset = _on_onset(config, inputs.unit, moves, stamps, stack)
            loop = stack.enter_context(_loop(config, workspace, inputs.unit, on_onset, stack))
            run_session(loop, workspace, moves, lead=config.lead_s, pace=_pace(config), on_done=done.append)
    except BaseException as error:
        if loop is None or not loop.record.telemetry().command.any():
            raise
        # The pipeline throws away what a failed stage wrote; of a session on an arm, nothing may be lost.
        folder = Path(config.rescue_folder) / inputs.unit
        kept = _rescue(folder, lambda place: _write(config, loop, done, workspace, place, rate, stamps))
        raise _told(error, f"{kept}; it ended {_reached(loop, moves)}") from error
    return _write(config, loop, done, workspace, out, rate, stamps)


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


def _reached(loop: Loop, moves: Sequence[Move]) -> str:
    last = int(loop.record.telemetry().move.max())
    if last < 0:
        return "before the first move"
    move = moves[last]
    practice = "practice " if move.practice else ""
    return f"in {practice}block {move.block}, episode {move.episode}, trial {move.trial}"


def _told(error: BaseException, record: str) -> BaseException:
    """Return the error with where the record is, and how to go on."""
    anew = "the same command begins the session anew; robot.blocks and robot.episodes choose what is left of it"
    if isinstance(error, KeyboardInterrupt):
        return StageInterrupted(f"interrupted; {record}", cure=anew)
    if isinstance(error, HardwareError):
        return HardwareError(f"{error.problem}; {record}", cure=f"{error.cure}; {anew}" if error.cure else anew)
    if isinstance(error, Exception):
        return StageError(f"{type(error).__name__}: {error}; {record}", cure=anew)
    return error


def _on_onset(
    config: Config, subject: str, moves: Sequence[Move], stamps: dict[int, float], stack: contextlib.ExitStack
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
    config: Config, loop: Loop, done: list[Done], workspace: Workspace, out: Path, rate: float, stamps: dict[int, float]
) -> dict[str, Any]:
    from hrcneuro.figures import robot as robot_figures
    from hrcneuro.figures import robot_cell
    from hrcneuro.io.tables import write_table
    from hrcneuro.robot.measure import measure_moves, timing, tip
    from hrcneuro.tables import robot as robot_tables

    telemetry = loop.record.telemetry()
    tool_tip = tip(telemetry, tool=workspace.cell.tool)
    figures = measure_moves(done, telemetry, tool_tip, workspace)
    table = robot_tables.moves(done, figures, rate=rate, stamps=stamps)
    latencies = {name: table[f"{name}_latency_ms"].to_numpy(float) for name in ("trigger", "marker", "stim")}
    spread = timing(telemetry, latencies, table["behind_log_ms"].to_numpy(float))
    write_table(robot_tables.telemetry(telemetry, tool_tip), out / "telemetry.parquet", robot_tables.TELEMETRY)
    write_table(table, out / "moves.parquet", robot_tables.MOVES)
    write_table(robot_tables.timing(spread), out / "timing.parquet", robot_tables.TIMING)
    write_table(robot_tables.reach(workspace), out / "reach.parquet", robot_tables.REACH)
    limit = robot_figures.LIMIT if config.backend == "sim" else robot_figures.LIMIT_SOCKETS
    robot_figures.robot(done, telemetry, tool_tip, table, workspace, out / "robot.png", limit=limit)
    robot_figures.timing(telemetry, table, spread, out / "timing.png")
    robot_cell.reach(workspace, out / "reach.png")
    return robot_tables.summary(telemetry, table, stops=loop.stops, lead=loop.lead)


def _loop(
    config: Config, workspace: Workspace, subject: str, on_onset: OnOnset | None, stack: contextlib.ExitStack
) -> Loop:
    from hrcneuro.robot.limits import Limits
    from hrcneuro.robot.loop import Loop
    from hrcneuro.robot.safety import Supervisor
    from hrcneuro.robot.tracking import ResolvedRate
    from hrcneuro.robot.trajectory import Bounds
    from hrcneuro.robot.workspace import DOWN

    arm, clock = _arm(config, workspace, subject, stack)
    tool = config.cell.tool
    return Loop(
        arm,
        clock,
        law=ResolvedRate(tool=tool, orientation=DOWN.tolist(), gain=config.gain, damping=config.damping),
        limits=Limits(acceleration=config.max_acceleration, box=workspace.box, tool=tool),
        supervisor=Supervisor(max_age=config.max_packet_age_s),
        stop=Bounds(velocity=4.0, acceleration=config.stop_deceleration, jerk=config.stop_jerk),
        on_onset=on_onset,
    )


def _arm(config: Config, workspace: Workspace, subject: str, stack: contextlib.ExitStack) -> tuple[Backend, Clock]:
    if config.backend == "sim":
        from hrcneuro.robot.sim import SimArm, VirtualClock

        virtual = VirtualClock()
        return SimArm(virtual, workspace.home().tolist()), virtual

    from hrcneuro.arms import connect
    from hrcneuro.arms.lock import held

    if sessions(config) is Sessions.ONE_A_COMMAND:
        stack.enter_context(held(config.backend, config.host, subject))
    arm, clock = connect(config.backend, host=config.host, driver=config.driver)
    stack.callback(clock.relax)
    return arm, clock


def _pace(config: Config) -> Pace:
    from hrcneuro.robot.session import Pace
    from hrcneuro.robot.trajectory import Bounds

    approach = Bounds(config.approach_speed, config.approach_acceleration, config.approach_jerk)
    homing = Bounds(config.homing_speed, config.homing_acceleration, config.homing_jerk)
    return Pace(
        approach=approach,
        homing=homing,
        pause=config.pause_s,
        longest_gap=config.longest_gap_s,
        in_radius=config.start_next == "in_radius",
    )


STAGE = Stage(
    name="robot",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "pyarrow", "ruckig", "matplotlib"),
    check=check,
    subject=Work(run, (Read("acquire", ("trials.parquet",)),)),
    sessions=sessions,
)
