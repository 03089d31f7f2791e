"""Where every figure comes from: versions, settings, keys, seeds, times; and no path of the machine."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable, Mapping
from typing import Any

from hrcneuro import __version__, stages
from hrcneuro.contract import params
from hrcneuro.report.markup import Cell, esc, fold, table
from hrcneuro.report.results import Results

_PATH = re.compile(r"(?<![\w.])(?:[A-Za-z]:)?(?:[/\\][\w.~+-]+){2,}")


def chapter(results: Results) -> str:
    """Return the last chapter."""
    return (
        f"<section id='provenance'><h2>Provenance</h2><p>hrcneuro {__version__}. {esc(_times(results))}</p>"
        f"{_settings(results.settings)}"
        f"{fold('Whole configuration', _configuration(results.settings))}"
        f"{fold('Every entry: key, seconds, memory of its process, commit, command, versions', _entries(results))}"
        "</section>"
    )


def changed(settings: Any) -> list[tuple[str, str, str]]:
    """Return (key, the paper's value, this run's) of every setting that is not the paper's; no locations."""
    found = _changed("study", params(type(settings.study)()), params(settings.study))
    found += _changed("", params(type(settings.shared)()), params(settings.shared))
    for name in stages.NAMES:
        section, default = settings.sections[name], stages.load(name).config()
        # The shared tables stand in several sections.
        shared = {f.name for f in dataclasses.fields(default) if f.metadata.get("shared")}
        ours, theirs = ({k: v for k, v in params(c).items() if k not in shared} for c in (section, default))
        found += _changed(name, theirs, ours)
    return found


def plain(lines: Iterable[str]) -> list[str]:
    """Return sentences with the paths of this machine cut to their last part."""
    return [_PATH.sub(lambda m: re.split(r"[/\\]", m.group())[-1], line) for line in lines]


def _changed(name: str, theirs: Any, ours: Any) -> list[tuple[str, str, str]]:
    if isinstance(theirs, Mapping) and isinstance(ours, Mapping) and theirs:
        keys = list(dict.fromkeys([*theirs, *ours]))
        return [line for k in keys for line in _changed(f"{name}.{k}".lstrip("."), theirs.get(k), ours.get(k))]
    return [] if theirs == ours else [(name, _value(theirs), _value(ours))]


def _value(value: Any) -> str:
    return "none" if value is None else plain([str(value)])[0]


def _settings(settings: Any) -> str:
    rows: list[tuple[Cell, ...]] = [(key, theirs, ours) for key, theirs, ours in changed(settings)]
    text = table(["setting", "paper", "this run"], rows)
    return f"<div id='settings'><h3>Settings that are not the paper's</h3>{text or '<p>None.</p>'}</div>"


def _configuration(settings: Any) -> str:
    lines = [f"study.subjects = {list(settings.study.subjects)}", f"study.exclude = {list(settings.study.exclude)}"]
    for name in stages.NAMES:
        lines += _flat(name, params(settings.sections[name]))
    return f"<pre>{esc(chr(10).join(plain(lines)))}</pre>"


def _flat(name: str, value: Any) -> list[str]:
    if isinstance(value, Mapping) and value:
        return [line for k, v in value.items() for line in _flat(f"{name}.{k}", v)]
    return [f"{name} = {'none' if value is None else value}"]


def _times(results: Results) -> str:
    seconds: dict[str, float] = {}
    for stage, unit in results.done:
        about = results.record(stage, unit).get("provenance", {})
        seconds[stage] = seconds.get(stage, 0.0) + float(about.get("seconds", 0.0))
    parts = ", ".join(f"{s} {seconds[s]:.0f} s" for s in stages.NAMES if s in seconds)
    seeds = sorted({f"{s}.seed = {c.seed}" for s, c in results.settings.sections.items() if hasattr(c, "seed")})
    return f"Computing time, all subjects: {parts or 'none'}. Seeds: {', '.join(seeds)}."


def _entries(results: Results) -> str:
    rows: list[list[Cell]] = []
    for (stage, unit), item in sorted(results.done.items()):
        about = results.record(stage, unit).get("provenance", {})
        versions = ", ".join(f"{k} {v}" for k, v in about.get("versions", {}).items())
        commit = f"{str(about.get('commit', ''))[:10]}{' (changed)' if about.get('dirty') else ''}"
        command = plain([str(about.get("command", ""))])[0]
        seconds = f"{about.get('seconds', 0):.1f}"
        rows.append([stage, unit, item.key, seconds, str(about.get("peak_rss_mb", "")), commit, command, versions])
    return table(["stage", "unit", "key", "s", "MB", "commit", "command", "versions"], rows)
