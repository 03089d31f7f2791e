"""How large a screen's pixels are, found with a bank card: a person makes a rectangle on the screen as large as it.

Bank cards, driving licences and identity cards are 85.60 mm × 53.98 mm (ISO/IEC 7810, ID-1).
"""

from __future__ import annotations

import pygame

from hrcneuro.errors import HardwareError
from hrcneuro.experiment.parameters import WindowOptions
from hrcneuro.experiment.window import colours, words
from hrcneuro.experiment.window.layout import laid_out

CARD_CM = (8.560, 5.398)
_FIRST = 37.8  # pixels per cm that are tried first: 96 per inch
_LEAST = 40  # pixels
_REPEAT_MS = (300, 25)
_STEPS = {pygame.KSCAN_RIGHT: 1, pygame.KSCAN_LEFT: -1, pygame.KSCAN_UP: 10, pygame.KSCAN_DOWN: -10}
_ACCEPT = (pygame.KSCAN_RETURN, pygame.KSCAN_KP_ENTER)
WORDS = (
    "Hold a bank card to the screen.",
    "Left and right arrow: narrower and wider. Down and up: the same in larger steps.",
    "Press Enter when the bright area is exactly as large as the card. Escape leaves.",
)


def measure(surface: pygame.Surface, options: WindowOptions) -> float:
    """Return the pixels in a centimetre of the screen that ``surface`` is the window on.

    Raises:
        HardwareError: The person left with Escape, or closed the window.
    """
    layout = laid_out(surface.get_size(), 100 * _FIRST, options.rotate)
    widest = _widest(layout.size)
    width = min(widest, round(CARD_CM[0] * _FIRST))
    pygame.key.set_repeat(*_REPEAT_MS)
    try:
        while True:
            shown = pygame.transform.rotate(picture(layout.size, width, options.font), -options.rotate)
            surface.blit(shown, (0, 0))
            pygame.display.flip()
            step = _step(pygame.event.wait())
            if step is None:
                return width / CARD_CM[0]
            width = max(_LEAST, min(widest, width + step))
    finally:
        pygame.key.set_repeat()


def picture(size: tuple[int, int], width: int, font: str = "") -> pygame.Surface:
    """Return the picture with a card ``width`` pixels wide, below the words."""
    surface = pygame.Surface(size)
    surface.fill(colours.BACKGROUND)
    margin = size[1] // 40
    room = size[0] - 2 * margin, _room(size)
    placed = words.set_words("", WORDS, (margin, margin, *room), size[1] / 60, colours.TEXT, font).placed
    surface.blits(placed)
    height = round(width * CARD_CM[1] / CARD_CM[0])
    card = pygame.Rect(0, 0, width, height)
    card.midtop = size[0] // 2, room[1] + 2 * margin
    surface.fill(colours.PATH, card)
    return surface


def _room(size: tuple[int, int]) -> int:
    # The card may take three fifths of the height.
    return size[1] * 2 // 5 - 3 * (size[1] // 40)


def _widest(size: tuple[int, int]) -> int:
    margin = size[1] // 40
    high = size[1] - _room(size) - 3 * margin
    return min(size[0] - 2 * margin, int(high * CARD_CM[0] / CARD_CM[1]))


def _step(event: pygame.Event) -> int | None:
    """Return by how many pixels the card is made wider; None where it fits."""
    if event.type == pygame.QUIT or (event.type == pygame.KEYDOWN and event.scancode == pygame.KSCAN_ESCAPE):
        raise HardwareError(
            "the size of the screen's pixels is not known: the calibration was left",
            cure="do it with a bank card, or measure 10 cm on the screen: experiment.window.pixels_per_cm = …",
        )
    if event.type != pygame.KEYDOWN:
        return 0
    return None if event.scancode in _ACCEPT else _STEPS.get(event.scancode, 0)
