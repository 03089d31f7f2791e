"""The command line: a file a subject, in the order in which ``--help`` lists them."""

from __future__ import annotations

from typing import Annotated

import typer

from hrcneuro import __version__

# Importing a file declares its commands.
from hrcneuro.cli import (  # noqa: F401
    acquire,
    amp,
    cache,
    config,
    doctor,
    experiment,
    export,
    init,
    multiverse,
    online,
    record,
    rehearse,
    robot,
    run,
    simulate,
    stages,
    timing,
    transfer,
    ur10,
)  # fmt: skip
from hrcneuro.cli.declare import app

__all__ = ["app"]


@app.callback(invoke_without_command=True)
def _main(
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.", is_eager=True)] = False,
    install_completion: Annotated[
        bool, typer.Option("--install-completion", help="Teach your shell (bash, zsh or fish) what TAB offers.")
    ] = False,
    show_completion: Annotated[
        bool, typer.Option("--show-completion", help="Print what your shell would be taught.")
    ] = False,
) -> None:
    if version:
        print(f"hrcneuro {__version__}")
        raise typer.Exit
    if install_completion or show_completion:
        from hrcneuro.cli import shells

        raise typer.Exit(shells.teach(install=install_completion))
