"""A study's working folder: its cache, and ``results/<unit>/<stage>.json`` that point at the current entries."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hrcneuro.cache.disk import guarded, read_file, read_json
from hrcneuro.cache.locks import PATIENCE_S
from hrcneuro.cache.placed import PlacedStudy, read_id
from hrcneuro.cache.record import Entry, Record, dropped, is_key, read_record
from hrcneuro.cache.store import Store
from hrcneuro.cache.studies import Studies
from hrcneuro.contract import ASKED_BY
from hrcneuro.errors import ConfigError, DataError

# Of the name under which pictures are kept: those of the stage erp lie under erp.figures.
FIGURES = ".figures"


class Workdir:
    """``<folder>/cache`` (or ``$HRCNEURO_CACHE``) and ``<folder>/results``."""

    def __init__(self, folder: Path, cache: Path | None = None) -> None:
        self.folder = folder.absolute()
        self.results = self.folder / "results"
        given = cache or os.environ.get("HRCNEURO_CACHE")
        self.cache = Store((Path(given).expanduser() if given else self.folder / "cache").absolute())
        self.studies = Studies(self.cache.root)

    def study(self) -> PlacedStudy:
        """Return the study of this folder; it is given an id where it has none.

        Raises:
            OSError: The folder cannot be read.
        """
        return PlacedStudy.at(Path(os.path.realpath(self.folder)), self.results)

    def of(self, other: PlacedStudy) -> Workdir:
        """Return the working folder of another study that uses this cache."""
        return Workdir(Path(other.folder), self.cache.root)

    @property
    def is_study(self) -> bool:
        """Whether a study has run here."""
        return bool(read_id(self.results) or self.keys())

    def point(self, record: Record) -> None:
        """Let the results pointer of a unit name this record."""
        path = self._pointer_path(record.stage, record.unit)
        text = json.dumps(
            {
                "stage": record.stage,
                "unit": record.unit,
                "key": record.key,
                "files": sorted(record.outputs),
                "parts": record.parts,
            },
            indent=1,
            sort_keys=True,
        )
        try:
            if read_file(path) == text.encode():
                return
        except OSError:
            pass
        with guarded(self.results):
            path.parent.mkdir(parents=True, exist_ok=True)
            part = path.with_name(f".{path.name}.{os.getpid()}")
            part.write_text(text, encoding="utf-8")
            part.replace(path)

    def pointer(self, stage: str, unit: str) -> str:
        """Return the key that the pointer names, or an empty string."""
        return _key(self._read(stage, unit))

    def last(self, stage: str, unit: str) -> Mapping[str, Any] | None:
        """Return the parts of the key that the pointer names, or None where the unit never ran."""
        parts = self._read(stage, unit).get("parts")
        return parts if isinstance(parts, dict) and all(isinstance(p, dict | str) for p in parts.values()) else None

    def keys(self) -> set[Entry]:
        """Return (stage, unit, key) of every pointer; of one that cannot be understood, all that it may point at.

        Raises:
            DataError: One cannot be read: what it points at must not pass for unused.
        """
        return {entry for entries in self._pointers().values() for entry in entries}

    def unclear(self) -> dict[Path, set[Entry]]:
        """Return the pointers that cannot be understood, each with the entries that it may point at.

        Raises:
            DataError: One cannot be read.
        """
        return {path: entries for path, entries in self._pointers().items() if entries and not _key(_parsed(path))}

    def _pointers(self) -> dict[Path, set[Entry]]:
        # Not by glob, which takes a folder that may not be read for an empty one.
        found: dict[Path, set[Entry]] = {}
        try:
            if os.path.lexists(self.results):
                # A link that leads nowhere, as to a disk that is not there now, is not the same as no results.
                os.scandir(self.results).close()
            for path in (p for unit in _listed(self.results) for p in _listed(unit) if p.suffix == ".json"):
                stage, unit_name = path.stem, path.parent.name
                with contextlib.suppress(FileNotFoundError, IsADirectoryError):
                    key = _key(_parsed(path))
                    found[path] = {(stage, unit_name, key)} if key else self.cache.entries_of(stage, unit_name)
        except OSError as error:
            raise DataError(
                f"{error.filename or self.results} cannot be read: {error.strerror}",
                cure="give yourself the right to read all results; what they point at is not known without",
            ) from error
        return found

    def artifact(self, stage: str, unit: str, name: str = "") -> Path:
        """Return where a unit's entry, or one file or picture of it, lies.

        Raises:
            DataError: The unit has not run, its entry is gone, or it has no such file.
        """
        if not self.pointer(stage, unit) and self.pointer(stage + FIGURES, unit):
            # Pictures that join stages are of none.
            stage += FIGURES
        folder, names = self._entry(stage, unit)
        if not name:
            return folder
        if name not in names and not stage.endswith(FIGURES) and self.pointer(stage + FIGURES, unit):
            pictures, drawn = self._entry(stage + FIGURES, unit)
            if name in drawn:
                return pictures / name
            names = [*names, *drawn]
        if name not in names:
            raise DataError(f"{stage} of {unit} has no file {name!r}", cure=f"name one of: {', '.join(sorted(names))}")
        refuse_dropped(folder, stage, unit, name)
        return folder / name

    def summary(self, stage: str, unit: str) -> Mapping[str, Any]:
        """Return what a unit's stage said of its result in a few numbers when it last ran.

        Raises:
            DataError: The unit has not run, or its entry is gone.
        """
        return self.record(stage, unit).summary

    def record(self, stage: str, unit: str) -> Record:
        """Return the record of the entry that the pointer names.

        Raises:
            DataError: The unit has not run, or its entry is gone.
        """
        return self._record(stage, unit)[1]

    def _entry(self, stage: str, unit: str) -> tuple[Path, list[str]]:
        """Return the folder of the entry that the pointer names, and the names of its files."""
        folder, record = self._record(stage, unit)
        return folder, list(record.outputs)

    def _record(self, stage: str, unit: str) -> tuple[Path, Record]:
        """Return the folder and the record of the entry that the pointer names."""
        key = self.pointer(stage, unit)
        what = ASKED_BY.get(unit, f" {unit}")
        cure = f"hrcneuro {stage.removesuffix(FIGURES)}{what}"
        if not key:
            raise DataError(f"{stage} of {unit} has not run in {self.folder}", cure=cure)
        folder = self.cache.folder(stage, unit, key)
        record = read_record(folder)
        if record is None:
            raise DataError(f"the entry of {stage} of {unit} is gone from the cache", cure=cure)
        return folder, record

    def _pointer_path(self, stage: str, unit: str) -> Path:
        return self.results / unit / f"{stage}.json"

    def _read(self, stage: str, unit: str) -> dict[str, Any]:
        # A pointer only says what was current: for a run, one that cannot be read is as good as none.
        try:
            return _parsed(self._pointer_path(stage, unit))
        except OSError:
            return {}


def refuse_dropped(folder: Path, stage: str, unit: str, name: str) -> None:
    """Refuse a file of an entry that was dropped to save disk.

    Raises:
        DataError: It was.
    """
    if name in dropped(folder):
        own = ASKED_BY.get(unit, f" {unit}")
        raise DataError(
            f"{name} of {stage} of {unit} was dropped to save disk", cure=f"hrcneuro {stage}{own} makes it again"
        )


def _parsed(path: Path) -> dict[str, Any]:
    """Return what a pointer says; nothing where it cannot be understood.

    Raises:
        OSError: It cannot be read.
    """
    try:
        content = read_json(path)
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _key(content: Mapping[str, Any]) -> str:
    """Return the key that a pointer names; an empty string where it names none."""
    key = content.get("key")
    return key if isinstance(key, str) and is_key(key) else ""


def _listed(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())
    except (FileNotFoundError, NotADirectoryError):
        return []


def lock_patience_s() -> float:
    """Return how long a lock's holder on another machine may give no sign of life: ``HRCNEURO_LOCK_WAIT``, seconds.

    Raises:
        ConfigError: It is no such number.
    """
    given = os.environ.get("HRCNEURO_LOCK_WAIT") or str(PATIENCE_S)
    try:
        seconds = float(given)
    except ValueError:
        seconds = -1.0
    if not 0.0 <= seconds < float("inf"):
        raise ConfigError(f"HRCNEURO_LOCK_WAIT is {given!r}", cure="give a number of seconds, such as 12, or unset it")
    return seconds
