"""Pictures inside the page: shrunk to fit a size that a mail or a phone can carry."""

from __future__ import annotations

import base64
import hashlib
import io
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

BUDGET = 24_000_000  # characters of base64
_SMALL = 200_000  # bytes
_WHITE = 250
_MARK = re.compile(r"\{\{picture:[0-9a-f]{16}\}\}")
# So many colours, and one of so many pixels a side.
Form = tuple[int, int]
# Forms of the group's pictures and of the subjects', in the order in which they are given up; None: left out.
_STEPS: tuple[tuple[Form, Form | None], ...] = (
    ((256, 1), (128, 2)),
    ((256, 1), (64, 2)),
    ((128, 1), (32, 3)),
    ((128, 1), None),
    ((64, 2), None),
)


@dataclass(frozen=True)
class _Picture:
    path: Path
    subject: bool


class Album:
    """Hands out a mark for every picture, and replaces the marks once all are known.

    Attributes:
        budget: How many characters the pictures may take in the page.
    """

    def __init__(self, budget: int = BUDGET) -> None:
        self.budget = budget
        self._pictures: dict[str, _Picture] = {}

    def mark(self, path: Path, *, subject: bool) -> str:
        """Return what stands for a picture in the page until :meth:`fill`; equal pictures share it.

        Args:
            path: Of the PNG.
            subject: Whether it is one of the subjects' pictures, which are given up before the group's.
        """
        name = f"{{{{picture:{hashlib.sha256(path.read_bytes()).hexdigest()[:16]}}}}}"
        known = self._pictures.get(name)
        self._pictures[name] = _Picture(path, subject and (known is None or known.subject))
        return name

    def fill(self, page: str) -> str:
        """Return the page with its pictures, as large as the budget allows."""
        data = self._encoded()
        return _MARK.sub(lambda mark: data[mark[0]], page)

    def _encoded(self) -> dict[str, str]:
        """Return mark -> data URI, in the first form in which all pictures keep to the budget, or in the last."""
        uris: dict[str, str] = {}
        for group, subject in _STEPS:
            forms = {name: subject if p.subject else group for name, p in self._pictures.items()}
            paths = [self._pictures[name].path for name in forms]
            with ThreadPoolExecutor() as pool:
                uris = dict(zip(forms, pool.map(_uri, paths, forms.values()), strict=True))
            # Marks that stand several times in the page cost once each; subjects' pictures stand once.
            if sum(map(len, uris.values())) <= self.budget:
                break
        return uris


def _uri(path: Path, form: Form | None) -> str:
    if form is None:
        return _LEFT_OUT
    colours, apart = form
    # To open a picture takes longest: what is small already goes in as it is.
    whole = form in _STEPS[0] and path.stat().st_size < _SMALL
    data = path.read_bytes() if whole else _shrunk(path, colours, apart)
    return f"data:image/png;base64,{base64.b64encode(data).decode()}"


def _shrunk(path: Path, colours: int, apart: int) -> bytes:
    from PIL import Image

    with Image.open(path) as picture:
        image = picture.convert("RGB").reduce(apart)
    few = image.quantize(colours, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    # The page is white; the paper of a figure must not stand out by a shade.
    few.putpalette([255 if part >= _WHITE else part for part in few.getpalette() or ()])
    stream = io.BytesIO()
    few.save(stream, "PNG")
    return stream.getvalue()


# A transparent dot: the caption stays, and the page says where the files lie.
_LEFT_OUT = "data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7"
