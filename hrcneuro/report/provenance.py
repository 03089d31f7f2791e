"""Where every figure comes from: versions, settings, keys, seeds, times; and no path of the machine."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable, Mapping
from typing import Any

from hrcneuro import stages
from hrcneuro.contract import params
from hrcneuro.pipeline.anonymous import anonymous
from hrcneuro.report.markup import Cell, PageTable
from hrcneuro.report.results import Results

_PATH = re.compile(r"(?<![\w.])(?:[A-Za-z]:)?(?:[/\\][\w.~+-]+){2,}")


def chapter(results: Results) -> dict[str, Any]:
    """Return what the last chapter's template is given."""
    return {
        "times": _times(results),
        "changed": PageTable(["setting", "paper", "this run"], changed(results.settings)),
        "configuration": plain(_configuration(results.settings)),
        "entries": _entries(results),
    }


def changed(settings: Any) -> list[tuple[str, str, str]]:
    """Return (key, the paper's value, this run's) of every setting that is not the paper's; no locations."""
    lines = _changed("study", params(type(settings.study)()), params(settings.study))
    lines += _changed("", params(type(settings.shared)()), params(settings.shared))
    for name in stages.NAMES:
        section, default = settings.sections[name], stages.load(name).config()
        # The shared tables stand in several sections.
        shared = {f.name for f in dataclasses.fields(default) if f.metadata.get("shared")}
        ours, theirs = ({k: v for k, v in params(c).items() if k not in shared} for c in (section, default))
        lines += _changed(name, theirs, ours)
    return lines


def plain(lines: Iterable[str]) -> list[str]:
    """Return sentences with the paths of this machine cut to their last part, and without its name and user."""
    cut = (_PATH.sub(lambda m: re.split(r"[/\\]", m.group())[-1], anonymous(line)) for line in lines)
    return [line.replace("…/", "") for line in cut]


def _changed(name: str, theirs: Any, ours: Any) -> list[tuple[str, str, str]]:
    if isinstance(theirs, Mapping) and isinstance(ours, Mapping) and theirs:
        keys = list(dict.fromkeys([*theirs, *ours]))
        return [line for k in keys for line in _changed(f"{name}.{k}".lstrip("."), theirs.get(k), ours.get(k))]
    return [] if theirs == ours else [(name, _value(theirs), _value(ours))]


def _value(value: Any) -> str:
    return "none" if value is None else plain([str(value)])[0]


def _configuration(settings: Any) -> list[str]:
    lines = [f"study.subjects = {list(settings.study.subjects)}", f"study.exclude = {list(settings.study.exclude)}"]
    for name in stages.NAMES:
        lines += _flat(name, params(settings.sections[name]))
    return lines


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


def _entries(results: Results) -> PageTable:
    rows: list[list[Cell]] = []
    for (stage, unit), item in sorted(results.done.items()):
        about = results.record(stage, unit).get("provenance", {})
        versions = ", ".join(f"{k} {v}" for k, v in about.get("versions", {}).items())
        commit = f"{str(about.get('commit', ''))[:10]}{' (changed)' if about.get('dirty') else ''}"
        command = plain([str(about.get("command", ""))])[0]
        seconds = f"{about.get('seconds', 0):.1f}"
        rows.append([stage, unit, item.key, seconds, str(about.get("peak_rss_mb", "")), commit, command, versions])
    return PageTable(["stage", "unit", "key", "s", "MB", "commit", "command", "versions"], rows)
