"""What the command timing does: finds the recording and the robot's record, measures, draws, writes a page."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from hrcneuro.analyses import session_timing as analysis
from hrcneuro.cli import recording as recorder
from hrcneuro.cli.console import Console
from hrcneuro.config.settings import Settings
from hrcneuro.errors import DataError
from hrcneuro.io.tables import read_table
from hrcneuro.live import journal
from hrcneuro.live.part import newest
from hrcneuro.sources.chain import read_chain
from hrcneuro.sources.sessions import in_order

FOLDER = "timing"
"""Where what was measured lies, by subject and recording."""
_WINDOW_S = 0.3


@dataclass
class Measured:
    """What was measured: for a program, and for a person."""

    about: dict[str, Any]
    lines: list[str]


def measure(
    workdir: Path, subject: str, study: Settings, folder: Path | None, talk: Console, *, live: float = 0, end: str = ""
) -> Measured:
    """Return the timing of a recording, of the subject's newest one, or of a session under way.

    Raises:
        HrcError: There is nothing to measure, or it cannot be read.
    """
    parent = workdir.absolute() / study.live["record"].folder / subject
    if live:
        # Beside its numbers, where nothing overwrites it, and where acquire does not take it for a part of the session.
        options = replace(study.live["record"], folder=FOLDER)
        answer = recorder.run(workdir, subject, options, talk, seconds=live, quick=True)
        chosen = Path(answer.about["folder"])
        return _measured(chosen, workdir, subject, study, parent, end, chosen.name)
    if folder is not None and not folder.is_dir():
        raise DataError(f"the recording {folder} does not exist", cure="name the folder of a recording, with its .xdf")
    chosen = folder or _newest(parent)
    return _measured(chosen, workdir, subject, study, parent, end, chosen.name)


def _newest(parent: Path) -> Path:
    there = newest(parent)
    if there is None:
        raise DataError(
            f"no recording is in {parent}",
            cure="record one: 'hrcneuro record'; or name one that lies elsewhere: --recording FOLDER",
        )
    return there


def _measured(
    folder: Path, workdir: Path, subject: str, study: Settings, parent: Path, end: str, name: str
) -> Measured:
    parts = in_order([path for path in folder.glob("*.xdf*") if path.name.lower().endswith((".xdf", ".xdfz"))])
    acquire = study.sections["acquire"]
    chain = read_chain(parts, acquire, window_s=_WINDOW_S, delay_s=acquire.amp_delay_ms / 1e3, end=end)
    driven, said = _driven(parent, chain.moves)
    timing = analysis.session_timing(chain.moves, chain.sfreq, driven)
    lag = {key: one for part in journal.parts(folder) for key, one in part.get("streams", {}).items()}
    left = [note for note in chain.notes if note.startswith("left ")]
    told = [*left, *analysis.without_edge_in_words(timing), *said, *_arrivals(lag)]
    out = workdir.absolute() / FOLDER / subject / name
    out.mkdir(parents=True, exist_ok=True)
    arrival = {key: one.get("lag_ms") for key, one in lag.items()}
    on_disk = {key: one.get("disk_ms") for key, one in lag.items()}
    about = {
        **timing.summary, "verdict": analysis.verdict(timing), "arrival_ms": arrival, "on_disk_ms": on_disk,
        "recording": str(folder), "notes": [*chain.notes, *said],
    }  # fmt: skip
    about = _without_nan(about)
    (out / "timing.json").write_text(json.dumps(about, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    timing.moves.to_csv(out / "moves.csv", index=False)
    links = {one.name: analysis.LINKS[one.name] for one in timing.links}
    if links:
        from hrcneuro.figures.session_timing import session_timing as draw

        draw(timing.moves, links, out / "timing.png")
    rows = analysis.rows_in_words(timing)
    _page(out, subject, rows, about, told, drawn=bool(links))
    table = _lines(rows) if links else []
    return Measured(about, [*table, *told, about["verdict"], f"in {out / 'timing.html'}"])


def _without_nan(value: Any) -> Any:
    """Return JSON values with null for what is no number: JSON knows no NaN."""
    if isinstance(value, dict):
        return {key: _without_nan(one) for key, one in value.items()}
    return None if isinstance(value, float) and value != value else value


def _driven(parent: Path, moves: pd.DataFrame) -> tuple[pd.DataFrame | None, list[str]]:
    """Return the robot's record of the session whose markers these are, and a sentence where there is none.

    It is the one whose stamps agree with the markers' as they were sent: the robot's machine may have its own clock.
    """
    paths = sorted(parent.glob("*/moves.parquet"), reverse=True)
    for path in paths:
        table = read_table(path)
        if analysis.is_of(table, moves):
            return table, []
    if not paths:
        return None, [f"command and motion: not known, no record of the robot (moves.parquet) is in {parent}"]
    return None, [
        f"command and motion: not known, none of the robot's {len(paths)} records in {parent} is of these moves"
    ]


def _lines(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  ".join(cell.ljust(width) if i == 0 else cell.rjust(width) for i, (cell, width) in enumerate(cells)).rstrip()
        for cells in (list(zip(row, widths, strict=True)) for row in rows)
    ]


def _arrivals(streams: dict[str, Any]) -> list[str]:
    return [
        f"{key}: taken to written, median {one['lag_ms']['median']:.1f} ms, 99 % within {one['lag_ms']['p99']:.1f} ms, "
        f"worst {one['lag_ms']['worst']:.1f} ms"
        + (f"; on the disk within {one['disk_ms']:.0f} ms" if one.get("disk_ms") is not None else "")
        for key, one in streams.items()
        if one.get("lag_ms")
    ]


def _page(
    out: Path, subject: str, rows: list[tuple[str, ...]], about: dict[str, Any], told: list[str], *, drawn: bool
) -> None:
    from hrcneuro.report import markup

    page = markup.render(
        "timing.html",
        title=f"timing of {subject}",
        style=markup.own("page.css"),
        subject=subject,
        verdict=about["verdict"],
        table_rows=markup.PageTable(rows[0], rows[1:]),
        told=told,
        drawn=drawn,
    )
    (out / "timing.html").write_text(page, encoding="utf-8")
