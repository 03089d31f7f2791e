"""What runs in the window's process: pictures in, keys out.

A key's time is read when pygame-ce hands the key over: it looks for keys every millisecond, and does so only while it
is waited for. So pictures are drawn by a second thread, off the screen; the first one only copies them onto it, and
waits again. Nothing is drawn but when something has changed: sixty times a second while a drawn tool moves, else once a
scene.
"""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

import pygame

from hrcneuro.arms.clock import seconds
from hrcneuro.errors import HrcError
from hrcneuro.experiment.messages import Closed, Focus, Key, Scene
from hrcneuro.experiment.window import calibration, display, drawing
from hrcneuro.experiment.window.layout import Layout
from hrcneuro.experiment.window.requests import Calibrating, Leave, Saved, Screenshot

FRAME = 1 / 60  # seconds
_SWITCH = 0.0005  # seconds; how long one thread may keep the other from running
_WAKE = pygame.USEREVENT
# By the key's place on the keyboard, whatever its layout.
ARROWS = {pygame.KSCAN_UP: "N", pygame.KSCAN_RIGHT: "E", pygame.KSCAN_DOWN: "S", pygame.KSCAN_LEFT: "W"}
_HEARD = (
    pygame.KEYDOWN, pygame.QUIT, _WAKE, pygame.WINDOWFOCUSGAINED, pygame.WINDOWFOCUSLOST, pygame.WINDOWEXPOSED,
)  # fmt: skip


@dataclass(frozen=True)
class _Picture:
    scene: Scene
    surface: pygame.Surface  # as it is on the screen, without a drawn tool


def name_of(scancode: int) -> str:
    """Return the name that :class:`~hrcneuro.experiment.messages.Key` has for a key."""
    return ARROWS.get(scancode) or ("escape" if scancode == pygame.KSCAN_ESCAPE else "other")


def serve(link: Connection, options: Any, parent: Any) -> None:
    """Open the window, say so on ``link``, and serve it until its other end, or the process ``parent``, has gone."""

    def measure(surface: pygame.Surface, chosen: Any) -> float:
        link.send(Calibrating())
        return calibration.measure(surface, chosen)

    surface, layout, opened = display.opened(options, measure)
    try:
        link.send(opened)
        Loop(link, surface, layout, options.font).run(parent)
    finally:
        display.close()


class Loop:
    """Shows scenes and reads keys."""

    def __init__(
        self,
        link: Connection,
        surface: pygame.Surface,
        layout: Layout,
        font: str = "",
        clock: Callable[[], float] = seconds,
    ) -> None:
        self._link, self._screen, self._layout, self._font, self._clock = link, surface, layout, font, clock
        self._tool = drawing.tool_mark(layout)
        self._todo: list[_Picture | Screenshot | Leave | Closed] = []
        self._turn = threading.Lock()
        self._now: _Picture | None = None
        self._tool_at: pygame.Rect | None = None
        self._drawn = self._due = -math.inf  # the last frame, and when the next one is due, seconds
        pygame.event.set_blocked(None)
        pygame.event.set_allowed(_HEARD)

    def run(self, parent: Any = None) -> None:
        """Return when the other end of the link, or the process with the sentinel ``parent``, has gone."""
        before = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH)
        self._screen.fill(drawing.colours.BACKGROUND)
        pygame.display.flip()
        reader = threading.Thread(target=self._read, args=(parent,), daemon=True, name="scenes")
        reader.start()
        try:
            self._link.send(Focus(pygame.key.get_focused(), self._clock()))
            while self._once(pygame.event.wait(self._patience_ms()), self._clock()):
                pass
        except (BrokenPipeError, ConnectionResetError):
            pass
        finally:
            sys.setswitchinterval(before)

    def _once(self, event: pygame.Event, when: float) -> bool:
        """Do what an event asks for; return whether to go on."""
        if event.type == pygame.KEYDOWN:
            self._link.send(Key(name_of(event.scancode), when))
        elif event.type == pygame.QUIT:
            self._link.send(Closed())
            return False
        elif event.type in (pygame.WINDOWFOCUSGAINED, pygame.WINDOWFOCUSLOST):
            self._link.send(Focus(event.type == pygame.WINDOWFOCUSGAINED, when))
        elif event.type == pygame.WINDOWEXPOSED:
            pygame.display.flip()
        elif event.type == _WAKE and not self._take():
            return False
        # A frame may come later; a key that waits for it would be told too late.
        if self._moving() and self._clock() >= self._due and not pygame.event.peek(pygame.KEYDOWN):
            self._move_tool()
        return True

    def _take(self) -> bool:
        with self._turn:
            todo, self._todo = self._todo, []
        for one in todo:
            if isinstance(one, _Picture):
                self._show(one)
            elif isinstance(one, Screenshot):
                self._save(one)
            else:
                if isinstance(one, Closed):
                    self._link.send(one)
                return False
        return True

    def _show(self, picture: _Picture) -> None:
        self._now, self._tool_at = picture, None
        self._screen.blit(picture.surface, (0, 0))
        if drawing.has_tool(picture.scene):
            self._blit_tool()
        pygame.display.flip()

    def _move_tool(self) -> None:
        before = self._tool_at
        if before is not None and self._now is not None:
            self._screen.blit(self._now.surface, before, before)
        after = self._blit_tool()
        pygame.display.update(after if before is None else after.union(before))

    def _blit_tool(self) -> pygame.Rect:
        assert self._now is not None
        assert self._now.scene.tool is not None
        self._drawn = self._clock()
        # By the clock, not from the last one: waiting is in whole milliseconds, which would add up.
        self._due = max(self._due + FRAME, self._drawn)
        at = self._layout.on_screen(self._layout.centre(*drawing.tool_tile(self._now.scene.tool, self._drawn)))
        self._tool_at = self._screen.blit(self._tool, self._tool.get_rect(center=at))
        return self._tool_at

    def _moving(self) -> bool:
        """Whether the tool has still a way to go that is not on the screen."""
        if self._now is None or not drawing.has_tool(self._now.scene):
            return False
        motion = self._now.scene.tool
        assert motion is not None
        return motion.start != motion.end and self._drawn < motion.when + motion.t_f and self._clock() >= motion.when

    def _patience_ms(self) -> int:
        """How long to wait for an event, milliseconds; 0: for ever."""
        if self._now is None or not drawing.has_tool(self._now.scene):
            return 0
        motion = self._now.scene.tool
        assert motion is not None
        if motion.start == motion.end or self._drawn >= motion.when + motion.t_f:
            return 0
        return max(1, math.ceil(1000 * (max(motion.when, self._due) - self._clock())))

    def _save(self, request: Screenshot) -> None:
        try:
            pygame.image.save(self._screen, request.path)
            self._link.send(Saved(request.path))
        except (OSError, pygame.error) as error:
            self._link.send(Saved(request.path, str(error)))

    # --- in the second thread -----------------------------------------------------------------------------------------

    def _read(self, parent: Any) -> None:
        try:
            while self._read_once(parent):
                pass
        except HrcError as error:
            self._put(Closed(error.problem, error.cure))
        except (EOFError, OSError):
            self._put(Leave())
        except Exception as error:
            self._put(Closed(f"a scene cannot be drawn: {type(error).__name__}: {error}", "report it"))

    def _read_once(self, parent: Any) -> bool:
        ready = wait([self._link] if parent is None else [self._link, parent])
        if self._link not in ready:
            self._put(Leave())
            return False
        newest: Scene | None = None
        while True:
            request = self._link.recv()
            if isinstance(request, Scene):
                newest = request
            else:
                self._draw(newest)
                newest = None
                self._put(request)
            if isinstance(request, Leave):
                return False
            if not self._link.poll():
                break
        self._draw(newest)
        return True

    def _draw(self, scene: Scene | None) -> None:
        if scene is None:
            return
        if wrong := drawing.mistakes(scene):
            raise ValueError("; ".join(wrong))
        surface = drawing.resting(scene, self._layout, self._font)
        if self._layout.rotate:
            surface = pygame.transform.rotate(surface, -self._layout.rotate)
        self._put(_Picture(scene, surface))

    def _put(self, one: Any) -> None:
        with self._turn:
            self._todo.append(one)
        pygame.event.post(pygame.Event(_WAKE))
