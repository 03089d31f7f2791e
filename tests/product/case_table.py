"""The table of a folder of cases: each script's lines, what should happen, whether it did."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[2]
Row = tuple[str, str, bool, str]  # variant, what should happen, whether it did, what did
Judge = Callable[[Path, Path], list[Row]]  # the script, a folder of its own -> the rows


def environment() -> dict[str, str]:
    """Return what the product runs in."""
    return {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200", "OMP_NUM_THREADS": "1"}


def table(folder: str, pattern: str, judges: Mapping[str, Judge], only: tuple[str, ...], *, workers: int = 1) -> int:
    """Run the scripts of a folder and print a line for everything that is judged; return the exit code."""
    scripts = sorted(Path(folder).resolve().glob(pattern))
    scripts = [s for s in scripts if not only or number(s) in only]
    if not scripts:
        print(f"no cases in {folder}: nothing to do")
        return 0
    count = failed = 0
    with tempfile.TemporaryDirectory(prefix="hrcneuro-cases-") as base, ThreadPoolExecutor(workers) as pool:
        for script, rows in zip(scripts, pool.map(lambda s: _rows(s, judges, Path(base)), scripts), strict=True):
            for variant, wanted, right, got in rows:
                text = " ".join(got.split())[:150]
                print(
                    f"{number(script)}  {variant:<40.40} {'ok  ' if right else 'FAIL'}  {wanted:<34} {text}", flush=True
                )
                count, failed = count + 1, failed + (not right)
    print(f"{count} lines of {len(scripts)} cases, {failed} failed")
    return 1 if failed else 0


def number(script: Path) -> str:
    """Return what a script's name begins with."""
    return script.name.partition("_")[0]


def sections(text: str, start: str) -> Iterator[tuple[str, str]]:
    """Yield heading and text of each part of what a script printed; a heading's line begins with ``start``."""
    for part in f"\n{text}".split(f"\n{start}")[1:]:
        heading, _, rest = part.partition("\n")
        yield heading.strip(), rest


def _rows(script: Path, judges: Mapping[str, Judge], base: Path) -> list[Row]:
    judge = judges.get(number(script))
    if judge is None:
        return [("-", "nothing said of it here", False, "add what should happen")]
    place = base / script.stem
    place.mkdir()
    try:
        return judge(script, place) or [("-", "prints something", False, "nothing that is judged here")]
    except Exception as error:  # a broken case is a line of the table, not the end of the others
        return [("-", "runs", False, f"{type(error).__name__}: {error}")]
