"""BrainVision's two text files, header and markers, by Brain Products' core data format 1.0; nothing numeric here."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from hrcneuro.sources.formats.named import find_named

HEADERS = {".vhdr": ".vmrk", ".ahdr": ".amrk"}
"""Ending of a header -> ending of the marker file that is written with it."""


@dataclass(frozen=True)
class Marker:
    """A line of a marker file: ``position`` counts samples from one, ``size`` is a length in samples."""

    kind: str
    text: str
    position: int
    size: int


@dataclass(frozen=True)
class Files:
    """What a header names, and what is there: files are None where there is none."""

    data_name: str
    data: Path | None
    marker_name: str
    markers: Path | None
    spare: Path | None
    """Marker file of the header's own name that is not read, since the header names another."""


def read_sections(path: Path) -> dict[str, dict[str, str]]:
    """Return section -> key -> value of a header, names of sections and keys in small letters; the first of equal keys.

    The comment section at the end, which has no keys, is left out.
    """
    sections: dict[str, dict[str, str]] = {}
    for section, key, value in _entries(path):
        sections.setdefault(section, {}).setdefault(key, value)
    return sections


def read_markers(path: Path) -> tuple[list[Marker], int]:
    """Return the markers of a marker file in its order, and how many lines cannot be understood.

    Numbers of markers may repeat, as where files were joined by hand.
    """
    lines = [v for section, key, v in _entries(path) if section == "marker infos" and re.fullmatch(r"mk\d+", key)]
    markers = [one for line in lines if (one := _marker(line)) is not None]
    return markers, len(lines) - len(markers)


def _entries(path: Path) -> Iterator[tuple[str, str, str]]:
    """Yield section, key and value of each line that has a key."""
    section = ""
    for line in re.split(r"\r\n|\r|\n", decode(path.read_bytes())):
        if heading := re.fullmatch(r"\s*\[([^\]]+)\]\s*", line):
            section = heading[1].strip().lower()
            if section == "comment":
                return
        elif "=" in line and not line.lstrip().startswith(";"):
            key, _, value = line.partition("=")
            yield section, key.strip().lower(), value.strip()


def decode(raw: bytes) -> str:
    """Return the text: UTF-8 (16 with a mark) where it is that, else the code page that it names, else Windows' own.

    What is not ASCII and yet valid UTF-8 is UTF-8, whatever the file says of itself.
    """
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return raw.decode("utf-16", errors="replace")
    named = re.search(rb"^Codepage=([\w-]+)", raw, re.IGNORECASE | re.MULTILINE)
    page = named[1].decode("ascii") if named else "ANSI"
    for encoding in ("utf-8-sig", "cp1252" if page.upper() == "ANSI" else page, "cp1252"):
        try:
            return raw.decode(encoding)
        except (UnicodeDecodeError, LookupError):
            continue
    return raw.decode("latin-1")


def named_files(path: Path, sections: Mapping[str, Mapping[str, str]]) -> Files:
    """Return the data and marker files of a header; ``$b`` in a name is the header's own name.

    The marker file that the header names is the one that is read, as by the format's own programs; where it is not
    there, as after files were renamed, the one of the header's own name.
    """
    common = sections.get("common infos", {})
    data_name, marker_name = (common.get(key, "").replace("$b", path.stem) for key in ("datafile", "markerfile"))
    own = find_named(path.parent, path.stem + HEADERS.get(path.suffix.lower(), ".vmrk"))
    named = find_named(path.parent, marker_name)
    # A header that names no marker file has none: only a wrong name is made good.
    markers = named or (own if marker_name else None)
    spare = own if own is not None and named is not None and not _same(own, named) else None
    return Files(data_name, find_named(path.parent, data_name), marker_name, markers, spare)


def channel_fields(row: str) -> list[str]:
    """Return the fields of a channel's line of a header: name, reference, resolution, unit, as many as are there."""
    return [field.strip().replace(r"\1", ",") for field in row.split(",")]


def _marker(line: str) -> Marker | None:
    fields = [field.strip() for field in line.split(",")]
    if len(fields) < 3 or not re.fullmatch(r"[+-]?\d+", fields[2]):
        return None
    kind, text = (field.replace(r"\1", ",") for field in fields[:2])
    size = fields[3] if len(fields) > 3 else ""
    return Marker(kind, text, int(fields[2]), int(size) if size.isdigit() else 0)


def _same(a: Path, b: Path) -> bool:
    return a.exists() and b.exists() and a.samefile(b)
