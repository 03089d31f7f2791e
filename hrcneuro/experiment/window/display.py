"""The screen that the window opens on, and how many of its pixels make a metre."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

import pygame

from hrcneuro.errors import ConfigError, HardwareError
from hrcneuro.experiment.parameters import WindowOptions
from hrcneuro.experiment.window import edid, words
from hrcneuro.experiment.window.layout import BESIDE_M, GRID_M, Layout, as_large_as_fits, laid_out, needed
from hrcneuro.experiment.window.requests import Opened

_WINDOW = 0.85  # of the screen's width and height
CONFIGURED, SAID, CARD, FITTED = "configured", "said by the screen", "by a bank card", "as large as fits"

_GRAPHICAL = "run it in a terminal of the graphical session whose screen the person sees, not over a bare ssh"

Measure = Callable[[pygame.Surface, WindowOptions], float]


def opened(options: WindowOptions, measure: Measure) -> tuple[pygame.Surface, Layout, Opened]:
    """Open the window; return its surface, the places in it, and what was found.

    Args:
        options: Which screen, how large.
        measure: Asks a person for the pixels per cm, where neither the options nor the screen say them.

    Raises:
        HardwareError: There is no screen, none of that number, or it is smaller than the grid.
        ConfigError: The font cannot be read.
    """
    sizes = _screens()
    if options.display >= len(sizes):
        listed = ", ".join(f"{n}: {w} × {h} pixels" for n, (w, h) in enumerate(sizes))
        raise HardwareError(
            f"there is no screen {options.display}; there are {listed}",
            cure="plug it in and switch it on, or choose another one: experiment.window.display",
        )
    _check_font(options.font)
    surface = _window(options, sizes[options.display])
    per_metre, source = _pixels_per_metre(options, sizes[options.display], surface, measure)
    size = surface.get_size()
    if source == FITTED:
        drawn = as_large_as_fits(size)
    else:
        drawn = per_metre * options.scale
        _check_room(size, per_metre, options)
    per_cm = float("nan") if source == FITTED else per_metre / 100
    layout = laid_out(size, drawn, options.rotate)
    return surface, layout, Opened(pygame.display.get_driver(), size, per_cm, source, layout.tile)


def _screens() -> list[tuple[int, int]]:
    shown = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    # SDL would open a window that nobody sees, unless it is told which driver to take.
    if sys.platform == "linux" and not shown and not os.environ.get("SDL_VIDEODRIVER"):
        raise HardwareError("there is no screen: neither DISPLAY nor WAYLAND_DISPLAY is set", cure=_GRAPHICAL)
    try:
        pygame.display.init()
        return list(pygame.display.get_desktop_sizes())
    except pygame.error as error:
        raise HardwareError(f"no window can be opened: {error} (DISPLAY is {shown!r})", cure=_GRAPHICAL) from error


def _window(options: WindowOptions, screen: tuple[int, int]) -> pygame.Surface:
    size = tuple(round(_WINDOW * one) for one in screen) if options.windowed else screen
    try:
        surface = pygame.display.set_mode(size, 0 if options.windowed else pygame.FULLSCREEN, display=options.display)
    except pygame.error as error:
        raise HardwareError(
            f"screen {options.display} gives no window of {size[0]} × {size[1]} pixels: {error}",
            cure="choose another screen (experiment.window.display), or a window: experiment.window.windowed = true",
        ) from error
    if not options.windowed and surface.get_size() != screen:
        # SDL lists the screens of an X server that has several, and opens every window on the first.
        size = surface.get_size()
        pygame.display.quit()
        raise HardwareError(
            f"screen {options.display} has {screen[0]} × {screen[1]} pixels, and the window on it came out with "
            f"{size[0]} × {size[1]}: it lies on another screen, or is scaled",
            cure="let the window system join its screens to one desktop (xrandr --output … --right-of …), each at its "
            "own resolution and a scale of 1",
        )
    pygame.display.set_caption("hrcneuro")
    pygame.display.set_allow_screensaver(False)
    pygame.mouse.set_visible(options.windowed)
    return surface


def _pixels_per_metre(
    options: WindowOptions, screen: tuple[int, int], surface: pygame.Surface, measure: Measure
) -> tuple[float, str]:
    if options.scale == 0.0:
        return float("nan"), FITTED
    if options.pixels_per_cm > 0.0:
        return 100 * options.pixels_per_cm, CONFIGURED
    # What shows nothing has no size; its pixels may happen to be those of a screen that has one.
    real = pygame.display.get_driver() in ("x11", "wayland", "kmsdrm")
    said = edid.pixels_per_metre(screen, edid.connected()) if real else None
    return (100 * measure(surface, options), CARD) if said is None else (said, SAID)


def _check_room(size: tuple[int, int], per_metre: float, options: WindowOptions) -> None:
    shorter, longer = needed(per_metre * options.scale)
    if min(size) >= shorter - 1 and max(size) >= longer - 1:
        return
    fits = int(min(min(size) / (GRID_M * per_metre), max(size) / ((GRID_M + 2 * BESIDE_M) * per_metre)) * 100) / 100
    width, height = (100 * one / per_metre for one in size)
    grid, beside = 100 * GRID_M * options.scale, 100 * BESIDE_M * options.scale
    raise HardwareError(
        f"the {'window' if options.windowed else 'screen'} shows {width:.1f} × {height:.1f} cm ({size[0]} × {size[1]} "
        f"pixels, {per_metre / 100:.2f} per cm); the grid needs {grid:.1f} × {grid:.1f} cm, and {beside:.1f} cm on two "
        "sides of it",
        cure="use a larger screen (the paper's has 42 inches), or the full one"
        f"; where no arm moves over it, a smaller grid: experiment.window.scale = {fits:.2f}",
    )


def _check_font(path: str) -> None:
    cure = "name a font file, such as a .ttf or .otf"
    try:
        # Some versions make a font of any file, and fail once it is used.
        known = words.font(path, 20).metrics("x")
    except (OSError, ValueError, pygame.error) as error:
        raise ConfigError(
            f"experiment.window.font = {path!r} is no font that can be read: {error}", cure=cure
        ) from error
    if not known or known[0] is None:
        raise ConfigError(f"experiment.window.font = {path!r} has no letter x", cure=cure)


def close() -> None:
    """Close the window."""
    words.font.cache_clear()
    pygame.font.quit()
    pygame.display.quit()
