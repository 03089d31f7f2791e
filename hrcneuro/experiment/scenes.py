"""What the person is shown, as scenes: the grid with its path, and words between blocks, in a pause and in trouble."""

from __future__ import annotations

from hrcneuro.experiment.messages import Motion, Scene
from hrcneuro.paradigm.grid import Tile
from hrcneuro.paradigm.owners import Areas, Directions, Owners
from hrcneuro.paradigm.session import DrawnBlock

_ARROWS = {"N": "up", "S": "down", "W": "left", "E": "right"}
_BEGIN = "Press an arrow key to begin."
_GOES_ON = "Please wait for the experimenter."
KEYBOARD_LOST = "Another window has the keyboard."
_REASONS = (
    # How a reason begins, and what of it is for the person.
    ("the recorder has lost", "The recording is being looked after."),
    ("nobody records", "The recording is being looked after."),
    (KEYBOARD_LOST, KEYBOARD_LOST),
)


def grid(block: DrawnBlock, *, path: tuple[Tile, ...] = (), turn: str = "", tool: Motion | None = None) -> Scene:
    """Return the grid of a block; without a ``path`` while the arm goes to the start tile (paper §2.2)."""
    owners = block.owners
    if isinstance(owners, Areas):
        return Scene(
            scenario="sC", human_tiles=owners.human, human_colour=owners.human_colour, path=path, turn=turn, tool=tool
        )
    return Scene(scenario="iC", human_directions=owners.human, path=path, turn=turn, tool=tool)


def before(block: DrawnBlock) -> Scene:
    """Return the words before a block: what is whose."""
    title = "Practice" if block.block.practice else "Next block"
    scene = grid(block)
    whose = _whose_closed(block.owners) if block.closed else _whose(block.owners)
    return Scene(
        scenario=scene.scenario,
        human_colour=scene.human_colour,
        human_directions=scene.human_directions,
        title=title,
        lines=(*whose, _BEGIN),
    )


def _whose(owners: Owners) -> tuple[str, ...]:
    if isinstance(owners, Areas):
        other = "blue" if owners.human_colour == "green" else "green"
        return f"{owners.human_colour.capitalize()} tiles are yours.", f"{other.capitalize()} tiles are the robot's."
    return f"You move {_mine(owners)}.", "The robot moves the other two ways."


def _whose_closed(owners: Owners) -> tuple[str, ...]:
    assert not isinstance(owners, Areas)
    return f"You move {_mine(owners)}.", "The robot learns which ways are yours.", "Where it waits, press your arrow."


def _mine(owners: Directions) -> str:
    return " and ".join(word for key, word in _ARROWS.items() if key in owners.human)


def rest() -> Scene:
    """Return the words of a break between blocks."""
    return Scene(title="Break", lines=("Rest as long as you like.", "Press an arrow key when you are ready."))


def welcome() -> Scene:
    """Return the words while the arm comes to its place."""
    return Scene(title="Please wait", lines=("The robot comes to its place.",))


def pause(why: str) -> Scene:
    """Return the words of a pause; ``why`` is empty where the experimenter asked for it.

    Paths and errors in ``why`` are the experimenter's: the person reads one of a few sentences.
    """
    known = next((words for begins, words in _REASONS if why.startswith(begins)), "The session pauses.")
    return Scene(title="Pause", lines=((known,) if why else ()) + (_GOES_ON,), alarm=bool(why))


def trouble(why: str) -> Scene:
    """Return the words where the arm was stopped."""
    return Scene(title="Stopped", lines=(why, "Please stay where you are.", _GOES_ON), alarm=True)


def end() -> Scene:
    """Return the last words."""
    return Scene(title="Thank you", lines=("This was the last block.",))


def ended_early() -> Scene:
    """Return the last words of a session that somebody ended."""
    return Scene(title="The end", lines=("The session ends here.",))
