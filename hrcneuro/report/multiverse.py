"""What the universes of a multiverse have to say on each printed finding, and what moves it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.analyses import multiverse as many
from hrcneuro.answers.words import counted
from hrcneuro.cache import fingerprint
from hrcneuro.cache.disk import read_json
from hrcneuro.report import shelf
from hrcneuro.report.claims import CLAIMS, judged
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import grounds

CURVES = ("iC RRvsRH acc", "erp iC", "ersp C alpha")
"""Findings that have a specification curve where none is named."""
FINDINGS = {claim.key: claim for claim in CLAIMS}

Row = dict[str, Any]


@dataclass(frozen=True)
class Judged:
    """A universe that came to an end.

    Attributes:
        number: 0 is the study's own.
        chain: Number of its preprocessing chain.
        chosen: Choice -> name of the value that was taken.
        rows: A finding each, as :func:`judge` returns them.
        analyses: Stage -> what decides its results; universes with the same do the same as far as that stage.
    """

    number: int
    chain: int
    chosen: Mapping[str, str]
    rows: Sequence[Row]
    analyses: Mapping[str, str] = field(default_factory=dict)


def judge(settings: Any, items: Sequence[Any]) -> list[Row]:
    """Return what a universe has to say: a row for each finding that it has something on."""
    results = Results(settings, items)
    words = {True: many.FITS, False: many.DIFFERS, None: many.OPEN}
    return [
        {
            "finding": claim.key,
            "ours": ours.text,
            "value": None if ours.value is None or not np.isfinite(ours.value) else float(ours.value),
            "unit": ours.unit,
            "fits": words[None if ours.agrees is None else bool(ours.agrees)],
            "verdict": verdict,
            "why": why,
        }
        for claim, ours, verdict, why in judged(results, grounds(results))
        if ours is not None
    ]


def read_judged(path: Path) -> list[Row] | None:
    """Return the rows that were kept of a universe; None where there are none, or none that this version can take."""
    try:
        rows = read_json(path)
    except (OSError, ValueError):
        return None
    keys = {"finding", "ours", "value", "unit", "fits", "verdict", "why"}
    sound = isinstance(rows, list) and all(isinstance(one, dict) and set(one) == keys for one in rows)
    return rows if sound and rows and all(one["finding"] in FINDINGS for one in rows) else None


def keep_judged(path: Path, rows: Sequence[Row]) -> None:
    """Keep the rows of a universe, so that nobody ever sees half of them."""
    shelf.write(path, json.dumps(list(rows), indent=1))


def code(memo: fingerprint.Memo) -> str:
    """Return a digest of the code that judges."""
    return fingerprint.digest(fingerprint.code("hrcneuro.report.claims", Path(__file__).parents[1], memo))


def verdicts(every: Sequence[Judged], own: Mapping[str, str]) -> pd.DataFrame:
    """Return one row a universe and finding, as ``tables.multiverse.VERDICTS`` declares them, in the paper's order.

    ``own`` are the study's own values of the choices.
    """
    rows = []
    first: dict[tuple[str, ...], int] = {}
    for one in sorted(every, key=lambda one: one.number):
        words = many.in_words(many.differing(one.chosen, own).items())
        for row in one.rows:
            does = [one.analyses.get(stage, str(one.number)) for stage in FINDINGS[row["finding"]].stages]
            same = first.setdefault((row["finding"], *does), one.number)
            about = {"universe": one.number, "analysis": same, "chain": one.chain, "choices": words}
            rows.append({**about, **_printed(row["finding"]), **row})
    frame = pd.DataFrame(rows)
    frame["value"] = frame["value"].astype(float)
    rank = {key: place for place, key in enumerate(FINDINGS)}
    return frame.assign(rank=frame["finding"].map(rank)).sort_values(["rank", "universe"]).drop(columns="rank")


def summary(told: pd.DataFrame, every: Sequence[Judged]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return what holds in how many analyses, and how much each choice moves each finding."""
    places = {one.number: place for place, one in enumerate(every)}
    placed = told.assign(universe=told["universe"].map(places), analysis=told["analysis"].map(places))
    moved = many.influence(placed, [one.chosen for one in every])
    held = many.held(told, moved)
    units = told.groupby("finding", sort=False)["unit"].first()
    about = pd.DataFrame([_printed(key) for key in held["finding"]])
    held = pd.concat([about, held.drop(columns="finding")], axis=1)
    held["unit"] = held["finding"].map(units)
    held["choice"] = held["choice"].where(held["choice"] != "", None)
    return held, moved


def _printed(finding: str) -> Row:
    about = FINDINGS[finding].printed
    return {"finding": finding, "place": about.place, "quantity": about.quantity, "published": about.text}


def lines(held: pd.DataFrame) -> list[str]:
    """Return a line a finding that not all universes tell alike, then how many do."""
    turned = held[(held["fits"] > 0) & (held["differs"] > 0)]
    found = []
    for row in records(turned):
        own = f"the study's own {row['study']}" if row["study"] else "the study's own is not there"
        found.append(f"{row['quantity']}: fits in {fits_in(row)}; {own}; moved most by {moved_by(row)}")
    reached = held[held["analyses"] > 1]
    words = {"fits": "fit", "differs": "differ"}
    for name, other in (("fits", "differs"), ("differs", "fits")):
        number = int(((reached[name] > 0) & (reached[other] == 0)).sum())
        found.append(f"{number} of {len(held)} findings {words[name]} in every analysis that can judge them")
    unjudged = int((reached["fits"] + reached["differs"] == 0).sum())
    found.append(f"{unjudged} of {len(held)} findings cannot be judged in any analysis")
    same = len(held) - len(reached)
    return [*found, f"{same} of {len(held)} findings are reached by no choice: there is one analysis of them"]


def records(frame: pd.DataFrame) -> list[Row]:
    """Return the rows of a table by the names of its columns."""
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]


def fits_in(row: Mapping[str, Any]) -> str:
    """Return ``12 of 60 (20 %)``, of analyses; in words where there is one alone."""
    told = row["fits"] + row["differs"]
    if row["analyses"] == 1:
        return "one analysis"
    return f"{row['fits']} of {told} ({100 * row['share']:.0f} %)" if told else "judged in none"


def moved_by(row: Mapping[str, Any]) -> str:
    """Return the choice that moves a finding most, and how; a dash where none does."""
    if not isinstance(row["choice"], str):
        return "-"
    of = counted(row["pairs"], "pair")
    turns = f"turns it in {100 * row['flips']:.0f} % of {of}" if row["flips"] > 0 else f"turns it in none of {of}"
    far = f"; values {short(row['moved'])} {row['unit']} apart" if np.isfinite(row["moved"]) and row["moved"] else ""
    return f"{row['choice']} ({turns}{far})"


def short(value: float) -> str:
    """Return a number in two digits, a large one in whole numbers."""
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.2g}"


def span(row: Mapping[str, Any]) -> str:
    """Return ``50.9 to 54.7 %``, or the one value that all universes have; a dash where there is none."""
    low, high = (f"{row[name]:.3g}" for name in ("low", "high"))
    if not np.isfinite(row["low"]):
        return "-"
    return f"{low} {row['unit']}" if low == high else f"{low} to {high} {row['unit']}"
