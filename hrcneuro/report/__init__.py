"""The report: one page that lets a reader judge a run, and its figures as files. A leaf: no stage ever reads it."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any


def write_report(settings: Any, items: Sequence[Any], path: Path) -> Path:
    """Write the page unless it already shows exactly these results; return where it lies.

    The figures lie beside it, in ``figures/``, each as PNG and PDF.
    """
    from hrcneuro.cache import fingerprint

    memo = fingerprint.Memo(path.parent / ".memo.json")
    stamp = _stamp(settings, items, memo)
    mark = path.with_suffix(".json")
    if path.is_file() and _read(mark) == stamp:
        return path
    from hrcneuro.report.page import render
    from hrcneuro.report.results import Results

    html = render(Results(settings, items, memo), path.parent / "figures")
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}")
    part.write_text(html, encoding="utf-8")
    part.replace(path)
    mark.write_text(json.dumps({"stamp": stamp}), encoding="utf-8")
    memo.save()
    return path


def _stamp(settings: Any, items: Sequence[Any], memo: Any) -> str:
    from hrcneuro import __version__
    from hrcneuro.cache import fingerprint
    from hrcneuro.contract import params

    package = Path(__file__).parents[1]
    return fingerprint.digest(
        {
            "items": {f"{i.stage}/{i.unit}": _shown(i) for i in items},
            "code": fingerprint.code("hrcneuro.report.page", package, memo),
            "style": fingerprint.file_digest(Path(__file__).with_name("page.css")),
            "version": __version__,
            "study": params(settings.study),
            "sections": {name: params(section) for name, section in settings.sections.items()},
        }
    )


def _shown(item: Any) -> list[Any]:
    done = item.state in ("hit", "ran")
    # Why something ran is shown nowhere, and is forgotten by the next run; why something is missing is shown.
    return [item.key, done, [] if done else item.why]


def _read(mark: Path) -> str:
    try:
        return str(json.loads(mark.read_text(encoding="utf-8"))["stamp"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""
