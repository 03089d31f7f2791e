"""The files of a Curry recording beside its samples."""

from __future__ import annotations

from pathlib import Path

_OF_CDT = (".cdt.dpa", ".cdt.dpo", ".cdt.cef", ".cdt.ceo", ".cdt.hpi")
_OF_DAT = (".dap", ".rs3", ".cef", ".ceo")


def beside(path: Path) -> dict[str, Path]:
    """Return label -> file of those that are there: parameters, labels, events."""
    endings = _OF_CDT if path.suffix.lower() == ".cdt" else _OF_DAT
    files = {ending.rpartition(".")[2]: path.with_suffix(ending) for ending in endings}
    return {label: file for label, file in files.items() if file.is_file() or file.is_symlink()}


def parameter_file(path: Path) -> Path | None:
    """Return the file of the recording's parameters; None where it is missing."""
    files = beside(path)
    return next((files[label] for label in ("dpa", "dpo", "dap") if label in files), None)
