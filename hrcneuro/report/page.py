"""The page itself: plain HTML with its pictures inside, readable without a network."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from hrcneuro import __version__, answers, drawings, published, stages
from hrcneuro.contract import EVIDENCE, GROUP, OF_ALL, SWEEP
from hrcneuro.figures.style import DPI
from hrcneuro.report import chapters, glossary, markup, provenance, shelf, task
from hrcneuro.report.album import Album
from hrcneuro.report.claims import PublishedRow, is_study, rows
from hrcneuro.report.differing import differing
from hrcneuro.report.gallery import collect
from hrcneuro.report.measured_decoding import guessing
from hrcneuro.report.results import Figure, Results
from hrcneuro.report.verdicts import AGREES, CHOSEN, DIFFERS, PLANTED, VERDICTS

_PLURAL = {AGREES: "agree", CHOSEN: "agree, by our choice of reading", DIFFERS: "differ"}
_FOLDED = ("erp.png", "erp_scenarios.png", "erp_strata.png", "ersp.png", "ersp_scenarios.png", "ersp_strata.png")
_OF_GROUPS = {"erp": "erp.png", "ersp": "ersp.png"}
_SIDES = {SWEEP: "How good must a decoder be?", EVIDENCE: "Did it come true? A closed loop with people"}
_ONCE = ("reach.png",)  # the same for every subject


def render(results: Results, folder: Path) -> tuple[str, dict[str, Any]]:
    """Return the report as one HTML document and what a list says of it; leave every figure as a file in the folder."""
    page = _Page(results, folder)
    return page.html(), page.about()


class _PageFigure(NamedTuple):
    """A picture as the template shows it; ``source`` is the album's mark for it."""

    anchor: str
    width: int
    caption: str
    source: str


class _Page:
    """One report in the making."""

    def __init__(self, results: Results, folder: Path) -> None:
        self.results = results
        self.album = Album()
        self.figures: dict[str, list[Figure]] = {stage: [] for stage in stages.NAMES}
        for name in drawings.NAMES:
            self.figures[drawings.load(name).chapter or name] += results.figures(name)
        collect([f for figures in self.figures.values() for f in figures], folder)
        # A group of one has the subject's own picture once more.
        for stage, name in _OF_GROUPS.items():
            if len(results.included(stage)) == 1:
                self.figures[stage] = [f for f in self.figures[stage] if (f.unit, f.path.name) != (GROUP, name)]
        self.stages = [s for s in stages.NAMES if any(stage == s for stage, _ in results.done)]
        self.rows = rows(results)

    def html(self) -> str:
        settings = self.results.settings
        word, sentence = self.results.reality
        page = markup.render(
            "page.html",
            version=__version__,
            study=settings.study.name,
            subjects=settings.study.subjects,
            excluded=settings.study.exclude,
            reality={
                "word": word,
                "sentence": sentence,
                "kind": {"real": "real", "no data": "none"}.get(word, "synthetic"),
            },
            name=shelf.name(settings),
            lacking=shelf.told(settings, self.results.items),
            missing=self._missing(),
            task=task.panels() if is_study(self.results) else [],
            edge=task.EDGE,
            glossary=glossary.terms(of_task=is_study(self.results)),
            published=self._published(self.rows),
            chapters=list(map(self._chapter, self.stages)),
            provenance=provenance.chapter(self.results),
            style=markup.own("page.css"),
            script=markup.own("page.js"),
        )
        return self.album.fill(page)

    def about(self) -> dict[str, Any]:
        """Return what a list of reports says of this one."""
        return {
            "study": self.results.settings.study.name,
            "reality": self.results.reality[0],
            "subjects": len(self.results.units("acquire")),
            "stages": ", ".join(self.stages),
            "verdicts": {_PLURAL.get(v, v): number for v, number in self._counts().items() if number},
        }

    def _counts(self) -> dict[str, int]:
        counts = Counter(row.verdict for row in self.rows if row.verdict)
        return {verdict: counts[verdict] for verdict in VERDICTS}

    def _anchors(self, stage: str) -> dict[str, str]:
        """Return anchor -> title of a chapter's figures; of those a subject has, the first one's."""
        titles: dict[str, str] = {}
        for figure in sorted(self.figures[stage], key=lambda f: f.stage not in drawings.JOINT):
            title = figure.title or (figure.path.stem if figure.unit in OF_ALL else "")
            if title and title not in titles.values():
                titles[_anchor(figure)] = title
        return titles

    def _missing(self) -> list[str]:
        """Return a line for what the report lacks and why, units that lack it alike together."""
        words = {"would-run": "has not run with these settings, data and code", "blocked": "could not run"}
        alike: dict[tuple[str, str], list[str]] = {}
        for i in self.results.items:
            if i.state not in ("hit", "ran"):
                why = dict.fromkeys(re.sub(r"^(inputs: \w+) of \S+ ", r"\1 ", one) for one in i.why)
                alike.setdefault((i.stage, f"{words.get(i.state, i.state)} ({'; '.join(why)})"), []).append(i.unit)
        return provenance.plain(f"{stage} {_span(units)}: {text}" for (stage, text), units in alike.items())

    def _published(self, lines: Sequence[PublishedRow]) -> dict[str, Any] | None:
        """Return what is said of the paper; None where the study is another one."""
        if not lines:
            return None
        results = [row for row in lines if row.kind == "result"]
        notes = {"decode": guessing(self.results)}
        return {
            "doi": published.DOI,
            "chips": [
                {"kind": _mark(v), "number": number, "word": _PLURAL.get(v, v)}
                for v, number in self._counts().items()
                if number or v == AGREES
            ],
            "differing": differing(lines),
            "meanings": list(VERDICTS.items()),
            # A criterion where it was applied, a reason where it could not be.
            "applied": (AGREES, CHOSEN, DIFFERS, PLANTED),
            "marks": {verdict: _mark(verdict) for verdict in VERDICTS},
            "anchors": {*self.stages, *(anchor for stage in self.stages for anchor in self._anchors(stage))},
            "chapters": [
                {"stage": stage, "title": stages.load(stage).title, "rows": list(part), "note": notes.get(stage, "")}
                for stage, part in itertools.groupby(results, key=lambda row: row.chapter)
            ],
            "parameters": _without_verdict(lines, "parameter"),
            "setup": _without_verdict(lines, "setup"),
        }

    def _chapter(self, stage: str) -> dict[str, Any]:
        group = [f for f in self.figures[stage] if f.unit == GROUP]
        joint = [f for f in group if f.stage in drawings.JOINT]
        # Where the composed figures are there, the stage's own ones are the appendix.
        composed = any(f.path.name == "fig2.png" for f in self.figures["erp"])
        appendix = [f for f in group if composed and f.path.name in _FOLDED]
        notes = [w.removeprefix(f"{stage} ") for w in self.results.warnings() if w.startswith(f"{stage} ")]
        return {
            "stage": stage,
            "title": stages.load(stage).title,
            "anchors": list(self._anchors(stage).items()),
            "figures": [self._shown(f) for f in group if f not in (*appendix, *joint)],
            "joint": list(map(self._shown, joint)),
            "tables": chapters.tables(self.results, stage),
            "sides": [side for unit in _SIDES if (side := self._side(stage, unit))],
            "notes": provenance.plain(notes),
            "appendix": list(map(self._shown, appendix)),
            **self._subjects(stage),
        }

    def _side(self, stage: str, unit: str) -> dict[str, Any] | None:
        """Return what the section of a result on the side shows; None where the stage has none that is up to date."""
        summary = self.results.summary(stage, unit)
        if not summary:
            return None
        return {
            "anchor": unit,
            "title": _SIDES[unit],
            "lines": [line.strip() for line in answers.lines(stage, unit, summary, every=True)],
            "figures": [self._shown(f) for f in self.figures[stage] if f.unit == unit],
        }

    def _subjects(self, stage: str) -> dict[str, Any]:
        """Return the figures of the subject that the chapter shows, and of the others, which are folded."""
        figures = [f for f in self.figures[stage] if f.unit not in OF_ALL]
        units = list(dict.fromkeys(f.unit for f in figures))
        once = [f for f in figures if f.path.name in _ONCE and f.unit == units[0]]
        each = [f for f in figures if f.path.name not in _ONCE]
        # One subject of the arm is a figure of the chapter; of the rest the group's figures speak.
        alone = stage == "robot" or len(units) == 1 or (stage, GROUP) not in self.results.done
        first = [f for f in each if f.unit == units[0]] if units and alone else []
        rest = [f for f in each if f not in first]
        return {
            "subject": list(map(self._shown, first + once)),
            "other": bool(first),
            "subjects": list(map(self._shown, rest)),
            "units": len({f.unit for f in rest}),
        }

    def _shown(self, figure: Figure) -> _PageFigure:
        alone = figure.unit in OF_ALL or figure.path.name in _ONCE
        text = figure.caption if alone else f"{figure.unit}: {figure.caption}"
        if figure.stage in drawings.JOINT:
            text = f"{figure.title}. {text}"
        source = self.album.mark(figure.path, subject=figure.unit not in OF_ALL)
        return _PageFigure(_anchor(figure), _width(figure.path), f"{text}.", source)


def _mark(verdict: str) -> str:
    """Return the class of the style sheet that a verdict has: not-run, agrees-by-our-choice-of-reading."""
    return re.sub(r"\W+", "-", verdict)


def _without_verdict(lines: Sequence[PublishedRow], kind: str) -> markup.PageTable:
    cells = [[row.place, row.quantity, row.published, row.ours] for row in lines if row.kind == kind]
    return markup.PageTable(["place", "quantity", "published", "this run"], cells)


def _anchor(figure: Figure) -> str:
    if figure.stage in drawings.JOINT:
        return figure.path.stem
    return f"{figure.stage}-{figure.unit}-{figure.path.stem}"


def _span(units: Sequence[str]) -> str:
    return ", ".join(units) if len(units) <= 3 else f"{units[0]} … {units[-1]}, {len(units)} units"


def _width(path: Path) -> int:
    """Return how wide a picture stands in the page: letters of all figures are equally large, a sixth above print."""
    from PIL import Image

    with Image.open(path) as picture:
        return round(110 * picture.width / DPI)
