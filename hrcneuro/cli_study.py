"""Declarations of the commands around a study: doctor, init, export."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from hrcneuro import completion
from hrcneuro.options import Options

Subjects = Annotated[
    list[str] | None, typer.Argument(help="Subjects; none means everyone.", autocompletion=completion.subjects)
]


def declare(command: Callable[..., Any]) -> None:
    """Declare the commands; ``command(help, *examples, name=…)`` is the decorator that registers one."""

    @command(
        "Say what this machine offers: versions, libraries, extras, room, and a test of the cache.",
        "doctor",
        "doctor --json",
        name="doctor",
    )
    def doctor(options: Options) -> int:
        from hrcneuro import study_commands

        return study_commands.doctor(options)

    @command(
        "Make a new study that runs as it is: configuration, README, .gitignore.",
        "init mystudy",
        "init studies/second --dry-run",
        name="init",
    )
    def init(options: Options, folder: Annotated[Path, typer.Argument(help="A folder that is new or empty.")]) -> int:
        from hrcneuro import study_commands

        return study_commands.init(options, folder)

    @command(
        "Write recordings, trials and results in the form of other tools.",
        "export --bids bids",
        "export --bids bids s01 --raw",
        name="export",
    )
    def export(
        options: Options,
        subjects: Subjects = None,
        bids: Annotated[Path | None, typer.Option(help="A folder to write a BIDS data set into.")] = None,
        raw: Annotated[bool, typer.Option("--raw", help="Only the recordings, no derivatives.")] = False,
    ) -> int:
        from hrcneuro import study_commands

        return study_commands.export(options, subjects, bids=bids, raw=raw)
