"""Where reports lie: one a configuration, under ``results/reports/``, a list of them, and the whole one of last as
``results/report.html``. Nothing here is ever replaced by less of the same configuration.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcneuro import drawings, stages
from hrcneuro.cache.disk import read_json
from hrcneuro.contract import params
from hrcneuro.pipeline import graph
from hrcneuro.pipeline.item import Item
from hrcneuro.pipeline.workdir import FIGURES

PAGE = "report.html"
_KEY = 8  # letters of a key in a folder's name
_LETTERS = 40  # of a study's name in it
_FEW = 3  # stages, and units of each, that are told one by one


@dataclass(frozen=True)
class Placed:
    """A report in its place.

    Attributes:
        path: The page: ``results/report.html`` where that shows it.
        kept: An earlier page of the same configuration that has more, and was left; None where there is none.
        others: The list of all reports; None where there is no other.
    """

    path: Path
    kept: Path | None
    others: Path | None


def name(settings: Any) -> str:
    """Return the name of a configuration's folder: the study's name, and the key of all that decides results."""
    from hrcneuro.cache import fingerprint

    acquire = settings.sections["acquire"]
    places = {unit: own.path for unit, own in settings.own.get("acquire", {}).items()} | {"": acquire.path}
    key = fingerprint.digest(
        {
            "study": params(settings.study),
            "shared": params(settings.shared),
            "sections": {stage: params(section) for stage, section in settings.sections.items()},
            "own": {stage: {u: params(one) for u, one in units.items()} for stage, units in settings.own.items()},
            "places": places,
        }
    )
    plain = re.sub(r"[^\w.-]+", "-", settings.study.name).strip("-.")[:_LETTERS]
    return f"{plain or 'study'}-{key[:_KEY]}"


def folder(results: Path, settings: Any) -> Path:
    """Return the folder of a configuration's report in a study's ``results``."""
    return results / "reports" / name(settings)


def done(items: Sequence[Item]) -> list[str]:
    """Return what a report of these items shows: ``erp s01``, ``erp.figures s01``, in order."""
    return sorted(f"{item.stage} {item.unit}" for item in items if item.state.done)


def lacking(settings: Any, items: Sequence[Item]) -> list[str]:
    """Return which results of a configuration these items do not have: ``erp s01``, in the order of the stages."""
    there = set(done(items))
    wanted = (f"{task.name} {task.unit}" for task in graph.targets(settings, settings.stages, ()))
    return [one for one in wanted if one not in there]


def told(settings: Any, items: Sequence[Item]) -> str:
    """Return what a configuration lacks, and how it is made; empty where it lacks nothing."""
    names = lacking(settings, items)
    if not names:
        return ""
    units: dict[str, list[str]] = {}
    for stage, unit in (one.split(" ") for one in names):
        units.setdefault(stage, []).append(unit)
    parts = [f"{stage} {_span(of)}" for stage, of in units.items()]
    also = f"; and of {len(parts) - _FEW} more stages" if len(parts) > _FEW else ""
    total = len(graph.targets(settings, settings.stages, ()))
    first = "; ".join(parts[:_FEW])
    return (
        f"{len(names)} of {total} results of this configuration are missing: {first}{also}. hrcneuro run, with the "
        "same --config and --set, makes them"
    )


def _span(units: Sequence[str]) -> str:
    return ", ".join(units) if len(units) <= _FEW else f"{units[0]} … {units[-1]} ({len(units)} units)"


def is_whole(settings: Any, items: Sequence[Item]) -> bool:
    """Return whether every stage of the study has run for everyone, and nothing failed."""
    return not lacking(settings, items) and all(item.state.done for item in items)


def is_less(items: Sequence[Item], mark: Path) -> bool:
    """Return whether the report that the mark is of shows something that one of these items would not."""
    now = set(done(items))
    return any(one not in now for one in read(mark).get("done", ()) if _known(one))


def _known(one: str) -> bool:
    # What another version of this program called otherwise is no loss.
    return one.split(" ")[0].removesuffix(FIGURES) in (*stages.NAMES, *drawings.NAMES)


def read(mark: Path) -> Mapping[str, Any]:
    """Return what is noted of a report; nothing where there is none."""
    try:
        content = read_json(mark)
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def write(path: Path, text: str) -> None:
    """Write a file so that nobody ever sees half of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}")
    # A file's name that is not in UTF-8 is shown, byte for byte, in escapes.
    part.write_text(text, encoding="utf-8", errors="backslashreplace")
    part.replace(path)


def place(settings: Any, items: Sequence[Item], results: Path) -> Placed:
    """Write a configuration's report where it belongs, and what points at it."""
    from hrcneuro.report import write_report

    own = folder(results, settings)
    partial = is_less(items, own / "report.json") and (own / PAGE).is_file()
    path = write_report(settings, items, own / "partial" / PAGE if partial else own / PAGE)
    if not partial:
        shutil.rmtree(own / "partial", ignore_errors=True)
        if _show(own, results):
            path = results / PAGE
    listed = _list(results)
    return Placed(path, own / PAGE if partial else None, listed if len(_reports(results)) > 1 else None)


def _show(own: Path, results: Path) -> bool:
    """Let ``results/report.html`` be this page, unless it would replace a whole one of another configuration by less.

    Return whether it is this page now.
    """
    shown, mark = read(results / "report.json").get("shows"), results / "report.json"
    other = results / "reports" / str(shown) / "report.json"
    kept = shown not in (None, own.name) and read(other).get("whole") and not read(own / "report.json")["whole"]
    if kept and (results / PAGE).is_file():
        return False
    page = results / PAGE
    if not (page.exists() and page.samefile(own / PAGE)):
        part = page.with_name(f".{PAGE}.{os.getpid()}")
        part.unlink(missing_ok=True)
        try:
            # One page under two names: a page is replaced as a whole, never written into.
            os.link(own / PAGE, part)
        except OSError:
            shutil.copy2(own / PAGE, part)
        try:
            part.replace(page)
        finally:
            part.unlink(missing_ok=True)
    write(mark, json.dumps({"shows": own.name}))
    return True


def _reports(results: Path) -> list[Path]:
    return sorted(mark.parent for mark in (results / "reports").glob("*/report.json") if (mark.parent / PAGE).is_file())


def names(results: Path) -> list[str]:
    """Return the names of the reports in a study's ``results``."""
    return [own.name for own in _reports(results)]


def _list(results: Path) -> Path:
    """Write the list of all reports; return where it lies."""
    from hrcneuro.report import markup

    shown = read(results / "report.json").get("shows")
    rows = []
    for own in _reports(results):
        noted = read(own / "report.json")
        rows.append(
            {
                "name": own.name,
                "partial": (own / "partial" / PAGE).is_file(),
                "shown": own.name == shown,
                **{key: noted.get(key, "") for key in ("study", "reality", "subjects", "stages")},
                "whole": bool(noted.get("whole")),
                "verdicts": noted.get("verdicts", {}),
            }
        )
    path = results / "reports" / "index.html"
    write(path, markup.render("shelf.html", reports=rows, style=markup.own("page.css")))
    return path
