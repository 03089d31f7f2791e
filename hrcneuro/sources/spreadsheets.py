"""Tables of text as programs and spreadsheets save them: commas, semicolons or tabs, UTF-8 or UTF-16."""

from __future__ import annotations

import codecs
import csv
import io
import re
from pathlib import Path


def opened(path: Path, *, errors: str = "strict") -> tuple[io.StringIO, str]:
    """Return a table's text and what separates its columns.

    Raises:
        UnicodeError: The text is in another encoding, and ``errors`` is ``strict``.
    """
    data = path.read_bytes()
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = data.decode("utf-16" if wide else "utf-8-sig", errors).replace("\r\n", "\n")
    # Excel marks its own separator by a first line, sep=;
    mark = re.match(r'"?sep=.?"?\n', text)
    text = text[mark.end() :] if mark else text
    header = text.partition("\n")[0]
    return io.StringIO(text), max(",;\t", key=header.count)


def rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table as plain strings, whatever else may be wrong with it."""
    content, separator = opened(path, errors="replace")
    return list(csv.DictReader(content, delimiter=separator))
