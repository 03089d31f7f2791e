"""The report: one page that lets a reader judge a run, and its figures as files. A leaf: no stage ever reads it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any


def write_report(settings: Any, items: Sequence[Any], path: Path) -> Path:
    """Write the page unless it already shows exactly these results; return where it lies.

    The figures lie beside it, in ``figures/``, each as PNG and PDF, and so does ``report.json``: what it shows.
    """
    from hrcneuro.cache import fingerprint
    from hrcneuro.report import shelf

    memo = fingerprint.Memo(path.parent / ".memo.json")
    stamp = _stamp(settings, items, memo)
    mark = path.with_suffix(".json")
    if path.is_file() and shelf.read(mark).get("stamp") == stamp:
        return path
    from hrcneuro.report.page import render
    from hrcneuro.report.results import Results

    html, about = render(Results(settings, items, memo), path.parent / "figures")
    shelf.write(path, html)
    noted = {"stamp": stamp, "done": shelf.done(items), "whole": shelf.is_whole(settings, items), **about}
    shelf.write(mark, json.dumps(noted, indent=1))
    memo.save()
    return path


def _stamp(settings: Any, items: Sequence[Any], memo: Any) -> str:
    from hrcneuro import __version__
    from hrcneuro.cache import fingerprint
    from hrcneuro.contract import params
    from hrcneuro.report import shelf

    package = Path(__file__).parents[1]
    return fingerprint.digest(
        {
            "items": {f"{i.stage}/{i.unit}": _shown(i) for i in items},
            "code": fingerprint.code("hrcneuro.report.page", package, memo),
            "layout": {p.name: fingerprint.file_digest(p) for p in _layout()},
            "version": __version__,
            "study": params(settings.study),
            "name": shelf.name(settings),
            "sections": {name: params(section) for name, section in settings.sections.items()},
        }
    )


def _layout() -> list[Path]:
    """Return the files that the page is made of beside code: templates, style and script."""
    folder = Path(__file__).parent
    return [*sorted((folder / "templates").rglob("*.html")), folder / "page.css", folder / "page.js"]


def _shown(item: Any) -> list[Any]:
    done = item.state in ("hit", "ran")
    # Why something ran is shown nowhere, and is forgotten by the next run; why something is missing is shown.
    return [item.key, done, [] if done else item.why]
