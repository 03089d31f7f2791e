"""What an experiment kept beside its log, line by line: ``experiment.jsonl``. It tells what the CSV files cannot.

Each line is a JSON object with its ``kind``. The files in the authors' words follow from it; where the experiment was
cut short, it tells that from a log which somebody else has cut.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.errors import DataError

FILE = "experiment.jsonl"
SESSION, BLOCK, EPISODE, ONSET, MOVE = "session", "block", "episode", "onset", "move"
KEY, NOTE, BLOCK_END, END, CHOICE = "key", "note", "block_end", "end", "choice"

CURE = "hrcneuro experiment SUBJECT --resume mends the log from experiment.jsonl, and keeps what it takes away"

Entry = dict[str, Any]
Episode = tuple[str, int]  # the block in the authors' words, and the episode's number
Onset = tuple[bool, int, int, int]  # practice, block, episode, trial


@dataclass(frozen=True)
class Kept:
    """What an experiment kept of a session.

    Attributes:
        moves: Episode -> how many moves it has.
        ends: Episode -> rows and columns of its path's start and goal.
        arrived: Episodes that came to their goal.
        directions: Block of iC, in the authors' words -> the human's two directions.
        onsets: Whose motion has begun, in order: a move that was made again twice, one that never ended, too.
    """

    moves: Mapping[Episode, int] = field(default_factory=dict)
    ends: Mapping[Episode, tuple[int, int, int, int]] = field(default_factory=dict)
    arrived: frozenset[Episode] = frozenset()
    directions: Mapping[str, frozenset[str]] = field(default_factory=dict)
    onsets: tuple[Onset, ...] = ()

    def broken_off(self, episode: Episode, moves: int) -> bool:
        """Return whether an episode that has so many moves in the log may end elsewhere than on its goal.

        The log of an experiment that was killed may lack the last move, which is kept here already.
        """
        return episode in self.moves and (episode not in self.arrived or moves == self.moves[episode] - 1)


def notes_of(log: Path) -> list[str]:
    """Return what a person should know of a log: episodes that were broken off.

    Raises:
        DataError: What an experiment kept beside the log is damaged.
    """
    kept = beside(log)
    return [
        f"{block}, episode {number} was broken off after {moves} move{'s' * (moves != 1)}"
        for (block, number), moves in (kept.moves.items() if kept else ())
        if kept and (block, number) not in kept.arrived
    ]


def onsets_of(log: Path) -> tuple[Onset, ...]:
    """Return whose motion has begun, in order, as an experiment kept it beside its log; nothing where none wrote it.

    Raises:
        DataError: As :func:`beside`.
    """
    kept = beside(log)
    return kept.onsets if kept else ()


def beside(log: Path) -> Kept | None:
    """Return what an experiment kept beside a log; None where no experiment wrote it.

    Raises:
        DataError: A line of it is damaged, and it is not the last one, or it is of something else.
    """
    path = log.with_name(FILE)
    if not path.is_file():
        return None
    try:
        return _kept(read(path)[0])
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise DataError(
            f"{path} is not what an experiment writes: {type(error).__name__}: {error}",
            cure="restore it from a copy; beside the log of no experiment, put it aside",
        ) from error


def _kept(entries: list[Entry]) -> Kept:
    moves: dict[Episode, int] = {}
    ends: dict[Episode, tuple[int, int, int, int]] = {}
    arrived: set[Episode] = set()
    directions: dict[str, frozenset[str]] = {}
    onsets: list[Onset] = []
    told = any(entry["kind"] == ONSET for entry in entries)
    for entry in entries:
        if entry["kind"] == MOVE:
            episode = name_of(entry), int(entry["episode"])
            moves[episode] = moves.get(episode, 0) + 1
            if entry["last"]:
                arrived.add(episode)
            if not told and entry.get("executed"):
                # An older log: only what has ended is known, and whether it was made again.
                onsets += [_onset(entry)] * (1 + bool(entry.get("again")))
        elif entry["kind"] == ONSET:
            onsets.append(_onset(entry))
        elif entry["kind"] == EPISODE:
            start, goal = entry["path"][0], entry["path"][-1]
            ends[name_of(entry), int(entry["episode"])] = (start[0], start[1], goal[0], goal[1])
        elif entry["kind"] == BLOCK and entry["human_directions"]:
            directions[name_of(entry)] = frozenset(entry["human_directions"])
    return Kept(moves, ends, frozenset(arrived), directions, tuple(onsets))


def _onset(entry: Mapping[str, Any]) -> Onset:
    return bool(entry["practice"]), int(entry["block"]), int(entry["episode"]), int(entry["trial"])


def name_of(entry: Mapping[str, Any]) -> str:
    """Return the block of a line in the authors' words."""
    from hrcneuro.sources.authors_log import block_name

    return block_name(entry["practice"], entry["block"])


def read(path: Path) -> tuple[list[Entry], int]:
    """Return the lines, and how many bytes they are; what stands behind them is torn: an unfinished last line.

    Raises:
        DataError: A line is damaged, and it is not the last one.
    """
    content = path.read_bytes()
    entries: list[Entry] = []
    whole = 0
    for number, line in enumerate(_lines(content), start=1):
        entry = _parsed(line)
        if entry is None:
            rest = content[whole + len(line) :]
            if any(_parsed(other) is not None for other in _lines(rest)):
                raise DataError(
                    f"{path.name}, line {number} is damaged: {line[:60]!r}; each line is a JSON object with its kind",
                    cure="restore the file from a copy",
                )
            break
        entries.append(entry)
        whole += len(line)
    return entries, whole


def _lines(content: bytes) -> Iterator[bytes]:
    return iter(content.splitlines(keepends=True))


def _parsed(line: bytes) -> Entry | None:
    """Return the object of a whole line; None where it is none."""
    if not line.endswith(b"\n"):
        return None
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    return entry if isinstance(entry, dict) and "kind" in entry else None
