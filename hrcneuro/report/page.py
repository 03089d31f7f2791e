"""The page itself: plain HTML with its pictures inside, readable without a network."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable
from importlib.resources import files

from hrcneuro import __version__, stages
from hrcneuro.contract import params
from hrcneuro.report.published import rows
from hrcneuro.report.results import Figure, Results

TITLES = {
    "acquire": "Recordings",
    "preprocess": "Preprocessing and signal quality",
    "epoch": "Epochs and conditions",
    "erp": "Event-related potentials",
    "ersp": "Time-frequency analysis",
    "decode": "Single-trial decoding",
    "simulate": "The robot that learns",
    "robot": "The arm",
}


def render(results: Results) -> str:
    """Return the report as one HTML document."""
    name = html.escape(results.settings.study.name)
    word, sentence = results.reality
    chapters = [s for s in stages.NAMES if any(stage == s for stage, _ in results.done)]
    links = "".join(f'<a href="#{s}">{TITLES[s]}</a>' for s in chapters)
    body = [
        f"<header><h1>{name}</h1><p class='real {word.split('-')[-1]}'><strong>{word}</strong> {sentence}</p></header>",
        f"<nav><a href='#published'>Published and this run</a>{links}<a href='#provenance'>Provenance</a></nav>",
        _failures(results),
        _published(results),
        *(_chapter(results, stage) for stage in chapters),
        _provenance(results),
    ]
    style = files("hrcneuro.report").joinpath("page.css").read_text(encoding="utf-8")
    return (
        "<!doctype html><html lang='en'><head><meta charset='utf-8'>"
        "<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f"<title>{name} - hrcneuro</title><style>{style}</style></head><body>{''.join(body)}</body></html>"
    )


def _failures(results: Results) -> str:
    missing = [i for i in results.items if i.state not in ("hit", "ran")]
    if not missing:
        return ""
    lines = [f"{i.stage} {i.unit}: {i.state} ({'; '.join(i.why)})" for i in missing]
    return f"<section class='missing'><h2>Not in this report</h2>{_list(lines)}</section>"


def _published(results: Results) -> str:
    found = rows(results)
    if not found:
        return ""
    lines = "".join(
        f"<tr><td>{html.escape(r.place)}</td><td>{html.escape(r.what)}</td><td>{html.escape(r.published)}</td>"
        f"<td>{html.escape(r.ours)}</td><td class='{r.verdict.split()[0]}'>{r.verdict}</td></tr>"
        for r in found
    )
    return (
        "<section id='published'><h2>Published and this run</h2><p>Place and figure as printed by Ehrlich et al. 2023 "
        "(<a href='https://doi.org/10.1371/journal.pone.0287958'>doi:10.1371/journal.pone.0287958</a>). "
        "<em>By construction</em>: the simulation was built to give this, so agreement is no evidence.</p>"
        "<div class='wide'><table><thead><tr><th>place</th><th>quantity</th><th>published</th><th>this run</th>"
        f"<th>verdict</th></tr></thead><tbody>{lines}</tbody></table></div></section>"
    )


def _chapter(results: Results, stage: str) -> str:
    settings = "; ".join(f"{k} = {v}" for k, v in params(results.settings.sections[stage]).items() if _short(v))
    notes = [w.removeprefix(f"{stage} ") for w in results.warnings() if w.startswith(f"{stage} ")]
    figures = results.figures(stage)
    group = [f for f in figures if f.unit == "group"]
    subjects = [f for f in figures if f.unit != "group"]
    return (
        f"<section id='{stage}'><h2>{TITLES[stage]}</h2>{''.join(map(_figure, group))}{_list(notes)}"
        f"{_fold('Subjects', subjects)}<p class='small'>{html.escape(settings)}</p></section>"
    )


def _fold(title: str, figures: list[Figure]) -> str:
    if not figures:
        return ""
    opened = " open" if len({f.unit for f in figures}) == 1 else ""
    return f"<details{opened}><summary>{title}</summary>{''.join(map(_figure, figures))}</details>"


def _figure(figure: Figure) -> str:
    data = base64.b64encode(figure.path.read_bytes()).decode()
    text = html.escape(figure.caption if figure.unit == "group" else f"{figure.unit}: {figure.caption}")
    return f"<figure><img alt='{text}' src='data:image/png;base64,{data}'><figcaption>{text}</figcaption></figure>"


def _provenance(results: Results) -> str:
    lines = []
    for (stage, unit), item in sorted(results.done.items()):
        about = results.record(stage, unit).get("provenance", {})
        versions = ", ".join(f"{k} {v}" for k, v in about.get("versions", {}).items())
        commit = f"{about.get('commit', '')[:10]}{' (changed)' if about.get('dirty') else ''}"
        cells = (stage, unit, item.key, f"{about.get('seconds', 0):.1f}", str(about.get("peak_rss_mb", "")), commit)
        lines.append("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in (*cells, versions)) + "</tr>")
    return (
        f"<section id='provenance'><h2>Provenance</h2><p>hrcneuro {__version__}</p><details><summary>Every entry: key, "
        "seconds, peak memory of its process in MB, commit, versions</summary><div class='wide'><table><thead><tr>"
        "<th>stage</th><th>unit</th><th>key</th><th>s</th><th>MB</th><th>commit</th><th>versions</th></tr></thead>"
        f"<tbody>{''.join(lines)}</tbody></table></div></details></section>"
    )


def _list(lines: Iterable[str]) -> str:
    items = "".join(f"<li>{html.escape(line)}</li>" for line in lines)
    return f"<ul>{items}</ul>" if items else ""


def _short(value: object) -> bool:
    return not isinstance(value, dict) and len(str(value)) < 60
