"""How a command is declared: the program, its groups, and the decorator that adds a command to one of them.

A file of this package holds a subject's commands: what each accepts and, below, what it does. A body imports what it
needs when it runs, so that ``--help`` answers at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer

from hrcneuro import __version__
from hrcneuro.cli import completion
from hrcneuro.cli.boundary import bounded
from hrcneuro.cli.options import with_options

# A command inherits this from the program; who prints its help without, such as the documentation, sees it too.
_HELP = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    name="hrcneuro",
    help="A neuro-robotics study that anyone can rerun: EEG, decoding, robot learning and a UR10.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    # Completion is our own (completion.py, shells.py), as Typer's breaks words at = and drops apostrophes.
    add_completion=False,
    context_settings=_HELP,
    epilog="Examples:\n\n  hrcneuro preprocess s01\n\n  hrcneuro run smoke -j 2",
)

Subjects = Annotated[
    list[str] | None,
    typer.Argument(help="Subjects; none means everyone, and the group.", autocompletion=completion.subjects),
]


def group(name: str, help: str) -> typer.Typer:
    """Return a new group of commands, ``hrcneuro NAME COMMAND``."""
    made = typer.Typer(help=help, rich_markup_mode=None, no_args_is_help=True)
    app.add_typer(made, name=name, short_help=help)
    return made


def command(
    help: str, *examples: str, name: str, group: typer.Typer = app
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that declares a command: ``options`` come first, the exit code is what it returns."""
    text = "Examples:\n\n" + "\n\n".join(f"  hrcneuro {example}" for example in examples)

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        group.command(name, help=help, short_help=help, epilog=text, context_settings=_HELP)(
            with_options(bounded(name, function))
        )
        return function

    return register


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
