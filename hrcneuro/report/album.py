"""Pictures inside the page: shrunk to fit a size that a mail or a phone can carry."""

from __future__ import annotations

import base64
import hashlib
import io
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

BUDGET = 24_000_000  # characters of base64
# Colours and scale for the group's pictures and the subjects', in the order in which they are given up; None: left out.
_STEPS: tuple[tuple[tuple[int, float], tuple[int, float] | None], ...] = (
    ((256, 1.0), (128, 1.0)),
    ((256, 1.0), (64, 0.7)),
    ((128, 1.0), (32, 0.5)),
    ((128, 0.8), None),
    ((64, 0.5), None),
)


@dataclass(frozen=True)
class _Picture:
    path: Path
    subject: bool


class Album:
    """Hands out a mark for every picture, and replaces the marks once all are known."""

    def __init__(self, budget: int = BUDGET) -> None:
        self.budget = budget
        self._pictures: dict[str, _Picture] = {}

    def mark(self, path: Path, *, subject: bool) -> str:
        """Return what stands for a picture in the page until :meth:`fill`; equal pictures share it."""
        name = f"{{{{picture:{hashlib.sha256(path.read_bytes()).hexdigest()[:16]}}}}}"
        known = self._pictures.get(name)
        self._pictures[name] = _Picture(path, subject and (known is None or known.subject))
        return name

    def fill(self, page: str) -> str:
        """Return the page with its pictures, as large as the budget allows."""
        data = self._encoded()
        for name in self._pictures:
            page = page.replace(name, data[name])
        return page

    def _encoded(self) -> dict[str, str]:
        found: dict[str, str] = {}
        for group, subject in _STEPS:
            forms = {name: subject if p.subject else group for name, p in self._pictures.items()}
            paths = [self._pictures[name].path for name in forms]
            with ThreadPoolExecutor() as pool:
                found = dict(zip(forms, pool.map(_uri, paths, forms.values()), strict=True))
            # Marks that stand several times in the page cost once each; subjects' pictures stand once.
            if sum(map(len, found.values())) <= self.budget:
                break
        return found


def _uri(path: Path, form: tuple[int, float] | None) -> str:
    if form is None:
        return _LEFT_OUT
    from PIL import Image

    colours, scale = form
    with Image.open(path) as picture:
        image = picture.convert("RGB")
    if scale < 1:
        image = image.resize((round(image.width * scale), round(image.height * scale)), Image.Resampling.LANCZOS)
    few = image.quantize(colours, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    stream = io.BytesIO()
    few.save(stream, "PNG")
    return f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"


# A transparent dot: the caption stays, and the page says where the files lie.
_LEFT_OUT = "data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7"
