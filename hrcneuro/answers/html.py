"""The same for a notebook: tables and lines as HTML, in which all text is escaped."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table with its caption above it."""
    cells = "".join(f"<th>{html.escape(text)}</th>" for text in head)
    body = "".join(f"<tr>{''.join(f'<td>{html.escape(text)}</td>' for text in row)}</tr>" for row in rows)
    return (
        f'<table><caption style="caption-side: top">{html.escape(caption)}</caption>'
        f"<thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"
    )


def preformatted(head: str, lines: Iterable[str]) -> str:
    """Return lines under a heading; their columns stay below one another, and long ones wrap."""
    text = html.escape("\n".join(lines))
    return f'<p><b>{html.escape(head)}</b></p><pre style="white-space: pre-wrap">{text}</pre>'
