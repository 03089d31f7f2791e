"""The other files that a recording consists of: what a reader opens decides the result, so it belongs in the key."""

from __future__ import annotations

import re
from pathlib import Path

from hrcneuro.sources.formats.fif_tags import parts


def companions(path: Path) -> dict[str, Path]:
    """Return label -> file that is read beside a recording's own: data, markers, ``.fdt``, parts of a split FIF."""
    name = path.name.lower()
    if name.endswith(".vhdr"):
        files = _brainvision(path)
    elif name.endswith(".set"):
        files = {"fdt": path.with_suffix(".fdt")}
    elif name.endswith((".fif", ".fif.gz")):
        files = {f"part {i}": part for i, part in enumerate(parts(path), start=2)}
    else:
        files = {}
    return {label: file for label, file in files.items() if file.is_file()}


def _brainvision(path: Path) -> dict[str, Path]:
    keys = {"DataFile": "data", "MarkerFile": "markers"}
    text = path.read_text(encoding="utf-8", errors="replace")
    named = {keys[m[1]]: m[2].strip() for m in re.finditer(r"^(DataFile|MarkerFile)=(.*)$", text, re.MULTILINE)}
    return {label: path.parent / file.replace("$b", path.stem) for label, file in named.items() if file}
