"""The pictures beside the page: where people look for them, as PNG and PDF."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

from hrcneuro import drawings
from hrcneuro.contract import OF_ALL
from hrcneuro.report.results import Figure


def collect(figures: Iterable[Figure], folder: Path) -> None:
    """Copy pictures into the folder, a subject's into one of its own, and remove those that are none of them.

    A stage's picture is called by stage and file, one that joins stages by its file alone.
    """
    wanted = set()
    for figure in figures:
        for source in (figure.path, figure.path.with_suffix(".pdf")):
            target = _place(figure, folder) / _name(figure, source)
            wanted.add(target)
            if target.is_file() and target.stat().st_mtime_ns == source.stat().st_mtime_ns:
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)
    for stale in {p for p in folder.rglob("*") if p.suffix in (".png", ".pdf")} - wanted:
        stale.unlink()


def _place(figure: Figure, folder: Path) -> Path:
    return folder if figure.unit in OF_ALL else folder / figure.unit


def _name(figure: Figure, source: Path) -> str:
    return source.name if figure.stage in drawings.JOINT else f"{figure.stage}_{source.name}"
