"""What a plan and a status say: how things stand with each task, why, and how many there are. Items in, lines out."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from hrcneuro.contract import OF_ALL, is_piece
from hrcneuro.pipeline.item import Item, Word

Line = tuple[str, str]
"""A text and its style."""

STYLES: Mapping[str, str] = {
    Word.FRESH: "dim",
    Word.STALE: "yellow",
    Word.NEVER_RUN: "cyan",
    Word.FAILED: "bold red",
    Word.RAN: "green",
}
_REDRAW = "fresh*"


def lines(items: Iterable[Item], *, verbose: bool = False) -> list[Line]:
    """Return a line a task that is not fresh, with its first cause and a count of the rest; ``verbose`` all of both.

    Pictures that follow their numbers are left out: they are counted in the end. What something failed of is told
    behind, as an error with its cure.
    """
    return _rows([([item.unit], item) for item in _told(items, verbose=verbose)], verbose=verbose)


def merged(items: Iterable[Item], *, verbose: bool = False) -> list[Line]:
    """Return what :func:`lines` does, with one line for all units of a stage that stand alike for the same cause.

    It stands below the table, which has the word for what failed: only the error behind tells more.
    """
    alike: dict[tuple[str, str, str], list[Item]] = {}
    for item in (one for one in _told(items, verbose=verbose) if one.word is not Word.FAILED):
        alike.setdefault((item.stage, item.word, _causes(item, whole=verbose, units=False)), []).append(item)
    return _rows([([i.unit for i in group], group[0]) for group in alike.values()], verbose=verbose)


def table(items: Sequence[Item], *, width: int = 0) -> list[str]:
    """Return units and stages as a table; where it is wider than ``width`` (0: no limit), a few lines a unit.

    The pieces of a sweep are left out: they are counted in the end.
    """
    cells = {(item.unit, item.stage): item for item in items}
    names = list(dict.fromkeys(item.stage for item in items if not item.draws))
    units = {item.unit for item in items if not item.draws and not is_piece(item.unit)}
    in_order = sorted(units, key=lambda unit: (unit in OF_ALL, unit))
    rows = [["unit", *names], *([unit, *(_cell(cells, unit, name) for name in names)] for unit in in_order)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    found = ["  ".join(f"{text:<{w}}" for text, w in zip(row, widths, strict=True)).rstrip() for row in rows]
    if width and max(map(len, found)) > width:
        found = [line for row in rows[1:] for line in _unit(row[0], dict(zip(names, row[1:], strict=True)))]
    if any(_REDRAW in row for row in rows):
        found.append("* its numbers are fresh, its pictures are not: hrcneuro report draws them")
    return found


def counted(items: Iterable[Item]) -> str:
    """Return how many tasks stand how: ``1 fresh, 2 ran; pictures: 1 stale``."""
    items = list(items)
    numbers, pictures = (_counts(item for item in items if item.draws == draws) for draws in (False, True))
    return f"{numbers or 'nothing to do'}{f'; pictures: {pictures}' if pictures else ''}"


def sent_again(items: Iterable[Item]) -> str:
    """Return which tasks had to be sent to a worker again and why; empty where none had."""
    told = [f"{item.stage} of {item.unit} ({'; '.join(item.lost)})" for item in items if item.lost and item.state.done]
    return f"sent to a worker again, and complete: {', '.join(told)}" if told else ""


def span(units: Sequence[str]) -> str:
    """Return units as a few words."""
    return ", ".join(units) if len(units) <= 3 else f"{units[0]} … {units[-1]}, {len(units)} units"


def _told(items: Iterable[Item], *, verbose: bool) -> list[Item]:
    items = list(items)
    fresh = {(item.stage, item.unit) for item in items if item.word is Word.FRESH}
    follow = {
        (item.stage, item.unit)
        for item in items
        if item.draws and item.word is not Word.FAILED and (_subject(item), item.unit) not in fresh
    }
    return [
        item for item in items if verbose or (item.word is not Word.FRESH and (item.stage, item.unit) not in follow)
    ]


def _subject(item: Item) -> str:
    return item.stage.partition(".")[0]


def _rows(rows: Sequence[tuple[list[str], Item]], *, verbose: bool) -> list[Line]:
    stages = max((len(item.stage) for _, item in rows), default=0)
    names = max((len(span(units)) for units, _ in rows), default=0)
    found = []
    for units, item in rows:
        causes = _causes(item, whole=verbose, units=len(units) == 1)
        text = f"{item.stage:<{stages}}  {span(units):<{names}}  {item.word:<9}  {causes}"
        found.append((text.rstrip(), STYLES[item.word]))
    return found


def _causes(item: Item, *, whole: bool, units: bool) -> str:
    """Return why an item is not fresh: its first cause and a count of the rest, or all; ``units``: name them."""
    if item.word in (Word.FRESH, Word.FAILED):
        return ""
    causes = [_cause(text, item, units=units) for text in item.why]
    causes = [text for text in dict.fromkeys(causes) if text != item.word]
    if whole or len(causes) < 2:
        return "; ".join(causes)
    return f"{causes[0]} (and {len(causes) - 1} more)"


def _cause(text: str, item: Item, *, units: bool) -> str:
    """Return a cause in a person's words; where it names a unit that several lines would differ in, without."""
    text = re.sub(r"^(inputs: .+) would run$", r"\1 is not fresh", text)
    if units:
        return text
    return re.sub(rf"\b{re.escape(item.unit)}\b", "each", text) if item.unit in text else text


def _cell(cells: Mapping[tuple[str, str], Item], unit: str, stage: str) -> str:
    item, pictures = cells.get((unit, stage)), cells.get((unit, f"{stage}.figures"))
    if item is None:
        return ""
    redraw = item.word is Word.FRESH and pictures is not None and pictures.word is not Word.FRESH
    return _REDRAW if redraw else str(item.word)


def _unit(unit: str, cells: Mapping[str, str]) -> list[str]:
    by_word: dict[str, list[str]] = {}
    for stage, word in cells.items():
        if word:
            by_word.setdefault(word, []).append(stage)
    heads = [unit, *[""] * (len(by_word) - 1)]
    return [
        f"{head:<6} {f'{word}:':<10} {', '.join(names)}"
        for head, (word, names) in zip(heads, by_word.items(), strict=True)
    ]


def _counts(items: Iterable[Item]) -> str:
    counts = Counter(item.word for item in items)
    return ", ".join(f"{counts[word]} {word}" for word in Word if counts[word])
