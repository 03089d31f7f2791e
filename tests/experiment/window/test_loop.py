"""The loop of the window's process, with pygame-ce's own events."""

import contextlib
import threading
from multiprocessing import Pipe

import pytest

from hrcneuro.arms.clock import seconds
from hrcneuro.experiment.messages import Closed, Focus, Key, Motion, Scene
from hrcneuro.experiment.parameters import WindowOptions
from hrcneuro.experiment.window.layout import as_large_as_fits, laid_out
from hrcneuro.experiment.window.requests import Leave, Saved, Screenshot

PATIENCE = 5.0
IC = Scene(scenario="iC", human_directions=frozenset("NW"), path=((1, 1), (1, 2), (2, 2)))


@pytest.fixture
def screen(unseen):
    """A window of this process."""
    unseen.display.init()
    yield unseen.display.set_mode((640, 360))
    unseen.display.quit()


@contextlib.contextmanager
def serving(surface, rotate=0):
    """Make a loop; yield the link's other end, and the loop."""
    from hrcneuro.experiment.window.loop import Loop

    ours, theirs = Pipe()
    loop = Loop(theirs, surface, laid_out(surface.get_size(), as_large_as_fits(surface.get_size()), rotate))
    yield ours, loop
    ours.close()


def run(surface, talk, rotate=0):
    """Run a loop in this thread while ``talk(link)`` runs in another; return what that returned, and the loop.

    The window system belongs to the main thread.
    """
    result = []
    with serving(surface, rotate) as (ours, loop):

        def other():
            try:
                result.append(talk(ours))
            finally:
                ours.send(Leave())

        thread = threading.Thread(target=other)
        thread.start()
        loop.run()
        thread.join(PATIENCE)
    assert result, "the other thread failed"
    return result[0], loop


def received(link, number, kind=object):
    """Return so many messages of a kind."""
    messages, until = [], seconds() + PATIENCE
    while len(messages) < number and link.poll(max(0.0, until - seconds())):
        message = link.recv()
        if isinstance(message, kind):
            messages.append(message)
    return messages


def test_keys_go_by_their_place_and_not_by_what_is_printed_on_them(unseen, screen):
    scancodes = [unseen.KSCAN_UP, unseen.KSCAN_RIGHT, unseen.KSCAN_DOWN, unseen.KSCAN_LEFT]
    scancodes += [unseen.KSCAN_ESCAPE, unseen.KSCAN_KP_8, unseen.KSCAN_W]

    def talk(link):
        begun = seconds()
        for scancode in scancodes:
            # Some layout puts something else on each key.
            unseen.event.post(unseen.Event(unseen.KEYDOWN, scancode=scancode, key=unseen.K_q, mod=0, unicode="q"))
            unseen.event.post(unseen.Event(unseen.KEYUP, scancode=scancode, key=unseen.K_q, mod=0))
        return begun, received(link, len(scancodes), Key), seconds()

    (begun, keys, ended), _ = run(screen, talk)
    assert [key.name for key in keys] == ["N", "E", "S", "W", "escape", "other", "other"]
    times = [begun, *(key.when for key in keys), ended]
    assert times == sorted(times)


def test_of_several_scenes_the_newest_is_shown(unseen, screen, tmp_path):
    from hrcneuro.experiment.window import drawing

    def talk(link):
        for number in range(50):
            link.send(Scene(title=f"Scene {number}"))
        link.send(IC)
        link.send(Screenshot(str(tmp_path / "window.png")))
        return received(link, 1, Saved)

    (saved,), loop = run(screen, talk)
    assert saved == Saved(str(tmp_path / "window.png"))
    wanted = drawing.picture(IC, 0.0, loop._layout)
    shown = unseen.image.load(tmp_path / "window.png")
    assert unseen.image.tobytes(shown, "RGB") == unseen.image.tobytes(wanted, "RGB")


@pytest.mark.parametrize("turn", [90, 180, 270])
def test_a_turned_picture_is_the_same_picture(unseen, screen, tmp_path, turn):
    from hrcneuro.experiment.window import drawing

    scene = Scene(scenario="iC", human_directions=frozenset("NE"), tool=Motion((0, 1), (0, 1), 0.0, 1.0))

    def talk(link):
        link.send(scene)
        link.send(Screenshot(str(tmp_path / "window.png")))
        return received(link, 1, Saved)

    _, loop = run(screen, talk, rotate=turn)
    shown = unseen.transform.rotate(unseen.image.load(tmp_path / "window.png"), turn)
    wanted = drawing.picture(scene, 0.0, loop._layout)
    assert shown.get_size() == wanted.get_size()
    # The tool's place may be rounded otherwise: by a pixel.
    away = sum(
        abs(a - b) > 40
        for a, b in zip(unseen.image.tobytes(shown, "RGB"), unseen.image.tobytes(wanted, "RGB"), strict=True)
    )
    assert away < 0.002 * 3 * 640 * 360


def test_a_drawn_tool_reaches_its_tile_and_then_nothing_is_drawn(unseen, screen, tmp_path):
    from hrcneuro.experiment.window import drawing

    def talk(link):
        scene = Scene(tool=Motion((3, 1), (3, 5), seconds() + 0.05, 0.2))
        link.send(scene)
        end = seconds() + 0.4
        until = seconds() + PATIENCE
        while seconds() < until:
            link.send(Screenshot(str(tmp_path / "window.png")))
            received(link, 1, Saved)
            shown = unseen.image.tobytes(unseen.image.load(tmp_path / "window.png"), "RGB")
            if seconds() > end and shown == unseen.image.tobytes(drawing.picture(scene, 1e12, layout), "RGB"):
                return True
        return False

    layout = laid_out((640, 360), as_large_as_fits((640, 360)))
    arrived, loop = run(screen, talk)
    assert arrived
    assert loop._patience_ms() == 0, "it waits for events alone"


def test_closing_the_window_is_said_and_ends_the_loop(unseen, screen):
    def talk(link):
        unseen.event.post(unseen.Event(unseen.QUIT))
        return received(link, 1, Closed)

    assert run(screen, talk)[0] == [Closed()]


def test_losing_the_keyboard_is_said(unseen, screen):
    def talk(link):
        heard = received(link, 1, Focus)
        unseen.event.post(unseen.Event(unseen.WINDOWFOCUSLOST))
        unseen.event.post(unseen.Event(unseen.WINDOWFOCUSGAINED))
        # The window system may have something to say of its own.
        while [focus.has for focus in heard][-2:] != [False, True] and (more := received(link, 1, Focus)):
            heard += more
        return heard

    assert [focus.has for focus in run(screen, talk)[0]][-2:] == [False, True]


def test_a_scene_that_cannot_be_drawn_ends_it_with_a_reason(screen):
    def talk(link):
        link.send(Scene(scenario="sC", human_tiles=frozenset({(0, 0)}), human_colour="red"))
        return received(link, 1, Closed)

    ((closed,), _) = run(screen, talk)
    assert "'red'" in closed.problem


def test_the_loop_ends_with_the_other_end(unseen, screen):
    with serving(screen) as (ours, loop):
        closer = threading.Timer(0.05, ours.close)
        closer.start()
        begun = seconds()
        loop.run()
        assert seconds() - begun < PATIENCE
        # The loop hears the end before the other thread has left close(): two at once would close the file twice.
        closer.join()


def test_the_card_is_measured_with_arrows_and_enter(unseen, screen):
    from hrcneuro.experiment.window import calibration

    presses = [unseen.KSCAN_UP, unseen.KSCAN_LEFT, unseen.KSCAN_LEFT, unseen.KSCAN_Q, unseen.KSCAN_RETURN]
    for scancode in [unseen.KSCAN_DOWN] * 100 + presses:
        unseen.event.post(unseen.Event(unseen.KEYDOWN, scancode=scancode))
    # From the least, 40 pixels: 10 more, 2 less.
    assert calibration.measure(screen, WindowOptions()) == pytest.approx(48 / 8.56)


@pytest.mark.parametrize("size", [(1920, 1080), (1280, 720), (3840, 2160), (1080, 1920), (1024, 768)])
@pytest.mark.parametrize("width", [40, 323, 10_000])
def test_the_card_keeps_its_shape_and_stays_on_the_screen(screen, size, width):
    import numpy as np
    import pygame

    from hrcneuro.experiment.window import calibration, colours

    width = min(width, calibration._widest(size))
    picture = pygame.surfarray.array3d(calibration.picture(size, width))
    card = np.argwhere((picture == colours.PATH).all(axis=2))
    (left, top), (right, bottom) = card.min(axis=0), card.max(axis=0) + 1
    assert right - left == width
    assert (bottom - top) == pytest.approx(width * 53.98 / 85.60, abs=1)
    assert len(card) == (right - left) * (bottom - top), "nothing lies over it"
    assert bottom < size[1]
