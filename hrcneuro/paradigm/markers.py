"""The texts of markers: tags between slashes, by which MNE selects epochs, ``move/subject=s01/scenario=iC/…``."""

from __future__ import annotations

from hrcneuro.paradigm.design import MOVE

_NUMBERS = ("block", "episode", "trial")


def of_move(subject: str, *, scenario: str, block: int, episode: int, trial: int, practice: bool) -> str:
    """Return the marker of a move's onset."""
    text = f"{MOVE}/subject={subject}/scenario={scenario}/block={block}/episode={episode}/trial={trial}"
    return f"{text}/practice" if practice else text


def move_in(text: str) -> dict[str, str | int | bool] | None:
    """Return which move a marker tells of: ``subject``, ``scenario``, ``block``, ``episode``, ``trial``, ``practice``.

    None for a text that is no marker of a move.
    """
    head, *tags = text.split("/")
    named = dict(tag.split("=", 1) for tag in tags if "=" in tag)
    if head != MOVE or not all(named.get(name, "").isdigit() for name in _NUMBERS):
        return None
    numbers = {name: int(named[name]) for name in _NUMBERS}
    words = {name: named.get(name, "") for name in ("subject", "scenario")}
    return {**words, **numbers, "practice": "practice" in tags}
