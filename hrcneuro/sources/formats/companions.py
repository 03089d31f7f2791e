"""The other files that a recording consists of: what a reader opens decides the result, so it belongs in the key."""

from __future__ import annotations

from pathlib import Path

from hrcneuro.sources.formats import brainvision_text, curry_names, eeglab_names
from hrcneuro.sources.formats.fif_tags import parts
from hrcneuro.sources.formats.named import is_there


def companions(path: Path) -> dict[str, Path]:
    """Return label -> file that is read beside a recording's own: data, markers, ``.fdt``, parts of a split
    FIF, Curry's parameters and events.

    A link to a file that is not here is among them; a file that is named and missing is not.
    """
    ending = path.suffix.lower()
    files: dict[str, Path | None] = {}
    if ending in brainvision_text.HEADERS:
        named = brainvision_text.named_files(path, brainvision_text.read_sections(path))
        files = {"data": named.data, "markers": named.markers}
    elif ending == ".set":
        files = {"fdt": eeglab_names.data_files(path).data}
    elif path.name.lower().endswith((".fif", ".fif.gz")):
        files = {f"part {i}": part if is_there(part) else None for i, part in enumerate(parts(path), start=2)}
    elif ending in (".cdt", ".dat"):
        files = dict(curry_names.beside(path)) if curry_names.parameter_file(path) else {}
    return {label: file for label, file in files.items() if file is not None}
