"""The figures that the report draws itself, since they join stages or subjects; and all figures as files."""

from __future__ import annotations

import importlib
import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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


DRAWINGS = (
    Drawing(
        "confound_panel",
        "decode",
        "fig_confound",
        ("decode",),
        "Confound panel",
        "Is it the takeover that is decoded, or the error and the turn that go with it? Balanced accuracy of held-out "
        "trials: mean and 95 % interval over subjects, dots are subjects, triangles the smallest mean that a one-sided "
        "t test finds with 80 % power; at the right trials a class and subject. Magenta: decoders trained on all "
        "trials, scored within a stratum. After an error and after none, anticipation keeps its level (a response to "
        "turns does so, too) and a response to errors falls to 50 %; before a turn, a response to turns falls to 50 %, "
        "one to errors need not. Blue: trained on trials after no error alone, and scored on them; with fewer trials "
        "to learn from, accuracy is lost whatever is decoded. Brown: rules that never look at EEG.",
    ),
)


# Pictures that join stages, by their names -> the chapter they belong to, and the name that a link shows.
JOINT = {
    "quality_group": ("preprocess", "Signal quality"),
    "fig2": ("erp", "Fig 2"),
    "fig3": ("erp", "Fig 3"),
    "moves": ("robot", "Moves of all subjects"),
}


def joint(figures: list[Figure], folder: Path) -> dict[str, tuple[Drawing, Path]]:
    """Return name -> drawing and PNG of the pictures that join stages, copied to where people look for them."""
    drawn = {}
    for figure in figures:
        name = figure.path.stem
        chapter, title = JOINT[name]
        folder.mkdir(parents=True, exist_ok=True)
        for source in (figure.path, figure.path.with_suffix(".pdf")):
            shutil.copy2(source, folder / source.name)
        caption = f"{figure.caption}.".removeprefix(f"{title}. ")
        drawn[name] = (Drawing(name, chapter, "", (), title, caption), folder / figure.path.name)
    return drawn


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
            target = place / f"{figure.stage}_{source.name}"
            wanted.add(target)
            if target.is_file() and target.stat().st_mtime_ns == source.stat().st_mtime_ns:
                continue
            place.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)
    for stale in {*folder.glob("*/*.png"), *folder.glob("*/*.pdf")} - wanted:
        stale.unlink()


def _draw(drawing: Drawing, results: Results) -> Any:
    module = importlib.import_module(f"hrcneuro.report.{drawing.module}")
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
