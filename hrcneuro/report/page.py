"""The page itself: plain HTML with its pictures inside, readable without a network."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Container, Sequence
from importlib.resources import files
from pathlib import Path

from hrcneuro import __version__, drawings, stages
from hrcneuro.contract import GROUP
from hrcneuro.figures.style import DPI
from hrcneuro.report import chapters, provenance
from hrcneuro.report.album import Album
from hrcneuro.report.gallery import collect
from hrcneuro.report.markup import Cell, Raw, esc, fold, items, link, table
from hrcneuro.report.published import Row, rows
from hrcneuro.report.results import Figure, Results
from hrcneuro.report.verdicts import AGREES, DIFFERS, PLANTED, VERDICTS

_PLURAL = {AGREES: "agree", DIFFERS: "differ"}
_FOLDED = ("erp.png", "erp_scenarios.png", "erp_strata.png", "ersp.png", "ersp_scenarios.png", "ersp_strata.png")
_APPENDIX = "All contrasts: without mask, with error moves left out, and within strata"
# A link into something folded unfolds it, and so does printing; without script both still work by hand.
_SCRIPT = (
    "const open_=()=>{let e=location.hash&&document.getElementById(location.hash.slice(1));"
    "for(let p=e;p;p=p.parentElement)if(p.tagName==='DETAILS')p.open=true;if(e)e.scrollIntoView()};"
    "addEventListener('hashchange',open_);addEventListener('load',open_);"
    "addEventListener('beforeprint',()=>document.querySelectorAll('details:not(.subjects)').forEach(d=>d.open=true))"
)
_ONCE = ("reach.png",)  # the same for every subject


class Page:
    """One report in the making."""

    def __init__(self, results: Results, folder: Path) -> None:
        self.results = results
        self.album = Album()
        self.figures: dict[str, list[Figure]] = {stage: [] for stage in stages.NAMES}
        for name in drawings.NAMES:
            self.figures[drawings.load(name).chapter or name] += results.figures(name)
        collect([f for found in self.figures.values() for f in found], folder)
        self.chapters = [s for s in stages.NAMES if any(stage == s for stage, _ in results.done)]

    def render(self) -> str:
        """Return the report as one HTML document."""
        name = esc(self.results.settings.study.name)
        found = rows(self.results)
        body = [
            self._head(found),
            self._missing(),
            _verdicts(found, {*self.chapters, *(a for stage in self.chapters for a, _ in self._anchors(stage))}),
            *map(self._chapter, self.chapters),
            provenance.chapter(self.results),
        ]
        style = files("hrcneuro.report").joinpath("page.css").read_text(encoding="utf-8")
        page = (
            "<!doctype html><html lang='en'><head><meta charset='utf-8'>"
            "<meta name='viewport' content='width=device-width, initial-scale=1'>"
            "<link rel='icon' href='data:,'>"
            f"<title>{name} - hrcneuro</title><style>{style}</style></head>"
            f"<body>{''.join(body)}<script>{_SCRIPT}</script></body></html>\n"
        )
        return self.album.fill(page)

    def _head(self, found: Sequence[Row]) -> str:
        settings = self.results.settings
        word, sentence = self.results.reality
        kind = {"real": "real", "no data": "none"}.get(word, "synthetic")
        left_out = f" ({len(settings.study.exclude)} excluded)" if settings.study.exclude else ""
        ran = ", ".join(self.chapters) or "nothing"
        counts = Counter(row.verdict for row in found if row.verdict)
        chips = "".join(
            f"<li class='{_kind(v)}'><b>{counts[v]}</b> {_PLURAL.get(v, v)}</li>"
            for v in VERDICTS
            if counts[v] or v == AGREES
        )
        changed = provenance.changed(settings)
        note = link("settings", f"{_count(len(changed), 'setting')} not the paper's").text if changed else ""
        who = f"{_count(len(settings.study.subjects), 'subject')}{left_out}"
        return (
            f"<header><h1>{esc(settings.study.name)}</h1><p class='real {kind}'><strong>{word}</strong> {sentence}</p>"
            f"<p>{who}; ran: {ran}; hrcneuro {__version__}{', ' if note else ''}{note}.</p>"
            + (f"<ul class='chips'>{chips}</ul>" if found else "")
            + f"</header>{self._nav(bool(found))}"
        )

    def _nav(self, published: bool) -> str:
        first = ["<li><a href='#published'>Published and this run</a></li>"] if published else []
        for stage in self.chapters:
            figures = ", ".join(link(anchor, title).text for anchor, title in self._anchors(stage))
            first.append(f"<li>{link(stage, stages.load(stage).title).text}{f': {figures}' if figures else ''}</li>")
        first.append("<li><a href='#provenance'>Provenance</a></li>")
        return f"<nav><ul>{''.join(first)}</ul></nav>"

    def _anchors(self, stage: str) -> list[tuple[str, str]]:
        """Return (anchor, title) of a chapter's figures; of those a subject has, the first one's."""
        found: dict[str, str] = {}
        for figure in sorted(self.figures[stage], key=lambda f: f.stage not in drawings.JOINT):
            title = figure.title or (figure.path.stem if figure.unit == GROUP else "")
            if title and title not in found.values():
                found[_anchor(figure)] = title
        return list(found.items())

    def _missing(self) -> str:
        missing = [i for i in self.results.items if i.state not in ("hit", "ran")]
        if not missing:
            return ""
        words = {"would-run": "has not run with these settings, data and code", "blocked": "could not run"}
        alike: dict[tuple[str, str], list[str]] = {}
        for i in missing:
            why = dict.fromkeys(re.sub(r"^(inputs: \w+) of \S+ ", r"\1 ", one) for one in i.why)
            alike.setdefault((i.stage, f"{words.get(i.state, i.state)} ({'; '.join(why)})"), []).append(i.unit)
        lines = [f"{stage} {_span(units)}: {text}" for (stage, text), units in alike.items()]
        return f"<section class='missing'><h2>Not in this report</h2>{items(provenance.plain(lines))}</section>"

    def _chapter(self, stage: str) -> str:
        notes = [w.removeprefix(f"{stage} ") for w in self.results.warnings() if w.startswith(f"{stage} ")]
        group = [f for f in self.figures[stage] if f.unit == GROUP]
        joint = [f for f in group if f.stage in drawings.JOINT]
        composed = any(f.path.name == "fig2.png" for f in self.figures["erp"])
        # Where the composed figures are there, the stage's own ones are the appendix.
        beside = [f for f in group if composed and f.path.name in _FOLDED]
        plain = "".join(self._figure(f) for f in group if f not in (*beside, *joint))
        shown = "".join(map(self._figure, joint))
        if beside and not shown:
            shown = "<p>Composed with the potentials: <a href='#fig2'>Fig 2</a>, <a href='#fig3'>Fig 3</a>.</p>"
        return (
            f"<section id='{stage}'><h2>{stages.load(stage).title}</h2>{plain}{shown}{chapters.tables(self.results, stage)}"
            f"{items(provenance.plain(notes))}"
            f"{fold(_APPENDIX, ''.join(map(self._figure, beside)))}"
            f"{self._subjects(stage)}</section>"
        )

    def _subjects(self, stage: str) -> str:
        figures = [f for f in self.figures[stage] if f.unit != GROUP]
        units = list(dict.fromkeys(f.unit for f in figures))
        once = [f for f in figures if f.path.name in _ONCE and f.unit == units[0]]
        each = [f for f in figures if f.path.name not in _ONCE]
        # One subject of the arm is a figure of the chapter; of the rest the group's figures speak.
        first = [f for f in each if f.unit == units[0]] if stage == "robot" or len(units) == 1 else []
        rest = [f for f in each if f not in first]
        title = f"{'Other subjects' if first else 'Subjects'} ({len({f.unit for f in rest})})"
        where = "<p class='small'>Also as files, in full: figures/SUBJECT beside this page.</p>" if rest else ""
        inside = where + "".join(map(self._figure, rest))
        return "".join(map(self._figure, first + once)) + fold(title, inside, kind="subjects")

    def _figure(self, figure: Figure) -> str:
        alone = figure.unit == GROUP or figure.path.name in _ONCE
        text = figure.caption if alone else f"{figure.unit}: {figure.caption}"
        if figure.stage in drawings.JOINT:
            text = f"{figure.title}. {text}"
        return self._picture(_anchor(figure), figure.path, f"{text}.", subject=figure.unit != GROUP)

    def _picture(self, anchor: str, path: Path, caption: str, *, subject: bool) -> str:
        mark = self.album.mark(path, subject=subject)
        text = esc(caption)
        return (
            f"<figure id='{anchor}'><div class='pan'><img width='{_width(path)}' alt='{text}' src='{mark}'></div>"
            f"<figcaption>{text}</figcaption></figure>"
        )


def render(results: Results, folder: Path) -> str:
    """Return the report as one HTML document, and leave every figure as a file in the folder."""
    return Page(results, folder).render()


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


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def _kind(verdict: str) -> str:
    return verdict.split()[0]


def _verdicts(found: Sequence[Row], anchors: Container[str]) -> str:
    if not found:
        return ""
    lines: list[list[Cell]] = []
    chapter = ""
    for row in (r for r in found if r.kind == "result"):
        if row.chapter != chapter:
            chapter = row.chapter
            lines.append(
                [link(chapter, stages.load(chapter).title) if chapter in anchors else stages.load(chapter).title]
            )
        # A criterion where it was applied, a reason where it could not be.
        wanted = "wanted: " if row.verdict in (AGREES, DIFFERS, PLANTED) else ""
        why = f"<small>{wanted}{esc(row.why)}</small>" if row.why else ""
        verdict = Raw(f"<span class='{_kind(row.verdict)}'>{esc(row.verdict)}</span>{why}")
        place: Cell = link(row.figure, row.place) if row.figure in anchors else row.place
        lines.append([place, row.what, row.published, row.ours, verdict])
    head = ["place", "quantity", "published", "this run"]
    meanings = "; ".join(f"<em>{v}</em>: {esc(text)}" for v, text in VERDICTS.items())
    others = "".join(
        fold(title, table(head, [[r.place, r.what, r.published, r.ours] for r in found if r.kind == kind], cards=True))
        for kind, title in (
            (
                "parameter",
                "Parameters that the paper prints (chosen, so without verdict; by design: fixed in the program)",
            ),
            ("setup", "Setup that the paper prints (given, so without verdict; by design: fixed in the program)"),
        )
    )
    return (
        "<section id='published'><h2>Published and this run</h2><p>Ehrlich et al. 2023, PLoS ONE 18(7) e0287958 "
        "(<a href='https://doi.org/10.1371/journal.pone.0287958'>doi:10.1371/journal.pone.0287958</a>), mean ± SD. "
        f"</p><p class='small'>{meanings}. Below each verdict stands its criterion or its reason.</p>"
        f"{table([*head, 'verdict'], lines, cards=True)}{others}</section>"
    )
