"""Which file declares a command: a call waits for that one, and for no other command to be declared."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

import typer

from hrcneuro.cli import declare

FILES = {
    **dict.fromkeys(("run", "status", "show", "path", "report"), "run"),
    **dict.fromkeys(("preprocess", "epoch", "erp", "ersp", "rerp", "decode", "transfer", "calibrate"), "stages"),
    # Which adds to the group that cache.py declares.
    "cache": "transfer",
    **{name: name for name in ("acquire", "amp", "config", "doctor", "experiment", "export", "init", "multiverse")},
    **{name: name for name in ("online", "record", "rehearse", "robot", "simulate", "timing", "ur10")},
}
"""Command or group -> the file that declares it, and imports whatever declares the rest of it; of others, all files."""


def program(arguments: Sequence[str]) -> typer.Typer:
    """Return the program with the command that the arguments name; with all, where they name none at once."""
    name = arguments[0] if arguments else ""
    importlib.import_module(f"hrcneuro.cli.{FILES.get(name, 'app')}")
    return declare.app
