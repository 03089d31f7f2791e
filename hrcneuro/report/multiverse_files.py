"""What is written of a multiverse: its tables, its pictures and its page."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro import published
from hrcneuro.analyses import multiverse as many
from hrcneuro.figures.style import DPI
from hrcneuro.io.tables import write_table
from hrcneuro.report import markup, shelf
from hrcneuro.report.multiverse import (
    FINDINGS,
    Judged,
    fits_in,
    lines,
    moved_by,
    records,
    short,
    span,
    summary,
    verdicts,
)
from hrcneuro.report.verdicts import VERDICTS
from hrcneuro.tables import multiverse as tables

_PAGE = "multiverse.html"
_FEW = 0.05  # share of pairs below which a choice is not told to turn a finding


@dataclass(frozen=True)
class Written:
    """What was written.

    Attributes:
        page: The page.
        files: Name -> place of all files.
        summary: A row a finding, for JSON.
        lines: What came out, for a person.
    """

    page: Path = Path()
    files: Mapping[str, Path] = field(default_factory=dict)
    summary: Sequence[Mapping[str, Any]] = ()
    lines: Sequence[str] = ()


def write(
    out: Path,
    every: Sequence[Judged],
    *,
    own: Mapping[str, str],
    curves: Sequence[str],
    failed: Sequence[Judged],
    choices: Sequence[tuple[str, str, str]],
    drawn: bool = True,
    **words: Any,
) -> Written:
    """Write the tables, pictures and page of the universes that were judged.

    Args:
        out: The folder; it is made where it is not there.
        every: The universes, by number.
        own: The study's own values of the choices.
        curves: Findings that have a specification curve.
        failed: Universes that did not come to an end, without rows.
        choices: Of each choice its name, how it was varied, and its values.
        drawn: Whether pictures are wanted.
        words: ``study``, ``reality``, ``what`` and ``notes`` of the page: the study's name, what is real in its data,
            what was done, and what to know of that.
    """
    out.mkdir(parents=True, exist_ok=True)
    told = verdicts(every, own)
    held, moved = summary(told, every)
    content = {
        "verdicts": (told, tables.VERDICTS),
        "universes": (_chosen(every, failed, own), tables.UNIVERSES),
        "summary": (held, tables.SUMMARY),
        "influence": (moved, tables.INFLUENCE),
    }
    files = {}
    for name, (frame, table) in content.items():
        files[name] = out / f"{name}.parquet"
        write_table(frame, files[name], table)
    for stale in (*out.glob("curve_*.*"), *out.glob("findings.*")):
        stale.unlink()
    pictures = draw(told, held, every, curves, out) if drawn else {}
    files |= {Path(name).stem: out / name for name in pictures}
    files["page"] = page(out, told=told, held=held, moved=moved, choices=choices, pictures=pictures, **words)
    rows = records(held.astype(object).where(held.notna(), None))
    return Written(files["page"], files, rows, lines(held))


def _chosen(every: Sequence[Judged], failed: Sequence[Judged], own: Mapping[str, str]) -> pd.DataFrame:
    ended = {one.number for one in every}
    rows = [
        (one.number, one.chain, choice, value, value == own[choice], one.number in ended)
        for one in sorted((*every, *failed), key=lambda one: one.number)
        for choice, value in one.chosen.items()
    ]
    return pd.DataFrame(rows, columns=list(tables.UNIVERSES.columns))


def page(
    folder: Path,
    *,
    study: str,
    reality: str,
    what: str,
    notes: Sequence[str],
    told: pd.DataFrame,
    held: pd.DataFrame,
    moved: pd.DataFrame,
    choices: Sequence[tuple[str, str, str]],
    pictures: Mapping[str, str],
) -> Path:
    """Write the page; return where it lies.

    Args:
        folder: Where the pictures lie.
        study, reality, what, notes: Its name, what is real in its data, what was done, and what to know of that.
        told, held, moved: The verdicts, what they come to, and what moves them.
        choices: Of each choice its name, how it was varied, and its values.
        pictures: File -> caption.
    """
    text = markup.render(
        "multiverse.html",
        title=f"Multiverse of {study}",
        style=markup.own("page.css"),
        study=study,
        reality=reality,
        what=what,
        notes=list(notes),
        doi=published.DOI,
        findings=_findings(held, told),
        pictures=[_picture(folder, name, caption) for name, caption in pictures.items()],
        choices=markup.PageTable(["choice", "how", "values, the study's own first"], [list(one) for one in choices]),
        influence=_influence(moved, held),
        verdicts=_verdicts(told),
    )
    shelf.write(folder / _PAGE, text)
    return folder / _PAGE


def _findings(held: pd.DataFrame, told: pd.DataFrame) -> markup.PageTable:
    own = told[told["universe"] == 0].set_index("finding")
    head = ["place", "finding", "published", "the study's own", "fits in, of analyses", "cannot tell"]
    head += ["values", "moved most by"]
    rows = []
    for row in records(held):
        ours: markup.Cell = "-"
        if row["finding"] in own.index:
            one = own.loc[row["finding"]]
            ours = markup.NotedCell(f"{one['fits']}: {one['ours']}", str(one["verdict"]))
        about = [row["place"], row["quantity"], row["published"], ours]
        rows.append([*about, fits_in(row), int(row["open"]), span(row), moved_by(row)])
    return markup.PageTable(head, rows)


def _influence(moved: pd.DataFrame, held: pd.DataFrame) -> markup.PageTable:
    quantity, unit = (held.set_index("finding")[name] for name in ("quantity", "unit"))
    head = ["finding", "choice", "pairs", "turned in", "moved on average", "at most"]
    rows = []
    for row in records(moved[moved["flips"].fillna(0) >= _FEW]):
        far = [
            f"{short(row[name])} {unit[row['finding']]}" if np.isfinite(row[name]) else "-"
            for name in ("moved", "most")
        ]
        rows.append([quantity[row["finding"]], row["choice"], row["pairs"], f"{100 * row['flips']:.0f} %", *far])
    return markup.PageTable(head, rows)


def _verdicts(told: pd.DataFrame) -> markup.PageTable:
    counts = many.once(told).groupby(["finding", "verdict"], sort=False).size()
    words = [word for word in VERDICTS if word in set(told["verdict"])]
    quantity = told.groupby("finding", sort=False)["quantity"].first()
    rows = [[name, *(int(counts.get((key, word), 0)) for word in words)] for key, name in quantity.items()]
    return markup.PageTable(["finding", *words], rows)


def _picture(folder: Path, name: str, caption: str) -> dict[str, Any]:
    from PIL import Image

    with Image.open(folder / name) as picture:
        width = round(110 * picture.width / DPI)
    return {"anchor": Path(name).stem, "width": width, "caption": caption, "source": name}


def draw(
    told: pd.DataFrame, held: pd.DataFrame, every: Sequence[Judged], curves: Sequence[str], out: Path
) -> dict[str, str]:
    """Draw the specification curves and what holds where; return file -> caption of what was drawn."""
    from hrcneuro.figures import multiverse as figures

    by_number = {one.number: one for one in every}
    drawn = {}
    for finding in curves:
        own = many.once(told[told["finding"] == finding]).set_index("universe").sort_index()
        if 0 not in own.index or np.isfinite(own["value"]).sum() < 2:
            continue
        name, about = f"curve_{re.sub(r'[^A-Za-z0-9]+', '_', finding)}.png", FINDINGS[finding].printed
        chosen = [by_number[number].chosen for number in own.index]
        printed = about.value.mean if isinstance(about.value, published.MeanSd) else None
        given = dict(title=f"{about.quantity} ({about.place})", unit=own["unit"].iloc[0], printed=printed)
        figures.draw_curve(own["value"].to_numpy(), list(own["fits"]), chosen, path=out / name, **given)
        drawn[name] = (
            f"{about.quantity}: the value of each analysis, sorted, and below what it chose; printed: {about.text}."
        )
    split = held[(held[["fits", "differs", "open"]] > 0).sum(axis=1) > 1]
    if len(split):
        order = sorted(every, key=lambda one: (one.chain, one.number))
        table = told.pivot(index="finding", columns="universe", values="fits")
        table = table.reindex(index=split["finding"], columns=[one.number for one in order])
        borders = [i for i in range(1, len(order)) if order[i].chain != order[i - 1].chain]
        given = dict(constant=len(held) - len(split), path=out / "findings.png")
        figures.draw_findings(table, list(split["quantity"]), borders, **given)
        drawn["findings.png"] = "What each universe has to say on each finding that not all tell alike."
    return drawn
