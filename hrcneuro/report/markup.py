"""Small pieces of HTML."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Raw:
    """Text that is HTML already."""

    text: str


Cell = str | int | float | Raw


def esc(text: object) -> str:
    """Return text safe for HTML, quotes included."""
    return html.escape(str(text))


def show(cell: Cell) -> str:
    """Return a cell's HTML."""
    return cell.text if isinstance(cell, Raw) else esc(cell)


def table(head: Sequence[str], rows: Iterable[Sequence[Cell]], *, cards: bool = False) -> str:
    """Return a table that scrolls sideways where it is too wide; ``cards`` stacks its cells on a phone."""
    top = "".join(f"<th>{esc(name)}</th>" for name in head)
    body = []
    for row in rows:
        if len(row) == 1:
            body.append(f"<tr class='group'><th colspan='{len(head)}'>{show(row[0])}</th></tr>")
            continue
        cells = "".join(f"<td data-l='{esc(name)}'>{show(c)}</td>" for name, c in zip(head, row, strict=True))
        body.append(f"<tr>{cells}</tr>")
    kind = " class='cards'" if cards else ""
    return (
        f"<div class='wide'><table{kind}><thead><tr>{top}</tr></thead><tbody>{''.join(body)}</tbody></table></div>"
        if body
        else ""
    )


def items(lines: Iterable[str]) -> str:
    """Return a list; nothing without lines."""
    found = "".join(f"<li>{esc(line)}</li>" for line in lines)
    return f"<ul>{found}</ul>" if found else ""


def fold(title: str, inside: str, *, kind: str = "") -> str:
    """Return something to unfold; nothing where it would be empty."""
    name = f" class='{kind}'" if kind else ""
    return f"<details{name}><summary>{esc(title)}</summary>{inside}</details>" if inside else ""


def link(anchor: str, text: str) -> Raw:
    """Return a link within the page."""
    return Raw(f"<a href='#{esc(anchor)}'>{esc(text)}</a>")
