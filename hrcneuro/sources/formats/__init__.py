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
}
READABLE = tuple(_MODULES)
"""The endings of the files that a user would open."""


def read_recording(path: Path, **xdf: Any) -> Recording:
    """Return the recording in a BrainVision, EEGLAB, FIF, EDF, BDF or XDF file.

    Args:
        path: The file that a user would open, of an ending in :data:`READABLE`.
        xdf: ``stream``, ``stream_rate`` and ``rate_tolerance``, as :func:`hrcneuro.sources.formats.xdf.read` has them.

    Raises:
        DataError: The file is a pointer, a broken link, truncated, unreadable or holds epochs instead of a recording.
    """
    for file in (path, *companions(path).values()):
        refuse_pointer(file)
    ending = next(e for e in READABLE if path.name.lower().endswith(e))
    module = import_module(f"hrcneuro.sources.formats.{_MODULES[ending]}")
    recording: Recording = module.read(path, **xdf) if module.__name__.endswith("xdf") else module.read(path)
    recording.origins = marked(statements(path))
    return recording
