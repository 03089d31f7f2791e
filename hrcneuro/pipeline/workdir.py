"""A study's working folder: its cache, and ``results/<unit>/<stage>.json`` that point at the current entries."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hrcneuro.cache.store import Record, Store, guarded, read_record
from hrcneuro.contract import GROUP
from hrcneuro.errors import DataError

# Of the name under which pictures are kept: those of the stage erp lie under erp.figures.
FIGURES = ".figures"


class Workdir:
    """``<folder>/cache`` (or ``$HRCNEURO_CACHE``) and ``<folder>/results``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.absolute()
        self.results = self.folder / "results"
        self.cache = Store(Path(os.environ.get("HRCNEURO_CACHE") or self.folder / "cache").absolute())

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
            if path.read_text(encoding="utf-8") == text:
                return
        except (OSError, UnicodeDecodeError):
            pass
        with guarded(self.results):
            path.parent.mkdir(parents=True, exist_ok=True)
            part = path.with_name(f".{path.name}.{os.getpid()}")
            part.write_text(text, encoding="utf-8")
            part.replace(path)

    def pointer(self, stage: str, unit: str) -> str:
        """Return the key that the pointer names, or an empty string."""
        key = self._read(stage, unit).get("key")
        return key if isinstance(key, str) and key.isalnum() else ""

    def last(self, stage: str, unit: str) -> Mapping[str, Any] | None:
        """Return the parts of the key that the pointer names, or None where the unit never ran."""
        parts = self._read(stage, unit).get("parts")
        return parts if isinstance(parts, dict) and all(isinstance(p, dict | str) for p in parts.values()) else None

    def keys(self) -> set[tuple[str, str, str]]:
        """Return (stage, unit, key) of every pointer."""
        entries = set()
        for path in sorted(self.results.glob("*/*.json")):
            key = self.pointer(path.stem, path.parent.name)
            if key:
                entries.add((path.stem, path.parent.name, key))
        return entries

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
        return folder / name

    def _entry(self, stage: str, unit: str) -> tuple[Path, list[str]]:
        """Return the folder of the entry that the pointer names, and the names of its files."""
        key = self.pointer(stage, unit)
        cure = f"hrcneuro {stage.removesuffix(FIGURES)}{'' if unit == GROUP else f' {unit}'}"
        if not key:
            raise DataError(f"{stage} of {unit} has not run in {self.folder}", cure=cure)
        folder = self.cache.folder(stage, unit, key)
        record = read_record(folder)
        if record is None:
            raise DataError(f"the entry of {stage} of {unit} is gone from the cache", cure=cure)
        return folder, list(record.outputs)

    def _pointer_path(self, stage: str, unit: str) -> Path:
        return self.results / unit / f"{stage}.json"

    def _read(self, stage: str, unit: str) -> dict[str, Any]:
        # A pointer only says what was current: one that cannot be read is as good as none.
        try:
            content = json.loads(self._pointer_path(stage, unit).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return content if isinstance(content, dict) else {}
