"""Recordings of many formats as one type: a file a format, and what they share in ``reading``.

Nothing heavy is imported before a file is read: every plan asks which files a recording consists of.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.sources.formats.companions import companions
from hrcneuro.sources.formats.statements import statements
from hrcneuro.sources.origin import marked
from hrcneuro.sources.pointers import refuse_pointer

if TYPE_CHECKING:
    from hrcneuro.sources.recording import Recording

_MODULES = {
    ".vhdr": "brainvision",
    ".ahdr": "brainvision",
    ".set": "eeglab",
    ".fif": "fif",
    ".fif.gz": "fif",
    ".edf": "edf",
    ".bdf": "edf",
    ".xdf": "xdf",
    ".xdfz": "xdf",
    ".xdf.gz": "xdf",
    ".gdf": "gdf",
    ".cnt": "cnt",
    ".raw": "egi",
    ".cdt": "curry",
    ".nedf": "nedf",
    ".dat": "dat",
    ".csv": "table",
    ".txt": "table",
}
_OPTIONS = {
    "xdf": ("stream", "stream_rate", "rate_tolerance"),
    "table": ("columns", "table_rate", "time_column", "marker_column", "unit", "rate_tolerance"),
}
READABLE = tuple(_MODULES)
"""The endings of the files that a user would open."""
OPTIONS = tuple(dict.fromkeys(name for names in _OPTIONS.values() for name in names))
"""The options of a study that a format has a use for while it is read."""
_AMBIGUOUS = (".csv", ".txt", ".dat", ".raw")


def is_recording(path: Path) -> bool:
    """Return whether a file is one that a user would open, by its name alone; other things end like a table, too."""
    return path.name.lower().endswith(READABLE) and not path.name.lower().endswith(_AMBIGUOUS)


def read_recording(path: Path, **options: Any) -> Recording:
    """Return the recording in a file of any format that can be read.

    Args:
        path: The file that a user would open, of an ending in :data:`READABLE`.
        options: Of those in :data:`OPTIONS`; each format takes what :func:`hrcneuro.sources.formats.xdf.read` and
            :func:`hrcneuro.sources.formats.table.read` have, the others none.

    Raises:
        DataError: The file is a pointer, a broken link, truncated, unreadable or holds epochs instead of a recording.
    """
    for file in (path, *companions(path).values()):
        refuse_pointer(file)
    ending = next(e for e in READABLE if path.name.lower().endswith(e))
    module = import_module(f"hrcneuro.sources.formats.{_MODULES[ending]}")
    taken = _OPTIONS.get(_MODULES[ending], ())
    recording: Recording = module.read(path, **{name: options[name] for name in taken if name in options})
    recording.origins = marked(statements(path))
    return recording
