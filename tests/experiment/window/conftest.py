"""Windows that nobody sees, in this process and in others."""

import pytest

from hrcneuro.errors import HardwareError
from hrcneuro.experiment.window import library


@pytest.fixture(scope="session")
def pygame():
    """pygame-ce, as the window's process loads it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SDL_VIDEODRIVER", "dummy")
        try:
            library.prepare()
        except HardwareError as error:
            pytest.skip(str(error))
        import pygame

        yield pygame
        pygame.quit()


@pytest.fixture
def unseen(monkeypatch, pygame):
    """Windows of other processes are not seen either."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    return pygame
