"""The other files that a recording consists of: what a reader opens decides the result, so it belongs in the key."""

from __future__ import annotations

import re
from pathlib import Path

from hrcneuro.sources.formats import brainvision_text, eeglab_names


def companions(path: Path) -> dict[str, Path]:
    """Return label -> file that is read beside a recording's own: data, markers, ``.fdt``, parts of a split FIF.

    A link to a file that is not here is among them; a file that is named and missing is not.
    """
    ending = path.suffix.lower()
    files: dict[str, Path | None] = {}
    if ending in brainvision_text.HEADERS:
        named = brainvision_text.named_files(path, brainvision_text.read_sections(path))
        files = {"data": named.data, "markers": named.markers}
    elif ending == ".set":
        files = {"fdt": eeglab_names.data_files(path).data}
    elif ending == ".fif":
        parts = re.compile(re.escape(path.stem) + r"-\d+\.fif")
        files = {p.name.removeprefix(path.stem): p for p in path.parent.iterdir() if parts.fullmatch(p.name)}
    return {label: file for label, file in files.items() if file is not None}
