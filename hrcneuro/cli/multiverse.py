"""The command multiverse: would another reasonable analysis have said so?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options


@command(
    "Judge every finding under other reasonable choices.",
    "multiverse paper --dry-run",
    "multiverse smoke -j 2",
    name="multiverse",
)
def multiverse(
    options: Options,
    file: Annotated[
        Path,
        typer.Argument(
            help="A file of choices (TOML), or one that comes with the program: paper or smoke.",
            autocompletion=completion.multiverses,
        ),
    ],
    disk: Annotated[
        float | None, typer.Option("--disk", metavar="GB", help="Refuse to start where it would take more at a time.")
    ] = None,
) -> int:
    """Run the study in every universe of a file of choices, and say what holds in how many."""
    from hrcneuro.cli import multiversing

    return multiversing.run(options, file, disk)
