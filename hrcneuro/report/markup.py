"""Data to HTML: the templates, which escape all that they are given, and the tables that are handed to them."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup


@dataclass(frozen=True)
class NotedCell:
    """A cell with a line in small letters below its text."""

    text: str
    note: str


Cell = str | int | float | NotedCell


@dataclass(frozen=True)
class PageTable:
    """A table of the page.

    Raises:
        ValueError: A row is longer or shorter than the head.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.head):
                raise ValueError(f"a row of {len(row)} cells under a head of {len(self.head)}: {row}")


def render(template: str, **values: Any) -> Markup:
    """Return a template's HTML, safe within another template; a value that it lacks is an error."""
    from markupsafe import Markup

    return Markup(_environment().get_template(template).render(values))  # escaped by the template


def own(name: str) -> Markup:
    """Return a file of this package, such as the style sheet, for a page as it is, without escapes."""
    from importlib.resources import files

    from markupsafe import Markup

    return Markup(files("hrcneuro.report").joinpath(name).read_text(encoding="utf-8"))


def minus(cell: Cell) -> Cell:
    """Return a cell whose negative numbers have a minus, as on the terminal and in figures; a hyphen stays one."""
    return _NEGATIVE.sub("\N{MINUS SIGN}", cell) if isinstance(cell, str) else cell


# Not within a word (tr-1), a span (1-40), a date or an option (key=-1).
_NEGATIVE = re.compile(r"(?<![^\s(\[/+])-(?=\d)")


@functools.cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    from hrcneuro.report import glossary

    made = Environment(
        loader=PackageLoader("hrcneuro.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters["terms"] = glossary.mark
    made.filters["minus"] = minus
    return made
