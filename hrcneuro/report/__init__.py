"""The report: one page that lets a reader judge a run. A leaf: no stage ever reads it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any


def write_report(settings: Any, items: Sequence[Any], path: Path) -> Path:
    """Write the page unless it already shows exactly these results; return where it lies."""
    from hrcneuro import __version__
    from hrcneuro.cache import fingerprint

    shown = {f"{i.stage}/{i.unit}": [i.key, i.state in ("hit", "ran")] for i in items}
    code = fingerprint.code(
        "hrcneuro.report.page", Path(__file__).parents[1], fingerprint.Memo(path.parent / ".memo.json")
    )
    stamp = fingerprint.digest({"items": shown, "code": code, "version": __version__, "study": settings.study.name})
    mark = path.with_suffix(".json")
    if path.is_file() and _read(mark) == stamp:
        return path
    from hrcneuro.report.page import render
    from hrcneuro.report.results import Results

    html = render(Results(settings, items))
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part")
    part.write_text(html, encoding="utf-8")
    part.replace(path)
    mark.write_text(json.dumps({"stamp": stamp}), encoding="utf-8")
    return path


def _read(mark: Path) -> str:
    try:
        return str(json.loads(mark.read_text(encoding="utf-8"))["stamp"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""
