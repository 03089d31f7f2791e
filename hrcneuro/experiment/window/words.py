"""Words on the screen: large enough to be read from the person's chair, wrapped, never cut.

A letter x is as high as 0.4° from 1.8 m away: 1.8 m × tan 0.4° = 12.6 mm. In the paper's cell (§ 2.3.1) the far edge of
the grid is about 1.2 m from the person's eyes (1.04 m along the table, and some 0.6 m up), and the screen lies flat,
seen at 30°, so that letters look half as high: 0.3° are left at the far edge, more everywhere else. Reading no longer
gains by larger print from 0.2° on (Legge & Bigelow, Journal of Vision 2011, doi:10.1167/11.5.8).
Where the words do not fit at that size, they are set smaller until they do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import pygame

from hrcneuro.experiment.window.colours import Colour
from hrcneuro.experiment.window.layout import Box

READING_DISTANCE_M = 1.8
X_HEIGHT_M = READING_DISTANCE_M * math.tan(math.radians(0.4))

_TITLE = 1.5  # times the size of the lines
_LEADING = 1.25  # from line to line, of the font's height
_SMALLER = 0.95
_LEAST = 6  # pixels; nothing is set smaller

Placed = tuple[pygame.Surface, tuple[int, int]]


@dataclass(frozen=True)
class Setting:
    """Words as they are set.

    Attributes:
        placed: Each line's picture, and the place of its upper left corner.
        height: Of all lines, pixels.
        share: Of the wished size; 1 where everything fits.
    """

    placed: tuple[Placed, ...]
    height: int
    share: float

    def lower(self, by: int) -> Setting:
        """Return the same words so many pixels lower."""
        placed = tuple((picture, (left, top + by)) for picture, (left, top) in self.placed)
        return Setting(placed, self.height, self.share)


@lru_cache(maxsize=64)
def font(path: str, size: int) -> pygame.font.Font:
    """Return a font of a size in pixels; without a path the one that comes with pygame-ce."""
    if not pygame.font.get_init():
        pygame.font.init()
    return pygame.font.Font(path or None, size)


@lru_cache(maxsize=64)
def size_of(path: str, x_height: int) -> int:
    """Return the size of a font, in pixels, whose letter x is at least ``x_height`` pixels high."""
    metrics = font(path, 200).metrics("x")[0]
    if metrics is None:
        return 2 * x_height
    return math.ceil(200 * x_height / max(1, metrics[3]))


def set_words(title: str, lines: tuple[str, ...], box: Box, x_height: float, colour: Colour, path: str = "") -> Setting:
    """Return a title and lines: each in the middle of a box's width, from its top on.

    Args:
        title: Set larger; may be empty.
        lines: Each begins on a line of its own; an empty one leaves a gap.
        box: Where they may lie, pixels.
        x_height: Wished height of a letter x, pixels.
        colour: Of the letters.
        path: Font file; empty for the one that comes with pygame-ce.
    """
    wished = max(_LEAST, size_of(path, max(1, math.ceil(x_height))))
    size = wished
    while True:
        wrapped = [(text, round(_TITLE * size)) for text in _wrapped(title, font(path, round(_TITLE * size)), box[2])]
        if wrapped and lines:
            wrapped.append(("", size // 2))
        wrapped += [(text, size) for line in lines for text in _wrapped(line, font(path, size), box[2], gaps=True)]
        heights = [math.ceil(_LEADING * font(path, one).get_height()) for _, one in wrapped]
        if sum(heights) <= box[3] or size <= _LEAST:
            break
        size = max(_LEAST, min(size - 1, int(_SMALLER * size)))
    placed, top = [], box[1]
    for (text, one), height in zip(wrapped, heights, strict=True):
        if text:
            picture = font(path, one).render(text, True, colour)
            placed.append((picture, (box[0] + (box[2] - picture.get_width()) // 2, top)))
        top += height
    return Setting(tuple(placed), sum(heights), size / wished)


def _wrapped(text: str, face: pygame.font.Font, width: int, *, gaps: bool = False) -> list[str]:
    """Return the text in lines that are no wider than ``width``; a word that is wider alone is broken."""
    lines: list[str] = []
    line = ""
    for word in text.split():
        longer = f"{line} {word}".strip()
        if face.size(longer)[0] <= width:
            line = longer
            continue
        if line:
            lines.append(line)
        while len(word) > 1 and face.size(word)[0] > width:
            fits = next((n for n in range(len(word) - 1, 1, -1) if face.size(word[:n])[0] <= width), 1)
            lines.append(word[:fits])
            word = word[fits:]
        line = word
    if line:
        lines.append(line)
    return lines or ([""] if gaps else [])
