"""The words of the authors' logs and metadata, and ours: one vocabulary for reading and writing them."""

from __future__ import annotations

from typing import Any

LOG = {
    "Scenario": "scenario",
    "Block": "block",
    "Episode": "episode",
    "Trial": "trial",
    "Target direction": "target",
    "Subject_key_pressed or agent": "key",
    "Movement direction": "logged",
    "Error/NonError": "error",
    "Current x": "row",
    "Current y": "col",
}
"""Columns of ``subjectNN.csv``, in order. x is the row, y the column, after the move."""

METADATA = {
    "Block": "block",
    "Episode": "episode",
    "Start position x": "start_row",
    # Not a slip of ours: the authors' column of the start's y has this name.
    "End position y": "start_col",
    "Goal position x": "goal_row",
    "Goal position y": "goal_col",
    "Agent errors": "agent_errors",
    "Agent total movements": "agent_moves",
    "Interface errors": "human_errors",
    "Interface total movements": "human_moves",
    "Agent correct %": "agent_correct",
    "Interface correct %": "human_correct",
    "Total correct %": "total_correct",
}
"""Columns of ``metadataNN.csv``, in order. The interface's errors count wrong keys too."""

SCENARIOS = {"Shared_Responsibility": "iC", "Shared_Workspace": "sC"}
TARGETS = {
    "North": "N", "Northeast": "NE", "East": "E", "Southeast": "SE",
    "South": "S", "Southwest": "SW", "West": "W", "Northwest": "NW",
}  # fmt: skip
KEYS = {"Agent": "", "Subject Up": "N", "Subject Right": "E", "Subject Down": "S", "Subject Left": "W"}
MOVES = {"north": "N", "east": "E", "south": "S", "west": "W"}
ERRORS = {"Error": True, "NonError": False}
WORDS: dict[str, dict[str, Any]] = {
    "scenario": SCENARIOS, "target": TARGETS, "key": KEYS, "logged": MOVES, "error": ERRORS,
}  # fmt: skip


def mirrored(direction: str, *, error: bool, intended: str) -> str:
    """Return a move's direction as the log has it, or, from the log's, the true one.

    The authors' log has a mistake of its own: an error on a move that was meant to go north swaps East and West.
    """
    return {"E": "W", "W": "E"}.get(direction, direction) if error and intended == "N" else direction
