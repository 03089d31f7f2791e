"""Small pictures with smooth edges: arrow, start, goal, tool. Drawn four times too large, then shrunk; kept."""

from __future__ import annotations

import math
from functools import lru_cache

import pygame

from hrcneuro.experiment.window import colours
from hrcneuro.experiment.window.colours import Colour

_FINER = 4
_ANGLE = {"N": 0, "W": 90, "S": 180, "E": 270}  # degrees, counter-clockwise
_ARROW = ((0.5, 0.04), (0.94, 0.50), (0.66, 0.50), (0.66, 0.96), (0.34, 0.96), (0.34, 0.50), (0.06, 0.50))
_SQUARES = 4  # of the goal, a side


def _canvas(size: int) -> pygame.Surface:
    return pygame.Surface((size * _FINER, size * _FINER), pygame.SRCALPHA)


def _shrunk(canvas: pygame.Surface, size: int) -> pygame.Surface:
    return pygame.transform.smoothscale(canvas, (size, size))


@lru_cache(maxsize=64)
def arrow(direction: str, size: int, colour: Colour = colours.ARROW) -> pygame.Surface:
    """Return an arrow that points to N (up), E, S or W in a square of ``size`` pixels."""
    # Without colour around it, or the shrinking would mix in black at the edge.
    canvas = _canvas(size)
    canvas.fill((*colour, 0))
    pygame.draw.polygon(canvas, colour, [(x * size * _FINER, y * size * _FINER) for x, y in _ARROW])
    return pygame.transform.rotate(_shrunk(canvas, size), _ANGLE[direction])


@lru_cache(maxsize=16)
def start(size: int) -> pygame.Surface:
    """Return the mark of the start: a dark disc with a light ring in it."""
    return _discs(size, ((1.0, colours.START), (0.62, colours.PATH), (0.36, colours.START)))


@lru_cache(maxsize=16)
def tool(size: int) -> pygame.Surface:
    """Return the drawn tool, seen from above: a red disc with a light rim and a light point in the middle."""
    return _discs(size, ((1.0, colours.EDGE), (0.90, colours.PATH), (0.70, colours.TOOL), (0.16, colours.PATH)))


@lru_cache(maxsize=16)
def goal(size: int) -> pygame.Surface:
    """Return the mark of the goal: a square, chequered yellow and dark as a finishing flag."""
    # Its edges are straight: nothing to smooth.
    picture = pygame.Surface((size, size))
    picture.fill(colours.EDGE)
    rim = max(1, round(0.06 * size))
    inner = size - 2 * rim
    for row in range(_SQUARES):
        for col in range(row % 2, _SQUARES, 2):
            left, right = rim + inner * col // _SQUARES, rim + inner * (col + 1) // _SQUARES
            top, bottom = rim + inner * row // _SQUARES, rim + inner * (row + 1) // _SQUARES
            picture.fill(colours.GOAL, (left, top, right - left, bottom - top))
    return picture


@lru_cache(maxsize=4)
def warning(size: int) -> pygame.Surface:
    """Return a white triangle with an exclamation mark in the colour of alarms."""
    canvas, one = _canvas(size), size * _FINER
    canvas.fill((*colours.ALARM_TEXT, 0))
    top, side = one * (1 - math.sqrt(0.75)) / 2, one
    pygame.draw.polygon(canvas, colours.ALARM_TEXT, [(side / 2, top), (side, one - top), (0, one - top)])
    bar = pygame.Rect(0, 0, one * 0.10, one * 0.30)
    bar.midtop = round(one / 2), round(one * 0.36)
    pygame.draw.rect(canvas, colours.ALARM, bar)
    pygame.draw.circle(canvas, colours.ALARM, (one / 2, one * 0.79), one * 0.06)
    return _shrunk(canvas, size)


def _discs(size: int, rings: tuple[tuple[float, Colour], ...]) -> pygame.Surface:
    canvas, one = _canvas(size), size * _FINER
    canvas.fill((*rings[0][1], 0))
    for share, colour in rings:
        pygame.draw.circle(canvas, colour, (one / 2, one / 2), share * one / 2)
    return _shrunk(canvas, size)
