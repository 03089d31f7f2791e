"""One session on an arm: what a person is told of it and when, and how what the arm did is kept.

Words come first, at the stop itself; files after them, and pictures are none of this module's. What an arm other than
``sim`` does is a recording from its first cycle on; the tables of the stage are made of it.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro import interrupts
from hrcneuro.answers.words import counted, roughly
from hrcneuro.arms.cures import AGAIN, with_cure
from hrcneuro.arms.machine import Machine
from hrcneuro.arms.words import Words
from hrcneuro.errors import HardwareError, HrcError, StageError, StageInterrupted
from hrcneuro.io.places import check_room
from hrcneuro.io.recordings import SessionRecording
from hrcneuro.io.tables import write_table
from hrcneuro.robot import measure
from hrcneuro.robot.backend import RATE, ArmError, Cause
from hrcneuro.robot.loop import Loop
from hrcneuro.robot.parameters import Pace
from hrcneuro.robot.plan import PlannedMove, expected_ends
from hrcneuro.robot.record import COLUMNS
from hrcneuro.robot.session import ExecutedMove
from hrcneuro.robot.workspace import Workspace
from hrcneuro.tables import robot as tables

# Bytes a cycle: 27 numbers and what frames them; the tables of it.
_STREAM_BYTES, _TABLE_BYTES = 260, 240

# Before the first move: the way home, and finding the lead. As it usually is, and with room to spare.
_BEFORE_S, _BEFORE_MOST_S = 20.0, 60.0
_NEWS_EVERY_S = 30.0
# What other work on this machine can bring about.
_OF_THE_MACHINE = (Cause.PACKETS_LOST, Cause.LATE, Cause.OFF_PATH)

_IF_IT_MOVES = "press the emergency stop if the arm moves on"
_ANEW = "the same command begins the session anew; robot.blocks and robot.episodes choose what is left of it"


@dataclass
class Driven:
    """A session that is driven: what is asked for, and what has come of it so far."""

    subject: str
    moves: Sequence[PlannedMove]  # grows where they are not known before
    workspace: Workspace
    rate: float  # of the recording whose stim channel takes the markers, Hz; nan where unknown
    folder: Path  # where recordings lie
    words: Words
    may_be_patient: bool = False  # the controller is the session's own, and late packets end the session
    stamps: dict[int, float] = field(default_factory=dict)  # of the markers on LSL's clock, by move
    executed: list[ExecutedMove] = field(default_factory=list)
    loop: Loop | None = None
    recording: SessionRecording | None = None
    machine: Machine | None = None  # where the session runs in real time
    anew: str = _ANEW  # how to go on after an early end
    again: str = AGAIN  # … and once the cause of a stop is mended
    problem: str = ""  # why the session was stopped …
    cure: str = ""  # … and what to do about it
    held_up: bool = False  # perhaps by other work of this machine
    _left: dict[int, float] = field(default_factory=dict)  # how long a session goes on after some of its moves, seconds

    def begin_recording(self, pace: Pace, *, about: Mapping[str, Any], copy: Path) -> None:
        """Make the folder of the recording, once it is sure that the session fits on the disks.

        Args:
            pace: How the session goes from move to move.
            about: What is asked for, JSON values.
            copy: Where the tables will be copied.

        Raises:
            ConfigError, StageError: There is no room, or it may not or cannot be written there.
        """
        ends = expected_ends(self.moves, self.workspace, pace)
        self._left, self.machine = _news(ends), Machine()
        size, what = self._check_room(ends[-1])
        check_room(copy, size, what=what, cure="free space: 'hrcneuro cache gc' drops unused entries")
        self.recording = self._new_recording(moves=len(self.moves), robot=about, reserve=size)

    def begin_open_recording(self, seconds: float, *, about: Mapping[str, Any]) -> None:
        """Make the folder of a recording whose moves are not known before.

        Args:
            seconds: How long the session lasts at most, about.
            about: What is asked for, JSON values.

        Raises:
            ConfigError, StageError: There is no room, or it may not or cannot be written there.
        """
        self.machine = Machine()
        size, _ = self._check_room(seconds)
        self.recording = self._new_recording(**about, reserve=size)

    def follow(self, loop: Loop) -> None:
        """Take down what ``loop`` does from now on."""
        self.loop = loop
        self.words.start()
        if self.recording is not None:
            self.recording.follow(COLUMNS, loop.record.rows)
            self.words.say(self._plan)

    def take(self, executed: ExecutedMove) -> None:
        """Take in a move that was executed, and say now and then how long the session goes on."""
        self.executed.append(executed)
        if left := self._left.get(executed.index):
            self.words.say(f"move {executed.index + 1} of {len(self.moves)}, about {roughly(left)} left")

    def fault(self) -> str:
        """Return why nothing more can be taken down; an empty text while it can."""
        return "" if self.recording is None else self.recording.fault

    def tell_stop(self, error: BaseException) -> None:
        """Say why the arm is stopped and what to do, and let nothing break the stop."""
        interrupts.hold()
        reason = with_cure(error, may_be_patient=self.may_be_patient, again=self.again)
        self.held_up = isinstance(error, ArmError) and error.cause in _OF_THE_MACHINE
        problem, cure = f"{type(error).__name__}: {error}", ""
        if isinstance(reason, HrcError):
            problem, cure = reason.problem, reason.cure
        elif isinstance(error, KeyboardInterrupt):
            problem = "interrupted"
        self.problem, self.cure = problem, cure
        self.words.say(
            f"{problem}; the arm is told to stop, until then it may be moving",
            cure="; ".join(filter(None, (_IF_IT_MOVES, cure))),
        )

    def tell_rest(self, seen: bool) -> None:
        """Say whether the arm was seen at rest; then what else this machine did, where that may be why."""
        self.words.say(
            "the arm is at rest" if seen else "the arm was not seen at rest, it may be moving: press the emergency stop"
        )
        if self.held_up and self.machine is not None:
            self.words.say(self.machine.words())

    def tell_patience(self) -> None:
        """Answer a second Ctrl-C."""
        self.words.say("what the arm did is being kept, which cannot be interrupted; then this ends by itself")

    def tell_end(self) -> str:
        """Say that the session was driven to its end, and where it is kept; return the same."""
        place = "" if self.recording is None else f"; its recording is in {self.recording.place}"
        text = f"the session was driven to its end{place}"
        if self.recording is not None:
            self.words.say(text)
        return text

    def ended(self, out: Path | None) -> dict[str, Any]:
        """Write the tables of a session driven to its end into its recording, copy them to ``out``; return the summary.

        Args:
            out: A folder; none, where there is a recording: no copy.

        Raises:
            StageError: They cannot be written; the recording is whole without them.
        """
        recording = self.recording
        if recording is None:
            assert out is not None
            return self._write(out)
        recording.end()
        try:
            summary = self._write(recording.place)
            recording.seal()
            if out is not None:
                for table in sorted(recording.place.glob("*.parquet")):
                    shutil.copyfile(table, out / table.name)
        except Exception as error:
            where = f"the session was driven to its end, and is in {recording.place}"
            raise _with_record(error, where, self.anew) from error
        return summary

    def stopped(self, reason: BaseException) -> BaseException:
        """Keep what a session did that ended early; return ``reason`` with where it is. One without motion leaves none.

        This never raises: what stopped the arm matters more.
        """
        if self.recording is not None:
            self.recording.end()
        if self.loop is None or not self.loop.record.telemetry().command.any():
            if self.recording is not None:
                self.recording.discard()
            return reason
        place = self._parent
        try:
            if self.recording is None:
                self.recording = self._new_recording(moves=len(self.moves))
            place = self.recording.place
            self._write(place)
            self.recording.seal()
            kept = f"the record is in {place}"
        except Exception as flaw:
            why = flaw.problem if isinstance(flaw, HrcError) else str(flaw)
            kept = f"the record in {place} is not whole ({type(flaw).__name__}: {why})"
        interrupts.hold(kept)
        self.words.say(kept)
        return _with_record(reason, f"{kept}; it ended {self._reached()}", self.anew)

    def _check_room(self, seconds: float) -> tuple[int, str]:
        """Return how many bytes a session's tables may take, and what it is called, once there is room for it."""
        what, cycles = f"a session of about {roughly(seconds + _BEFORE_S)}", round((seconds + _BEFORE_MOST_S) * RATE)
        size = cycles * _TABLE_BYTES
        cure = "free space, or choose another place for recordings: robot.rescue_folder"
        check_room(self._parent, size + cycles * _STREAM_BYTES, what=what, cure=cure)
        return size, what

    @property
    def _plan(self) -> str:
        if not self._left:
            return f"what the arm does is kept in {self._parent}"
        left = roughly(self._left[-1])
        return f"{counted(len(self.moves), 'move')}, about {left} until the end; Ctrl-C stops the arm"

    @property
    def _parent(self) -> Path:
        return self.folder / self.subject

    def _new_recording(self, *, reserve: int = 0, **about: Any) -> SessionRecording:
        about = {"subject": self.subject, **about}
        return SessionRecording(self._parent, about, reserve=reserve)

    def _reached(self) -> str:
        assert self.loop is not None
        last = int(self.loop.record.telemetry().move.max())
        if last < 0:
            return "before the first move"
        move = self.moves[last]
        practice = "practice " if move.practice else ""
        return f"in {practice}block {move.block}, episode {move.episode}, trial {move.trial}"

    def _write(self, out: Path) -> dict[str, Any]:
        assert self.loop is not None
        telemetry = self.loop.record.telemetry()
        tip = measure.tip(telemetry, tool=self.workspace.cell.tool)
        measures = measure.measure_moves(self.executed, telemetry, tip, self.workspace)
        measures |= measure.marker_timing(self.executed, rate=self.rate)
        moves = tables.moves(self.executed, measures, self.stamps)
        latencies = {name: measures[f"{name}_latency_ms"] for name in ("trigger", "marker", "stim")}
        timing = measure.timing(telemetry, latencies, measures["behind_log_ms"])
        columns = tables.telemetry(telemetry, tip, measure.commanded_angles(telemetry))
        write_table(columns, out / "telemetry.parquet", tables.TELEMETRY)
        write_table(moves, out / "moves.parquet", tables.MOVES)
        write_table(tables.timing(timing), out / "timing.parquet", tables.TIMING)
        write_table(tables.reach(self.workspace), out / "reach.parquet", tables.REACH)
        summary = measure.summarise(telemetry, moves, stops=self.loop.stops, lead=self.loop.lead or 0.0)
        late, oldest = self.loop.late_packets
        return summary | ({"late_packets": late, "oldest_packet_ms": round(1e3 * oldest, 3)} if late else {})


def _news(ends: Sequence[float]) -> dict[int, float]:
    """Return after which moves it is said how long the session goes on, and how long; -1 stands for its start."""
    left, last = {-1: ends[-1] + _BEFORE_S}, -_BEFORE_S
    step = max(_NEWS_EVERY_S, ends[-1] / 10)
    for index, end in enumerate(ends[:-1]):
        if end - last >= step:
            left[index], last = ends[-1] - end, end
    return left


def _with_record(error: BaseException, record: str, anew: str) -> BaseException:
    """Return the error with where the record is, and how to go on."""
    if isinstance(error, KeyboardInterrupt):
        return StageInterrupted(f"interrupted; {record}", cure=anew)
    if isinstance(error, HrcError):
        kind = HardwareError if isinstance(error, HardwareError) else StageError
        return kind(f"{error.problem}; {record}", cure=f"{error.cure}; {anew}" if error.cure else anew)
    if isinstance(error, Exception):
        return StageError(f"{type(error).__name__}: {error}; {record}", cure=anew)
    return error
