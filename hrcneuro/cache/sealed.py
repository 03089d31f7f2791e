"""The text of a record: its members, and last the seal, the hash of all that stands before; read in pieces.

Of a study of hundreds, thousands of records say the same of the code, the options and the libraries of a stage: what
many of them share is parsed once and kept once. The text is cut behind commas, and each piece must be a list of members
by itself; then the whole is the list of all of them, wherever the cuts were, and this reading finds what a plain one
does. (No seal tells a forger, who can seal what he likes.)
"""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Mapping
from typing import Any

_READ = json.JSONDecoder().raw_decode
# The form of json.dumps(indent=1, sort_keys=True), of a record's members; the seal comes behind them.
_HEAD, _TAIL = "{\n ", "\n}"
_TO_SEAL, _END = ',\n "seal": "', '"\n}\n'
_TO_PARTS, _TO_OWN, _TO_TAIL = ',\n "parts": {\n  "', ',\n  "stage": ', '\n },\n "provenance": '
_BETWEEN = ',\n  "'
# Of a piece that many records have: in bytes, as anybody may have written it, and how many are kept.
_LONGEST, _MOST = 65_536, 256
_SHARED = ('code":', 'libs":', 'params":')

Members = dict[str, Any]


def write(content: Mapping[str, Any]) -> str:
    """Return the text of a record with its seal."""
    body = _body(content)
    return f"{body.removesuffix(_TAIL)}{_TO_SEAL}{_hash(body)}{_END}"


def seal_of(content: Mapping[str, Any]) -> str:
    """Return the seal that :func:`write` gives a content."""
    return _hash(_body(content))


def read(data: bytes) -> Members | None:
    """Return what a record's text holds, without its seal, which is right; None where this is for a plain reading."""
    try:
        return _read(data.decode("ascii"))
    except (ValueError, RecursionError):
        return None


def _body(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=1, sort_keys=True)


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _read(text: str) -> Members | None:
    body, _, seal = text.rpartition(_TO_SEAL)
    if not (body.startswith(_HEAD) and seal.endswith(_END) and _hash(body + _TAIL) == seal.removesuffix(_END)):
        return None
    head, _, rest = body[len(_HEAD) :].partition(_TO_PARTS)
    if not head.strip():
        return None  # a comma would stand there without a member before it
    middle, _, tail = rest.partition(_TO_TAIL)
    shared, _, own = middle.rpartition(_TO_OWN)
    parts = _joined([*[_part(f'"{piece}') for piece in shared.split(_BETWEEN)], _parsed(f'"stage": {own}')])
    return _joined([_parsed(head), {"parts": parts}, _parsed(f'"provenance": {tail}')])


def _joined(pieces: list[Members]) -> Members:
    """Return all members of pieces; ValueError where two have one name."""
    members: Members = {}
    for some in pieces:
        members.update(some)
    if len(members) != sum(map(len, pieces)):
        raise ValueError("a name stands there twice")
    return members


def _part(piece: str) -> Members:
    """Return the members of a piece of a key's parts; from memory where it may be."""
    if piece.startswith(_SHARED, 1) and len(piece) <= _LONGEST:
        return _remembered(piece)
    return _parsed(piece)


def _parsed(piece: str) -> Members:
    """Return the members that a piece lists."""
    text = f"{{{piece}}}"
    members: Members
    members, end = _READ(text)
    if end != len(text):
        raise ValueError("it is no list of members")
    return members


_remembered = functools.lru_cache(_MOST)(_parsed)
