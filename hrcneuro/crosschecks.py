"""What must fit between the sections of a configuration, and what a user should at least know."""

from __future__ import annotations

from typing import Any


def errors(settings: Any) -> list[str]:
    """Return the contradictions between sections."""
    return []


def warnings(settings: Any) -> list[str]:
    """Return what is allowed but worth knowing."""
    return []
