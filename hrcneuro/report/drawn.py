"""The figures that the report draws itself, since they join stages or subjects; and all figures as files."""

from __future__ import annotations

import importlib
import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcneuro import drawings
from hrcneuro.report.results import Figure, Results


@dataclass(frozen=True)
class Drawing:
    """A figure: its name, the chapter it belongs to, the module that draws it, what it is made of, its caption."""

    name: str
    chapter: str
    module: str
    stages: tuple[str, ...]
    title: str
    caption: str


_SIGNIFICANT = (
    "Above: maps of the difference, white: significant electrodes. Middle: one channel, mean ± standard error over "
    "subjects, takeover in colour, continuation in grey, grey spans significant. Below: the significant difference of "
    "wavelet magnitudes that is largest over the channels. Hatched: the next onset may fall here, so that its response "
    "may be mixed in. The figure's foot names the tests; the paper's own (its S2) is not at hand."
)
DRAWINGS = (
    Drawing(
        "quality_group",
        "preprocess",
        "fig_quality",
        ("acquire", "preprocess"),
        "Signal quality",
        "Left: normalised kurtosis of every channel, replaced ones crossed. Middle and right, from 90 s in the middle "
        "of up to four recordings, no excluded ones: spectra and the mean blink, as recorded and clean.",
    ),
    Drawing("fig2", "erp", "fig_cases", ("erp", "ersp"), "Fig 2", f"Both scenarios together. {_SIGNIFICANT}"),
    Drawing("fig3", "erp", "fig_cases", ("erp", "ersp"), "Fig 3", f"Each scenario alone. {_SIGNIFICANT}"),
    Drawing(
        "moves",
        "robot",
        "fig_moves",
        ("acquire", "robot"),
        "Moves of all subjects",
        "Time from onset to onset; distance of the tip from the reference, a line a subject (dashed: the 2 mm radius); "
        "arrival in the radius as a share of t_f (Eq 2 gives 0.847); delay from marker to motion.",
    ),
)


def draw_all(results: Results, folder: Path) -> dict[str, tuple[Drawing, Path]]:
    """Return name -> drawing and PNG, drawing (PNG and PDF) only those whose data or code have changed."""
    from hrcneuro.figures.style import save

    stamps = _read(folder / ".stamps")
    fresh: dict[str, str] = {}
    found = {}
    for drawing in DRAWINGS:
        stamp = _stamp(results, drawing)
        png = folder / f"{drawing.name}.png"
        if not (png.is_file() and png.with_suffix(".pdf").is_file() and stamps.get(drawing.name) == stamp):
            for path in (png, png.with_suffix(".pdf")):
                path.unlink(missing_ok=True)
            figure = _draw(drawing, results)
            if figure is None:
                continue
            folder.mkdir(parents=True, exist_ok=True)
            save(figure, png)
        fresh[drawing.name] = stamp
        found[drawing.name] = (drawing, png)
    if fresh or stamps:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".stamps").write_text(json.dumps(fresh, indent=1), encoding="utf-8")
    return found


def collect(figures: list[Figure], folder: Path) -> None:
    """Copy the stages' pictures, PNG and PDF, to where people look for them."""
    wanted = set()
    for figure in figures:
        place = folder if figure.unit == "group" else folder / figure.unit
        for source in (figure.path, figure.path.with_suffix(".pdf")):
            target = place / (source.name if figure.stage in drawings.JOINT else f"{figure.stage}_{source.name}")
            wanted.add(target)
            if target.is_file() and target.stat().st_mtime_ns == source.stat().st_mtime_ns:
                continue
            place.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)
    for stale in {*folder.glob("*/*.png"), *folder.glob("*/*.pdf")} - wanted:
        stale.unlink()


def _draw(drawing: Drawing, results: Results) -> Any:
    module = importlib.import_module(f"hrcneuro.report.{drawing.module}")
    if drawing.module == "fig_cases":
        return module.draw(results, module.FIG_2 if drawing.name == "fig2" else module.FIG_3)
    draw: Callable[[Results], Any] = module.draw
    return draw(results)


def _stamp(results: Results, drawing: Drawing) -> str:
    from hrcneuro.cache import fingerprint
    from hrcneuro.contract import params

    package = Path(__file__).parents[1]
    made_of = {f"{s}/{u}": item.key for (s, u), item in sorted(results.done.items()) if s in drawing.stages}
    sections = {s: params(results.settings.sections[s]) for s in drawing.stages}
    code = fingerprint.code(f"hrcneuro.report.{drawing.module}", package, results.memo)
    return fingerprint.digest([made_of, sections, list(results.settings.included), code])


def _read(path: Path) -> Mapping[str, str]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
