"""The texts of markers: tags between slashes, by which MNE selects epochs, ``move/subject=s01/scenario=iC/…``."""

from __future__ import annotations

from hrcneuro.paradigm.design import MOVE

_END = "end"
_CLOSED = "closed"
_NUMBERS = ("block", "episode", "trial")
BLOCK_TAGS = ("subject", "scenario", "block", "practice", "closed")
"""What a marker tells of the block: of its beginning, and of each move in it."""


def of_move(
    subject: str,
    *,
    scenario: str,
    block: int,
    episode: int,
    trial: int,
    practice: bool,
    actor: str | None = None,
    next: str | None = None,
    closed: bool = False,
) -> str:
    """Return the marker of a move's onset.

    Args:
        subject, scenario, block, episode, trial, practice: Which move it is.
        closed: It is of a closed block, in which the robot draws who acts: no part of the study's own.
        actor: Who makes it, ``human`` or ``robot``; no tag where it is not given.
        next: The direction of the path's pending tile after this move, of eight; empty where the path is done; no tag
            where it is not given.
    """
    known = {name: value for name, value in (("actor", actor), ("next", next)) if value is not None}
    where: dict[str, str | int] = {"scenario": scenario, "block": block, "episode": episode, "trial": trial}
    return _tagged(MOVE, subject, practice, closed, **where, **known)


def move_in(text: str) -> dict[str, str | int | bool] | None:
    """Return which move a marker tells of: subject, scenario, block, episode, trial, practice, closed.

    Markers that say it also have ``actor`` and ``next``, see :func:`of_move`. None for a text that is no marker of a
    move.
    """
    head, *tags = text.split("/")
    named = dict(tag.split("=", 1) for tag in tags if "=" in tag)
    if head != MOVE or not all(named.get(name, "").isdigit() for name in _NUMBERS):
        return None
    numbers = {name: int(named[name]) for name in _NUMBERS}
    words = {name: named.get(name, "") for name in ("subject", "scenario")}
    said: dict[str, str | int | bool] = {name: named[name] for name in ("actor", "next") if name in named}
    return {**words, **numbers, "practice": "practice" in tags, "closed": _CLOSED in tags, **said}


def block_in(text: str) -> dict[str, str | int | bool] | None:
    """Return which block a marker says to begin: subject, scenario, block, practice, closed; or None."""
    head, *tags = text.split("/")
    named = dict(tag.split("=", 1) for tag in tags if "=" in tag)
    if head != "block" or not named.get("block", "").isdigit():
        return None
    words = {name: named.get(name, "") for name in ("subject", "scenario")}
    return {**words, "block": int(named["block"]), "practice": "practice" in tags, "closed": _CLOSED in tags}


def of_block(subject: str, *, scenario: str, block: int, practice: bool, closed: bool = False) -> str:
    """Return the marker of a block's beginning."""
    return _tagged("block", subject, practice, closed, scenario=scenario, block=block)


def of_episode(subject: str, *, scenario: str, block: int, episode: int, practice: bool, closed: bool = False) -> str:
    """Return the marker of an episode's beginning: its path appears."""
    return _tagged("episode", subject, practice, closed, scenario=scenario, block=block, episode=episode)


def of_error(subject: str, *, scenario: str, block: int, episode: int, trial: int, practice: bool) -> str:
    """Return the marker of an injected error: its motion begins."""
    return _tagged("error", subject, practice, False, scenario=scenario, block=block, episode=episode, trial=trial)


def of_key(subject: str, direction: str, ignored: str = "") -> str:
    """Return the marker of a key; ``ignored`` says why it does not count."""
    return f"key/subject={subject}/direction={direction}/" + (f"ignored={ignored}" if ignored else "accepted")


def of_end(subject: str) -> str:
    """Return the marker after which none comes any more: the session has ended."""
    return f"{_END}/subject={subject}"


def end_in(text: str) -> dict[str, str] | None:
    """Return whose session a marker says to have ended, ``subject``; None for a text that is no such marker."""
    return {"subject": text.partition("subject=")[2].partition("/")[0]} if is_end(text) else None


def is_end(text: str) -> bool:
    """Return whether a marker tells that none comes any more."""
    return text.partition("/")[0] == _END


def _tagged(head: str, subject: str, practice: bool, closed: bool, **tags: str | int) -> str:
    words = [word for word, holds in (("practice", practice), (_CLOSED, closed)) if holds]
    return "/".join([head, f"subject={subject}", *(f"{name}={value}" for name, value in tags.items()), *words])
