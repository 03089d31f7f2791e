"""The window in a process of its own, as the flow uses it."""

import dataclasses
import os
import signal
import subprocess
import sys
from multiprocessing.connection import wait
from pathlib import Path

import psutil
import pytest
import xvfb

from hrcneuro.arms.clock import seconds
from hrcneuro.errors import ConfigError, HardwareError
from hrcneuro.experiment.messages import Closed, Focus, Scene
from hrcneuro.experiment.parameters import WindowOptions, window_mistakes
from hrcneuro.experiment.window import library
from hrcneuro.experiment.window.process import Window

ROOT = Path(__file__).parents[3]
PATIENCE = 10.0
FITTED = WindowOptions(scale=0.0)
pytestmark = pytest.mark.usefixtures("unseen")


def closed(window):
    """Return the event that tells of the window's end."""
    until = seconds() + PATIENCE
    while (left := until - seconds()) > 0:
        wait([window.connection], left)
        for event in window.events():
            if isinstance(event, Closed):
                return event
    raise AssertionError("nothing told of the end")


def test_a_window_shows_scenes_and_leaves(tmp_path):
    import pygame

    with Window(FITTED) as window:
        process = psutil.Process(window.pid)
        assert window.opened.driver == "dummy"
        assert window.opened.source == "as large as fits"
        for name, scene in (("grid", Scene(path=((1, 1), (1, 2)))), ("words", Scene(title="Break"))):
            window.show(scene)
            window.screenshot(tmp_path / f"{name}.png")
        assert all(isinstance(event, Focus) for event in window.events())
        with pytest.raises(ConfigError, match=r"no/window\.png"):
            window.screenshot(tmp_path / "no" / "window.png")
    assert not process.is_running()
    grid, words = (pygame.image.load(tmp_path / f"{name}.png") for name in ("grid", "words"))
    assert grid.get_size() == words.get_size() == window.opened.size
    assert grid.get_buffer().raw != words.get_buffer().raw
    window.show(Scene())
    assert window.events() == []


def test_a_process_that_is_killed_is_told_once():
    with Window(FITTED) as window:
        os.kill(window.pid, signal.SIGKILL)
        end = closed(window)
        assert "SIGKILL" in end.problem
        assert window.events() == []
        window.show(Scene())
        with pytest.raises(HardwareError, match="no picture"):
            window.screenshot(Path("window.png"))


def test_a_window_that_hangs_holds_nobody_up():
    with Window(FITTED) as window:
        os.kill(window.pid, signal.SIGSTOP)
        begun = seconds()
        for _ in range(3000):
            window.show(Scene(title="Break", lines=("Take as long as you like.",) * 5))
        assert seconds() - begun < PATIENCE
    assert not psutil.pid_exists(window.pid)


def test_ctrl_c_is_for_the_flow():
    with Window(FITTED) as window:
        os.kill(window.pid, signal.SIGINT)
        window.show(Scene(title="The session ends"))
        with pytest.raises(ConfigError):
            window.screenshot(Path("/nowhere/window.png"))


def test_it_ends_with_the_process_that_opened_it():
    code = (
        "import os, signal\n"
        "from hrcneuro.experiment.parameters import WindowOptions\n"
        "from hrcneuro.experiment.window.process import Window\n"
        "if __name__ == '__main__':\n"
        "    window = Window(WindowOptions(scale=0.0))\n"
        "    print(window.pid, flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False, timeout=60
    )
    pid = int(done.stdout)
    until = seconds() + PATIENCE
    while psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE:
        assert seconds() < until, "it is still there"


@pytest.mark.parametrize(
    ("options", "said", "cure"),
    [
        (WindowOptions(display=7, scale=0.0), "no screen 7; there are 0: 1024 × 768", "experiment.window.display"),
        (WindowOptions(pixels_per_cm=37.8), "27.1 × 20.3 cm", "experiment.window.scale = 0.41"),
        (WindowOptions(pixels_per_cm=20.0, windowed=True), "43.5 × 32.6 cm", "experiment.window.scale = 0.66"),
    ],
)
def test_a_screen_that_will_not_do_is_refused(options, said, cure):
    with pytest.raises(HardwareError, match=said) as refused:
        Window(options)
    assert cure in refused.value.cure
    assert refused.value.exit_code == 4


def test_the_scale_that_is_named_fits_and_the_true_size_is_kept():
    with Window(WindowOptions(pixels_per_cm=37.8, scale=0.41)) as window:
        assert window.opened.source == "configured"
        assert window.opened.tile_px == pytest.approx(0.41 * 7 * 37.8)
    with Window(WindowOptions(pixels_per_cm=15.0)) as window:
        assert window.opened.tile_px == pytest.approx(105)


def test_without_a_screen_none_is_made_up(monkeypatch):
    monkeypatch.delenv("SDL_VIDEODRIVER")
    with pytest.raises(HardwareError, match="neither DISPLAY nor WAYLAND_DISPLAY") as refused:
        Window(FITTED)
    assert "graphical session" in refused.value.cure


def test_a_font_that_is_none_is_refused(tmp_path):
    (tmp_path / "font.ttf").write_text("none")
    with pytest.raises(ConfigError, match=r"font\.ttf"):
        Window(WindowOptions(scale=0.0, font=str(tmp_path / "font.ttf")))


def test_without_the_extra_the_cure_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(HardwareError, match="pygame-ce, which is not installed") as refused:
        library.prepare()
    assert refused.value.cure == "pip install 'hrcneuro[experiment]'"


def test_nothing_but_the_windows_process_loads_pygame():
    code = "import sys, hrcneuro.experiment.window.process; sys.exit('pygame' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
def test_turns_that_are_allowed(turn):
    assert window_mistakes(WindowOptions(rotate=turn), "experiment.window") == []


def test_another_turn_is_a_mistake():
    assert (
        "experiment.window.rotate = 45: 0, 90, 180 or 270"
        in window_mistakes(WindowOptions(rotate=45), "experiment.window")[0]
    )


@pytest.mark.skipif(bool(xvfb.absent()), reason=xvfb.absent() or "")
def test_a_window_that_comes_out_on_another_screen_than_was_asked_for_is_refused(monkeypatch):
    """Of an X server with several screens, SDL lists all and opens each window on the first."""
    with xvfb.screen(1280, 720, (1600, 900)) as display:
        monkeypatch.setenv("DISPLAY", display)
        monkeypatch.delenv("SDL_VIDEODRIVER")
        with Window(FITTED) as window:
            assert window.opened.size == (1280, 720)
        with pytest.raises(HardwareError, match=r"screen 1 has 1600 × 900 pixels, and the window .* 1280 × 720"):
            Window(dataclasses.replace(FITTED, display=1))
