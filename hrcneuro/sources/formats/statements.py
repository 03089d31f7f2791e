"""What a recording says of itself in words: comments of its header, and of the BIDS data set that it lies in."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hrcneuro.sources.formats.brainvision_text import decode
from hrcneuro.sources.formats.packed import unpacked

# A stream's description stands at the beginning of an XDF file, before its samples.
_XDF_BYTES = 4_000_000
# Patient and recording of EDF and BDF: eighty letters each, after eight of the version.
_EDF_WORDS = slice(8, 168)


def statements(path: Path) -> list[str]:
    """Return the texts that go with a recording; none of a file that holds none or cannot be read.

    Args:
        path: As for :func:`hrcneuro.sources.formats.read_recording`.
    """
    name = path.name.lower()
    ending = next((one for one in _IN_FILE if name.endswith(one)), "")
    texts = [_IN_FILE[ending](path)] if ending else []
    return texts + [file.read_text(encoding="utf-8", errors="replace") for file in describing_files(path).values()]


def describing_files(path: Path) -> dict[str, Path]:
    """Return label -> file of a BIDS data set that describes the recording: its sidecars, and the data set's own two.

    A sidecar further up counts for every recording whose name has all parts of its own (``task-x_eeg.json``).
    """
    base = re.sub(r"_eeg\.[a-z.]+$", "", path.name, flags=re.IGNORECASE)
    files = {"sidecar": path.with_name(f"{base}_eeg.json")} if base != path.name else {}
    root = next((one for one in path.absolute().parents if (one / "dataset_description.json").is_file()), None)
    if root is not None:
        if base != path.name:
            for folder in (one for one in path.absolute().parents if one == root or root in one.parents):
                shared = [f for f in folder.glob("*eeg.json") if {*f.stem.split("_")} <= {*base.split("_"), "eeg"}]
                files |= {str(f.relative_to(root)): f for f in sorted(shared) if f.name != f"{base}_eeg.json"}
        names = ("dataset_description.json", "README", "README.md", "README.txt", "README.rst")
        files |= {name: root / name for name in names}
    return {label: file for label, file in files.items() if file.is_file()}


def set_comments(path: Path) -> str:
    """Return the comments of an EEGLAB data set as one line; empty where it has none that can be read."""
    try:
        found = _matlab(path, "comments", "EEG")
    except Exception:
        # A file of another kind, a Git LFS pointer, damage: reading the recording says what is wrong.
        return ""
    comments = found.get("comments")
    if comments is None and isinstance(found.get("EEG"), dict):
        comments = found["EEG"].get("comments")
    return re.sub(r"\s+", " ", " ".join(_lines(comments)))


def _matlab(path: Path, *names: str) -> dict[str, Any]:
    """Return these variables of a MATLAB file, of the old format or of 7.3."""
    from scipy.io import loadmat

    try:
        return dict(loadmat(path, variable_names=names, appendmat=False, simplify_cells=True))
    except NotImplementedError:
        from pymatreader import read_mat

        return dict(read_mat(str(path), variable_names=names))


def _lines(comments: Any) -> list[str]:
    """Return MATLAB's text, which is one line or an array of them."""
    if comments is None:
        return []
    if isinstance(comments, str):
        return [comments]
    return [str(one) for one in getattr(comments, "flat", comments)]


def _fif(path: Path) -> str:
    import mne

    return str(mne.io.read_info(path, verbose="error")["description"] or "")


def _edf(path: Path) -> str:
    with path.open("rb") as file:
        return file.read(_EDF_WORDS.stop)[_EDF_WORDS].decode("latin-1")


def _xdf(path: Path) -> str:
    with unpacked(path) as file:
        return file.read(_XDF_BYTES).decode("latin-1")


def _header(path: Path) -> str:
    return decode(path.read_bytes())


_IN_FILE = {
    ".vhdr": _header,
    ".ahdr": _header,
    ".set": set_comments,
    ".fif": _fif,
    ".fif.gz": _fif,
    ".edf": _edf,
    ".bdf": _edf,
    ".xdf": _xdf,
    ".xdfz": _xdf,
    ".xdf.gz": _xdf,
}
