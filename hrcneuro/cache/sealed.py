"""A sealed text in the form in which records are written, read in pieces: what many of them share is parsed once.

Of a study of hundreds, thousands of records say the same of the code, the options and the libraries of a stage. To
parse each whole, and to write each anew in canonical form for its seal, takes most of what a status takes.

Why that reading cannot differ from a plain one: the text is cut behind commas, and each piece must be a list of members
by itself; then the whole is the list of all of them, wherever the cuts were. The digest is that of the text without
blanks. A record as it was written has a canonical text but for its blanks; so one of which blanks alone were changed
passes here, as it does where it is read plainly, and of one that an accident changed otherwise the digest differs, or
this reading does not apply. (No seal tells a forger, who can seal what he likes.)
"""

from __future__ import annotations

import functools
import hashlib
import json
import re
from typing import Any

_READ = json.JSONDecoder().raw_decode
# The form of json.dumps(indent=1, sort_keys=True), of a record's members.
_HEAD, _TAIL = "{\n ", "\n}\n"
_TO_PARTS, _TO_OWN, _TO_TAIL = ',\n "parts": {\n  "', ',\n  "stage": ', '\n },\n "provenance": '
_BETWEEN = ',\n  "'
# Of a piece that many records have: in bytes, as anybody may have written it, and how many are kept.
_LONGEST, _MOST = 65_536, 256
_SHARED = ('code":', 'libs":', 'params":')
# A quote and a colon of which the quote does not end a string: it begins one, or is in one, behind a backslash.
_NO_END_OF_STRING = re.compile(r'":(?<=[\\\s\[{,:]":)')
_END_OF_LINE = re.compile("\n *")

Members = dict[str, Any]


def read(data: bytes) -> Members | None:
    """Return what a record's text holds, without its seal, which is right; None where this is for a plain reading."""
    try:
        return _read(data.decode("ascii"))
    except (ValueError, KeyError, RecursionError):
        return None


def _read(text: str) -> Members | None:
    if not (text.startswith(_HEAD) and text.endswith(_TAIL)):
        return None
    head, _, rest = text[len(_HEAD) : -len(_TAIL)].partition(_TO_PARTS)
    if not head.strip():
        return None  # a comma would stand there without a member before it
    middle, _, tail = rest.partition(_TO_TAIL)
    shared, _, own = middle.rpartition(_TO_OWN)
    parts, of_parts = _joined([*[_part(f'"{piece}') for piece in shared.split(_BETWEEN)], _parsed(f'"stage": {own}')])
    end, of_end = _parsed(f'"provenance": {tail}')
    seal = end.pop("seal")
    # Where the same stands there more than once, and the first is another's, the digest differs.
    of_end = of_end.replace(f',"seal":"{seal}"', "", 1)
    pieces = [_parsed(head), ({"parts": parts}, f'"parts":{{{of_parts}}}'), (end, of_end)]
    content, canonical = _joined(pieces)
    return content if hashlib.sha256(f"{{{canonical}}}".encode()).hexdigest() == seal else None


def _joined(pieces: list[tuple[Members, str]]) -> tuple[Members, str]:
    """Return all members of pieces, and their text; ValueError where two have one name."""
    members: Members = {}
    for some, _ in pieces:
        members.update(some)
    if len(members) != sum(len(some) for some, _ in pieces):
        raise ValueError("a name stands there twice")
    return members, ",".join([text for _, text in pieces])


def _part(piece: str) -> tuple[Members, str]:
    """Return the members of a piece of a key's parts, and their text without blanks; from memory where it may be."""
    if piece.startswith(_SHARED, 1) and len(piece) <= _LONGEST:
        return _remembered(piece)
    return _parsed(piece)


def _parsed(piece: str) -> tuple[Members, str]:
    """Return the members that a piece lists, and their text without the blanks between tokens."""
    text = f"{{{piece}}}"
    members, end = _READ(text)
    if end != len(text) or _NO_END_OF_STRING.search(text):
        raise ValueError("it is no list of members, or may have blanks in a string that look like those between tokens")
    # In JSON no string has an end of a line in it.
    return members, _END_OF_LINE.sub("", text[1:-1]).replace('": ', '":')


_remembered = functools.lru_cache(_MOST)(_parsed)
