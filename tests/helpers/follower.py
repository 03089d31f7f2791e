"""A person who knows the rules and follows the log of a running experiment, to press the right key from outside."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hrcneuro.paradigm.grid import toward
from hrcneuro.paradigm.owners import Areas, Directions, Owners, actor_of, allowed


class Follower:
    """Reads ``experiment.jsonl`` as it grows.

    Attributes:
        over: The session has ended.
        waits: What is shown are words, which an arrow key takes away.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._at, self._rest = path, 0, b""
        self._owners: Owners = Areas(frozenset())
        self._path_tiles: list[tuple[int, int]] = []
        self._tile, self._pending = (0, 0), 1
        self.over, self.waits, self.moves = False, True, 0

    def follow(self) -> bool:
        """Take in what was written; return whether something was."""
        if not self._path.is_file():
            return False
        with self._path.open("rb") as file:
            file.seek(self._at)
            more = file.read()
        self._at += len(more)
        *lines, self._rest = (self._rest + more).split(b"\n")
        for line in lines:
            entry = json.loads(line)
            act: Callable[[dict[str, Any]], None] | None = getattr(self, f"_{entry['kind'].replace(' ', '_')}", None)
            if act:
                act(entry)
        return bool(lines)

    @property
    def key(self) -> str:
        """The person's key that leads on along the path; empty in the robot's turn."""
        if self.waits or self._pending >= len(self._path_tiles):
            return ""
        target = toward(self._tile, self._path_tiles[self._pending])
        if actor_of(self._owners, self._tile, target) != "human":
            return ""
        return min(allowed(self._owners, "human").intersection(target))

    def _block(self, entry: dict[str, Any]) -> None:
        tiles = frozenset(tuple(tile) for tile in entry["human_tiles"])
        self._owners = Areas(tiles) if tiles else Directions(frozenset(entry["human_directions"]))

    def _episode(self, entry: dict[str, Any]) -> None:
        self._path_tiles = [tuple(tile) for tile in entry["path"]]
        self._tile, self._pending, self.waits = self._path_tiles[0], 1, False

    def _move(self, entry: dict[str, Any]) -> None:
        self.moves += 1
        self._tile = (entry["row"], entry["col"])
        if self._pending < len(self._path_tiles):
            self._pending += self._tile == self._path_tiles[self._pending]

    def _block_end(self, entry: dict[str, Any]) -> None:
        self.waits = True

    def _end(self, entry: dict[str, Any]) -> None:
        self.over = True
