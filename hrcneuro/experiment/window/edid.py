"""How large a screen is, by what it says of itself: EDID, the 128 bytes that every screen sends to its computer.

VESA Enhanced EDID Standard, Release A, Revision 2 (2006): bytes 21 and 22 hold the size in whole centimetres, the
detailed timings from byte 54 on the pixels and the size in millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

CONNECTORS = Path("/sys/class/drm")
"""Where Linux keeps what the screens have said."""

_HEADER = bytes((0, 255, 255, 255, 255, 255, 255, 0))
_TIMINGS = range(54, 126, 18)
_OBLIQUE = 0.03  # pixels are square; by more than this, what a screen says is no size but a ratio, or wrong


@dataclass(frozen=True)
class Screen:
    """A screen by its own words.

    Attributes:
        pixels: Width and height that it has by nature.
        size_mm: Width and height of its picture.
    """

    pixels: tuple[int, int]
    size_mm: tuple[int, int]

    @property
    def pixels_per_metre(self) -> float:
        """Pixels in a metre, along the width."""
        return 1000.0 * self.pixels[0] / self.size_mm[0]


def parse(edid: bytes) -> Screen | None:
    """Return the screen that an EDID describes; None where it does not say a size that can be believed.

    Not believed are: a wrong checksum; no size, as projectors have it; pixels that would not be square; millimetres
    and centimetres that contradict each other.
    """
    if len(edid) < 128 or edid[:8] != _HEADER or sum(edid[:128]) % 256:
        return None
    timing = next((edid[at : at + 18] for at in _TIMINGS if edid[at] or edid[at + 1]), None)
    if timing is None:
        return None
    pixels = timing[2] | (timing[4] >> 4) << 8, timing[5] | (timing[7] >> 4) << 8
    size_mm = timing[12] | (timing[14] >> 4) << 8, timing[13] | (timing[14] & 15) << 8
    if not all(pixels) or not all(size_mm):
        return None
    if any(abs(10 * cm - mm) > 10 for cm, mm in zip(edid[21:23], size_mm, strict=True)):
        return None
    across, down = (n / mm for n, mm in zip(pixels, size_mm, strict=True))
    return Screen(pixels, size_mm) if abs(across / down - 1) <= _OBLIQUE else None


def connected(folder: Path = CONNECTORS) -> list[Screen | None]:
    """Return the connected screens; None for each that does not say its size."""
    screens = []
    for connector in sorted(folder.glob("card*-*")):
        try:
            if (connector / "status").read_text().strip() == "connected":
                screens.append(parse((connector / "edid").read_bytes()))
        except OSError:
            continue
    return screens


def pixels_per_metre(pixels: tuple[int, int], screens: list[Screen | None]) -> float | None:
    """Return how many pixels of a screen make a metre; None where that is not known for certain.

    Which screen is which is told by its pixels alone. So every screen must be known that may be this one, those that
    show these pixels must agree, and a screen that shows other pixels than its own is not known.

    Args:
        pixels: Width and height of the screen, as the window system has it.
        screens: Those that are connected.
    """
    if any(screen is None for screen in screens):
        return None
    found = {screen.pixels_per_metre for screen in screens if screen is not None and screen.pixels == pixels}
    return found.pop() if len(found) == 1 else None
