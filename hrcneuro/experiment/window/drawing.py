"""The picture of a scene, as the person sees it before it is turned onto the screen.

How large things are: a tile of 7 cm is 2.2° wide from 1.8 m. The path is a band of 40 % of a tile's width: the area's
colour stays visible on both sides of it, so that it can be seen whose tile it crosses. The marks of start and goal are
70 % of a tile, 1.6°; the person's arrows up to 7 cm, 2.2°.
"""

from __future__ import annotations

import numpy as np
import pygame

from hrcneuro.experiment.messages import Motion, Scene
from hrcneuro.experiment.window import colours, marks, words
from hrcneuro.experiment.window.layout import Box, Layout, Point
from hrcneuro.paradigm.grid import SIZE, STEPS, Tile, inside, move
from hrcneuro.paradigm.owners import COLOURS, TILES
from hrcneuro.robot.minimum_jerk import minimum_jerk

# Shares of a tile's edge.
_LINE, _SEAM = 0.025, 0.06
_BAND, _EDGE = 0.40, 0.05
_START, _GOAL, _TOOL = 0.72, 0.68, 0.52
_MARGIN = 0.35  # between words and whatever is beside them
_ARROW = 1.0  # of an arrow, at most

YOU, ROBOT = "You", "Robot"
TURN = {"human": "Your turn", "robot": "Robot's turn"}


def picture(scene: Scene, time: float, layout: Layout, font: str = "") -> pygame.Surface:
    """Return the whole picture of a scene at an instant, in the size of ``layout``.

    Args:
        scene: What the person sees.
        time: Seconds of the clock that the scene's times are of; only a drawn tool depends on it.
        layout: Where things lie.
        font: Font file; empty for the one that comes with pygame-ce.
    """
    surface = resting(scene, layout, font)
    if has_tool(scene) and scene.tool is not None:
        sprite = tool_mark(layout)
        surface.blit(sprite, sprite.get_rect(center=layout.centre(*tool_tile(scene.tool, time))))
    return surface


def resting(scene: Scene, layout: Layout, font: str = "") -> pygame.Surface:
    """Return the picture of a scene without a drawn tool: what does not depend on time."""
    surface = pygame.Surface(layout.size)
    surface.fill(colours.BACKGROUND)
    if scene.title or scene.lines:
        _words(surface, scene, layout, font)
        return surface
    _tiles(surface, scene, layout)
    if scene.path:
        _path(surface, scene.path, layout)
    for panel in layout.panels:
        _panel(surface, scene, panel, layout, font)
    return surface


def has_tool(scene: Scene) -> bool:
    """Return whether a tool is drawn: words stand alone."""
    return scene.tool is not None and not (scene.title or scene.lines)


def tool_tile(motion: Motion, time: float) -> Point:
    """Return the row and column, with fractions, over which a drawn tool stands at an instant (paper Eq 1–2)."""
    share = float(minimum_jerk(np.asarray((time - motion.when) / motion.t_f))[0])
    (row, col), (to_row, to_col) = motion.start, motion.end
    return row + share * (to_row - row), col + share * (to_col - col)


def tool_mark(layout: Layout) -> pygame.Surface:
    """Return the picture of a drawn tool; it looks the same however it is turned."""
    return marks.tool(max(3, round(_TOOL * layout.tile)))


def _tiles(surface: pygame.Surface, scene: Scene, layout: Layout) -> None:
    line = max(1, round(_LINE * layout.tile))
    surface.fill(colours.FRAME, _inset(layout.grid, -line))
    surface.fill(colours.BACKGROUND, layout.grid)
    for tile in TILES:
        left, top, width, height = layout.box(*tile)
        box = left + line // 2, top + line // 2, width - line, height - line
        surface.fill(_colour(scene, tile), box)
    if _has_areas(scene):
        surface.set_clip(layout.grid)
        for tile in scene.human_tiles:
            for direction in STEPS:
                there = move(tile, direction)
                if there != tile and there not in scene.human_tiles:
                    surface.fill(colours.SEAM, _side(layout, tile, direction))
        surface.set_clip(None)


def _colour(scene: Scene, tile: Tile) -> colours.Colour:
    if not _has_areas(scene):
        return colours.BARE
    return colours.AREAS[scene.human_colour if tile in scene.human_tiles else _other(scene.human_colour)]


def _has_areas(scene: Scene) -> bool:
    return scene.scenario == "sC" and bool(scene.human_tiles)


def _other(colour: str) -> str:
    return COLOURS[1 - COLOURS.index(colour)]


def _side(layout: Layout, tile: Tile, direction: str) -> Box:
    # The line along one side of a tile, as long as the tile and the line's own width, so that corners close.
    wide = max(2, round(_SEAM * layout.tile))
    half = wide // 2
    left, top, width, height = layout.box(*tile)
    return {
        "N": (left - half, top - half, width + wide, wide),
        "S": (left - half, top + height - half, width + wide, wide),
        "W": (left - half, top - half, wide, height + wide),
        "E": (left + width - half, top - half, wide, height + wide),
    }[direction]


def _path(surface: pygame.Surface, path: tuple[Tile, ...], layout: Layout) -> None:
    edge = max(1, round(_EDGE * layout.tile))
    half = round(_BAND * layout.tile / 2)
    for grown, colour in ((half + edge, colours.EDGE), (half, colours.PATH)):
        for one, two in zip(path, path[1:] or path, strict=False):
            (x1, y1), (x2, y2) = layout.centre(*one), layout.centre(*two)
            left, top = round(min(x1, x2)) - grown, round(min(y1, y2)) - grown
            right, bottom = round(max(x1, x2)) + grown, round(max(y1, y2)) + grown
            surface.fill(colour, (left, top, right - left, bottom - top))
    for tile, mark, share in ((path[0], marks.start, _START), (path[-1], marks.goal, _GOAL)):
        sprite = mark(max(3, round(share * layout.tile)))
        surface.blit(sprite, sprite.get_rect(center=layout.centre(*tile)))


def _panel(surface: pygame.Surface, scene: Scene, panel: Box, layout: Layout, font: str) -> None:
    left, top, width, height = panel
    beside = layout.size[0] >= layout.size[1]
    side = min(0.86 * width, 0.86 * height, 3 * _ARROW * layout.tile)
    if scene.scenario == "iC":
        # At the person's end, as far as that leaves a margin.
        middle = top + height - side / 2 - 0.07 * height if beside else top + height / 2
        _arrows(surface, scene.human_directions, (left + width / 2, middle), side)
    if scene.turn:
        box = (left, top, width, height - round(side)) if beside else (left, top, round((width - side) / 2), height)
        _turn(surface, scene.turn, _inset(box, round(0.05 * min(width, height))), layout, font)


def _turn(surface: pygame.Surface, turn: str, box: Box, layout: Layout, font: str) -> None:
    text = words.set_words("", (TURN[turn],), box, _x_height(layout), colours.TEXT, font)
    surface.blits(text.lower(max(0, box[3] - text.height) // 2).placed)


def _arrows(surface: pygame.Surface, directions: frozenset[str], centre: Point, side: float) -> None:
    # Where they are as keys around a middle: the upper one above, the left one at the left.
    size = max(3, round(side / 3))
    for direction in sorted(directions):
        down, right = STEPS[direction]
        sprite = marks.arrow(direction, size)
        surface.blit(sprite, sprite.get_rect(center=(centre[0] + right * size, centre[1] + down * size)))


def _words(surface: pygame.Surface, scene: Scene, layout: Layout, font: str) -> None:
    """Draw words in the middle of the picture: a sign of warning above them, or whose colour is whose below."""
    colour = colours.TEXT
    if scene.alarm:
        surface.fill(colours.ALARM)
        colour = colours.ALARM_TEXT
    margin = round(_MARGIN * layout.tile)
    left, top, width, height = _inset((0, 0, *layout.size), margin)
    above = round(1.4 * layout.tile) if scene.alarm else 0
    below = _legend_height(scene, layout)
    room = height - sum(one + margin for one in (above, below) if one)
    text = words.set_words(scene.title, scene.lines, (left, 0, width, max(1, room)), _x_height(layout), colour, font)
    top += max(0, room - text.height) // 2
    if above:
        sprite = marks.warning(above)
        surface.blit(sprite, sprite.get_rect(midtop=(left + width / 2, top)))
        top += above + margin
    surface.blits(text.lower(top).placed)
    if below:
        _legend(surface, scene, (left, top + text.height + margin, width, below), layout, font)


def _legend_height(scene: Scene, layout: Layout) -> int:
    if scene.alarm:
        return 0
    if scene.scenario == "sC" and scene.human_colour:
        return round(2.2 * layout.tile)
    return round(2.6 * layout.tile) if scene.scenario == "iC" and scene.human_directions else 0


def _legend(surface: pygame.Surface, scene: Scene, box: Box, layout: Layout, font: str) -> None:
    """Draw whose colour is whose (sC), or the person's arrows (iC)."""
    left, top, width, height = box
    if scene.scenario == "iC":
        _arrows(surface, scene.human_directions, (left + width / 2, top + height / 2), height)
        return
    patch, gap, wide = round(1.2 * layout.tile), round(0.2 * layout.tile), min(round(2.6 * layout.tile), width // 2)
    for text, colour, at in ((YOU, scene.human_colour, -wide), (ROBOT, _other(scene.human_colour), 0)):
        middle = left + width // 2 + at + wide // 2
        square = middle - patch // 2, top, patch, patch
        surface.fill(colours.AREAS[colour], square)
        pygame.draw.rect(surface, colours.SEAM, square, max(1, patch // 24))
        label = middle - wide // 2, top + patch + gap, wide, max(1, height - patch - gap)
        surface.blits(words.set_words("", (text,), label, _x_height(layout), colours.TEXT, font).placed)


def _x_height(layout: Layout) -> float:
    return words.X_HEIGHT_M * layout.pixels_per_metre


def _inset(box: Box, margin: int) -> Box:
    left, top, width, height = box
    return left + margin, top + margin, max(1, width - 2 * margin), max(1, height - 2 * margin)


def mistakes(scene: Scene) -> list[str]:
    """Return why a scene cannot be drawn; empty where it can."""
    wrong = []
    if scene.scenario not in ("", "sC", "iC"):
        wrong.append(f"scenario {scene.scenario!r}: sC, iC or nothing is needed")
    if scene.human_colour not in ("", *COLOURS) or (_has_areas(scene) and not scene.human_colour):
        wrong.append(f"human_colour {scene.human_colour!r}: {' or '.join(COLOURS)} is needed")
    if unknown := sorted(scene.human_directions - set(STEPS)):
        wrong.append(f"human_directions {', '.join(map(repr, unknown))}: N, E, S, W are needed")
    if scene.turn not in ("", *TURN):
        wrong.append(f"turn {scene.turn!r}: {', '.join(TURN)} or nothing is needed")
    tiles = [*scene.path, *scene.human_tiles, *((scene.tool.start, scene.tool.end) if scene.tool else ())]
    if off := sorted({tile for tile in tiles if not inside(tile)}):
        wrong.append(f"tiles {off}: rows and columns go from 0 to {SIZE - 1}")
    if scene.tool and not scene.tool.t_f > 0:
        wrong.append(f"a tool's motion of {scene.tool.t_f} s: more than 0 is needed")
    return wrong
