"""The log of an experiment, written as it goes: in the authors' words, as the trial table, and all that happened.

``recordings/SUBJECT/`` holds the authors' pair ``subjectNN.csv`` and ``metadataNN.csv``, ``trials.parquet``, and
``experiment.jsonl``, from which the others follow. After each finished move all but the trial table are whole.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from hrcneuro.errors import StageError
from hrcneuro.experiment.disk import Growing, Waiter, replaced, sync_path
from hrcneuro.experiment.entries import entry_of, line_of
from hrcneuro.experiment.places import TABLE
from hrcneuro.experiment.progress import Progress
from hrcneuro.experiment.rows import Episode, Row, trial_table
from hrcneuro.paradigm.grid import Tile
from hrcneuro.paradigm.owners import Areas, Owners
from hrcneuro.paradigm.partners import Move
from hrcneuro.paradigm.session import Block
from hrcneuro.sources import authors_log, experiments
from hrcneuro.sources.layout import log_names

SIMULATED = "SYNTHETIC: the moves were simulated by hrcneuro; nobody pressed a key."
"""What stands in the metadata's column of the origin where a simulated human played, so that it stays known."""


class Log:
    """The log of a session as it grows; :mod:`hrcneuro.experiment.opening` begins one, or goes on with it.

    Whatever cannot be written is kept and written with the next: each method that writes raises StageError until there
    is room, and nothing is lost if the session pauses and goes on.

    Attributes:
        place: Its folder.
        progress: How far the session had come when this part of it began.
        counters: What was counted so far, over all parts.
    """

    def __init__(
        self, place: Path, subject: str, lock: int, progress: Progress, *, simulated: bool, real_time: bool,
        now: Callable[[], float], origin_s: float,
    ) -> None:  # fmt: skip
        """Go on with files that are whole; whoever opens the log sees to that.

        Args:
            place: Their folder.
            subject: Whose session.
            lock: Descriptor of the folder's lock, which ends with the log.
            progress: How far the session has come.
            simulated: The human is simulated.
            real_time: A thread waits for the disk. Otherwise :meth:`flush_table` does, and nobody else.
            now: The clock of all times, seconds.
            origin_s: When the session began, seconds of that clock.
        """
        names = log_names(subject)
        self.place, self.progress, self.counters = place, progress, progress.counters
        self._subject, self._now, self._origin_s = subject, now, origin_s
        self._lock: int | None = lock
        self._rows = progress.rows
        self._mark = SIMULATED if simulated else ""
        self._block: Block | None = None
        self._episode: Episode | None = None
        self._metadata = place / names["metadata"]
        self._lines = [episode.line(self._mark) for episode in progress.episodes]
        self._stale = False  # the metadata
        self._journal = Growing(place / experiments.FILE, new=False)
        self._log = Growing(place / names["log"], new=False)
        self._waiter = Waiter(thread=real_time)
        self._real_time = real_time

    def begin_part(self, wall: datetime, session_s: float, fields: Mapping[str, Any]) -> None:
        """Write that the session goes on, at this time of day and of the session, and what was mended for it."""
        self._journal.add(line_of(entry_of(experiments.SESSION, session_s, wall, fields)))
        self._commit()
        self.flush_table()

    def block(self, block: Block, owners: Owners, when: float | None = None) -> None:
        """Write that a block begins, with who owns what in it."""
        areas = isinstance(owners, Areas)
        self._close_episode()
        self._block = block
        self._tell(
            experiments.BLOCK, when, scenario=block.scenario, practice=block.practice, block=block.number,
            episodes=block.episodes, human_tiles=sorted(owners.human) if isinstance(owners, Areas) else [],
            human_colour=owners.human_colour if isinstance(owners, Areas) else "",
            human_directions=[] if areas else sorted(owners.human),
        )  # fmt: skip
        self._commit()

    def episode(self, number: int, path: Sequence[Tile], when: float | None = None) -> None:
        """Write that an episode of the block begins, with its path from start to goal."""
        block = self._begun()
        self._close_episode()
        self._episode = Episode(block.practice, block.number, number, tuple(path))
        self._tell(
            experiments.EPISODE, when, practice=block.practice, block=block.number, episode=number, path=list(path)
        )
        self._stale = True
        self._commit()

    def onset(self, trial: int, when: float) -> None:
        """Write that the motion of a move of the episode has begun, whatever comes of it; its trigger has gone out."""
        block, episode = self._begun(), self._episode
        if episode is None:
            raise ValueError("a motion belongs to an episode: none was begun")
        self._tell(
            experiments.ONSET, when, practice=block.practice, block=block.number, episode=episode.episode, trial=trial
        )
        self._commit()

    def move(self, move: Move, *, onset: float, t_f: float, ended: float, radius: float = math.nan, **more: Any) -> Row:
        """Write a finished move, and return its row.

        Args:
            move: What happened.
            onset, ended: When it began and ended, seconds of the clock of all times.
            t_f: How long it was to take, seconds.
            radius: When the tool came within its radius, so that keys counted, seconds of that clock; NaN: unknown.
            more: JSON values that are worth knowing of it.
        """
        block, episode = self._begun(), self._episode
        if episode is None:
            raise ValueError("a move belongs to an episode: none was begun")
        row = Row(
            **vars(move), scenario=block.scenario, practice=block.practice, block=block.number,
            episode=episode.episode, onset_s=round(onset - self._origin_s, 6), t_f_s=round(t_f, 6),
        )  # fmt: skip
        self._rows.append(row)
        episode.take(row)
        if not math.isnan(radius):
            more["radius_s"] = round(radius - self._origin_s, 6)
        self._tell(experiments.MOVE, ended, **vars(row), last=episode.arrived, **more)
        self._log.add(authors_log.log_line(row))
        if episode.arrived and episode.episode == block.episodes:
            self._tell(
                experiments.BLOCK_END, ended, practice=block.practice, block=block.number, counted=vars(self.counters)
            )
        self._stale = True
        self._commit()
        return row

    def key(self, name: str, when: float, *, accepted: bool, why: str = "") -> None:
        """Write that a key went down, and why it was ignored if it was."""
        self._tell(experiments.KEY, when, name=name, accepted=accepted, why=why)
        self._commit()

    def note(self, text: str, when: float | None = None) -> None:
        """Write a remark of the experimenter."""
        self._tell(experiments.NOTE, when, text=text)
        self._commit()

    def event(self, kind: str, when: float | None = None, **fields: Any) -> None:
        """Write anything else that happened: a pause, a fault."""
        self._tell(kind, when, **fields)
        self._commit()

    def flush_table(self) -> None:
        """Let ``trials.parquet`` appear anew with all finished moves; in real time a thread does that soon."""
        rows = list(self._rows)
        if rows:
            self._attempt(lambda: self._waiter.do("table", lambda: self._write_table(rows)))
        if not self._real_time:
            self._attempt(self._sync)

    def catch_up(self) -> None:
        """Write what could not be written before.

        Raises:
            StageError: Nor can it now.
        """
        self._commit()

    def close(self, *, complete: bool = False, why: str = "") -> None:
        """Write how the session ended, and let go of the files; what was closed stays so.

        Args:
            complete: It came to its end, so that it cannot be resumed.
            why: It ended early.

        Raises:
            StageError: The disk has no room; the lines that ``experiment.jsonl`` lacks are told.
        """
        if self._lock is None:
            return
        self._close_episode()
        self._tell(experiments.END, None, complete=complete, why=why, counted=vars(self.counters))
        try:
            try:
                self._commit()
                self.flush_table()
            finally:
                self._waiter.end()
                self._attempt(self._sync)
            self._raise_fault()
        except StageError as error:
            raise self._with_missing(error) from error
        finally:
            self._journal.close()
            self._log.close()
            os.close(self._lock)
            self._lock = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close(why=kind.__name__ if kind else "")

    def _begun(self) -> Block:
        if self._block is None:
            raise ValueError("an episode belongs to a block: none was begun")
        return self._block

    def _tell(self, kind: str, when: float | None, **fields: Any) -> None:
        now = self._now()
        when = now if when is None else when
        entry = entry_of(kind, when - self._origin_s, datetime.now(UTC) - timedelta(seconds=now - when), fields)
        self.counters.take(entry)
        self._journal.add(line_of(entry))

    def _close_episode(self) -> None:
        """Keep the metadata's line of the episode; one that nobody has played gets none."""
        if self._episode is not None and self._episode.rows:
            self._lines.append(self._episode.line(self._mark))
        self._stale = self._stale or self._episode is not None
        self._episode = None

    def _commit(self) -> None:
        """Write what was told, in an order in which whatever is missing follows from what was written before.

        Raises:
            StageError: The disk has no room, or is broken.
        """
        self._attempt(self._write)
        self._raise_fault()
        if self._real_time:
            self._waiter.do("sync", self._sync)

    def _write(self) -> None:
        self._journal.write()
        self._log.write()
        if self._stale:
            running = [self._episode.line(self._mark)] if self._episode is not None else []
            text = "".join([authors_log.metadata_head(origin=self._mark), *self._lines, *running])
            replaced(self._metadata, lambda part: part.write_text(text, encoding="utf-8", newline=""), sync=False)
            self._stale = False

    def _write_table(self, rows: list[Row]) -> None:
        from hrcneuro.io.tables import write_table
        from hrcneuro.tables.trials import TRIALS

        table = trial_table(rows, self._subject)
        replaced(self.place / TABLE, lambda part: write_table(table, part, TRIALS), sync=self._real_time)

    def _sync(self) -> None:
        self._journal.sync()
        self._log.sync()
        sync_path(self._metadata)
        sync_path(self.place)

    def _raise_fault(self) -> None:
        """Raise what went wrong in the thread since this was last asked."""
        fault = self._waiter.take_fault()
        if isinstance(fault, OSError):
            raise self._explained(fault) from fault
        if fault is not None:
            raise fault

    def _attempt(self, write: Callable[[], object]) -> None:
        try:
            write()
        except OSError as error:
            raise self._explained(error) from error

    def _with_missing(self, error: StageError) -> StageError:
        """Add the lines that the disk had no room for: they are nowhere else."""
        missing = self._journal.missing
        if not missing:
            return error
        return StageError(
            f"{error.problem}; these lines are missing at the end of {self._journal.path}:\n{missing.rstrip()}",
            cure="once there is room, put them there, in the place of the last line where that has no end; then go on "
            "with --resume",
        )

    def _explained(self, error: OSError) -> StageError:
        return StageError(
            f"the log of {self._subject} cannot be written in {self.place}: {error.strerror or error}; "
            "all that was written before is kept",
            cure="free space there, then go on: what is missing is written with the next; or end, and --resume later",
        )
