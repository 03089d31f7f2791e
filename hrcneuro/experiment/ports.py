"""What surrounds the flow of a session: what the experimenter asks and sees, the waits, and where it is written."""

from __future__ import annotations

import enum
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from hrcneuro.experiment.messages import Health
from hrcneuro.experiment.turns import Turn
from hrcneuro.paradigm.grid import Tile
from hrcneuro.paradigm.session import DrawnBlock


class Order(enum.Enum):
    """What the experimenter asks for."""

    GO_ON = "go on"
    PAUSE = "pause"
    END = "end"


class Log(Protocol):
    """Where a session is written down, as it goes."""

    def block(self, block: DrawnBlock, when: float) -> None:
        """A block begins."""

    def episode(self, number: int, path: Sequence[Tile], when: float) -> None:
        """An episode begins."""

    def onset(self, turn: Turn) -> None:
        """The motion of a move has begun; the turn tells when."""

    def move(self, turn: Turn, when: float) -> None:
        """A move has ended; the turn tells when it began."""

    def key(self, direction: str, ignored: str, when: float) -> None:
        """A key went down; ``ignored`` says why it does not count."""

    def event(self, kind: str, when: float, **about: Any) -> None:
        """Something else happened: a pause, trouble, a remark, the end of a block or of the session."""


@dataclass(frozen=True)
class Pacing:
    """What a session waits for.

    Attributes:
        path_after_s: From the arm's arrival at the start tile until the path appears.
        pause_s: From then until the first move of an episode, each up to a half longer at random.
        break_s: A simulated person's break between blocks, likewise.
        show_turn: Whose turn it is is shown.
        draw_tool: The tool is drawn.
        marks: Markers go out.
    """

    path_after_s: float = 0.3
    pause_s: float = 1.5
    break_s: float = 8.0
    show_turn: bool = False
    draw_tool: bool = True
    marks: bool = True


@dataclass
class Seen:
    """What the experimenter sees of a session."""

    phase: str = "the arm comes to its place"
    asked: str = ""  # by the experimenter, and not come to pass yet
    block: DrawnBlock | None = None
    episode: int = 0
    blocks_done: int = 0
    moves: deque[Turn] = field(default_factory=lambda: deque(maxlen=8))
    keys: Counter[str] = field(default_factory=Counter)  # by why they were ignored; "" counts
    n_moves: int = 0
    markers: int = 0
    health: Health | None = None
    trouble: str = ""
    cure: str = ""
    recorded: str = ""  # yes, no or lost; empty where nobody looks
    loop: str = ""  # shadow, semi or closed, once the closed loop has said something
    taken: int = 0  # steps of the person's that the robot took, in closed blocks
    left: int = 0  # steps of the robot's own that it left to the person first
    refused: int = 0  # texts of the closed loop that were not taken up
    unheard: int = 0  # moves since the closed loop has last told of one
    hardware: bool = False  # what is wrong is the arm, a stream or the window
    stops: int = 0
    whole: bool = False  # every block was done to its end
    ended: str = ""  # why it ends early
    wanted: bool = False  # a person asked for that end
    interrupted: bool = False  # a signal did

    @property
    def ignored(self) -> dict[str, int]:
        """Why keys were ignored -> how many, in the order of the words."""
        return {why: n for why, n in sorted(self.keys.items()) if why}
