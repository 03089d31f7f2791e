"""The library that opens windows, pygame-ce: how it is set up, and what is said where it is absent."""

from __future__ import annotations

import os

from hrcneuro.errors import HardwareError

_SETTINGS = {
    "PYGAME_HIDE_SUPPORT_PROMPT": "1",
    # No sound is made, and opening a sound device may fail or hang on a laboratory's machine.
    "SDL_AUDIODRIVER": "dummy",
    # The experimenter clicks on another screen: the person's must stay.
    "SDL_VIDEO_MINIMIZE_ON_FOCUS_LOSS": "0",
    # Signals are for whoever started the process.
    "SDL_NO_SIGNAL_HANDLERS": "1",
    "SDL_VIDEO_ALLOW_SCREENSAVER": "0",
    # Straight to the window system: through OpenGL in software, a frame took most of a core.
    "SDL_FRAMEBUFFER_ACCELERATION": "0",
}


def prepare() -> None:
    """Set up pygame-ce; before its first import in a process.

    Raises:
        HardwareError: It is not installed, or cannot be loaded.
    """
    for name, value in _SETTINGS.items():
        os.environ.setdefault(name, value)
    try:
        import pygame  # noqa: F401
    except ImportError as error:
        absent = isinstance(error, ModuleNotFoundError) and error.name == "pygame"
        raise HardwareError(
            "the window is drawn by pygame-ce, which "
            + ("is not installed" if absent else f"cannot be loaded: {str(error).splitlines()[0]}"),
            cure="pip install 'hrcneuro[experiment]'",
        ) from error
