"""What the parts of an experiment say to each other: the flow, the arm's side and the window, whatever carries it.

Times are seconds of one clock that all parts share: the machine's monotonic one, or the virtual one.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from hrcneuro.paradigm.grid import Tile
from hrcneuro.robot.events import Approach, Arrived, Finish, InRadius, Ready

# --- to the arm's side ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Go:
    """Make a move; it begins as soon as the arm may: at rest, or once the move before is in its radius.

    Attributes:
        index: Number of the move in the session, from 0.
        start, end: Tiles; the same where the grid's edge stops the move: the arm stays for ``t_f``.
        t_f: Duration, seconds.
        marker: Text of the marker of its onset.
        code: What stands on the trigger port at its onset.
        not_before: It begins no earlier, seconds.
    """

    index: int
    start: Tile
    end: Tile
    t_f: float
    marker: str
    code: int = 1
    not_before: float = 0.0


@dataclass(frozen=True)
class Mark:
    """Send a marker of something that is no motion, and happened at ``when``."""

    text: str
    when: float


@dataclass(frozen=True)
class Truth:
    """Tell a simulated person's amplifier what comes, as :mod:`hrcneuro.live.person` has it."""

    move: dict[str, Any]


Request = Approach | Go | Mark | Truth | Finish

# --- from the arm's side ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Onset:
    """A move began at ``when``; ``marked`` is the marker's stamp on LSL's clock, NaN without one."""

    index: int
    when: float
    marked: float = float("nan")


@dataclass(frozen=True)
class Executed:
    """A move has ended."""

    index: int
    when: float


@dataclass(frozen=True)
class Health:
    """How the arm is, a few times a second: the greatest of the time since the last one."""

    when: float
    packet_age: float  # seconds
    path_error: float  # metres
    late: float  # of a cycle, seconds
    late_packets: int = 0  # borne with ``patient``, since the start


@dataclass(frozen=True)
class Halted:
    """The arm was stopped: why, and what to do; ``rests``: whether it was seen at rest."""

    problem: str
    cure: str
    rests: bool
    when: float


@dataclass(frozen=True)
class Ended:
    """The arm rests and was let go, as asked."""

    when: float


@dataclass(frozen=True)
class Trouble:
    """Something beside the arm failed, such as the trigger port: the arm goes on; the session should pause at rest."""

    problem: str
    cure: str
    when: float


@dataclass(frozen=True)
class Said:
    """What the arm's side tells the experimenter, a line or two; the flow does not hear it."""

    text: str


Report = Ready | Arrived | Onset | InRadius | Executed | Health | Trouble | Halted | Ended

# --- to the window ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Motion:
    """The tool goes from tile to tile by minimum jerk, from ``when`` on, in ``t_f`` seconds; drawn where no arm is."""

    start: Tile
    end: Tile
    when: float
    t_f: float


@dataclass(frozen=True)
class Scene:
    """What the person sees, until the next scene.

    Attributes:
        scenario: ``sC`` shows two areas, ``iC`` the person's two arrows; empty: the bare grid, or only words.
        human_tiles: The person's area (sC).
        human_colour: ``green`` or ``blue`` (sC); the robot has the other.
        human_directions: The person's two directions (iC), of N, E, S, W.
        path: Tiles from start to goal; none while the arm goes to the start tile.
        turn: ``human`` or ``robot`` where whose turn it is is shown; else empty.
        tool: The motion of a drawn tool; none: the tool is not drawn.
        title, lines: Words in the place of the grid, or none.
        alarm: The words tell of something wrong.
    """

    scenario: str = ""
    human_tiles: frozenset[Tile] = frozenset()
    human_colour: str = ""
    human_directions: frozenset[str] = frozenset()
    path: tuple[Tile, ...] = ()
    turn: str = ""
    tool: Motion | None = None
    title: str = ""
    lines: tuple[str, ...] = field(default=())
    alarm: bool = False


# --- from the window --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Key:
    """A key went down: ``N``, ``E``, ``S``, ``W`` for the arrows, ``escape``, or ``other``."""

    name: str
    when: float


@dataclass(frozen=True)
class Closed:
    """The window was closed, or its process has ended; ``problem`` says what was wrong, if anything."""

    problem: str = ""
    cure: str = ""


@dataclass(frozen=True)
class Focus:
    """The window has got the keyboard (``has``), or another window has it: then the person's keys go there."""

    has: bool
    when: float
