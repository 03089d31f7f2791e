"""The options that every subcommand accepts after its name, declared once."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import typer

from hrcneuro.cli import completion
from hrcneuro.errors import ConfigError

WHERE = "auto, serial, processes, dask or slurm"


@dataclass(frozen=True)
class Options:
    """The options of one call."""

    config: Annotated[
        Path | None,
        typer.Option(
            help="Configuration in TOML, or a name such as smoke; without it ./hrcneuro.toml, else the paper's.",
            autocompletion=completion.configurations,
        ),
    ] = None
    set: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="STAGE.KEY=VALUE",
            help="One value of it; repeatable. STAGE.TABLE.KEY=VALUE adds to a table, STAGE.TABLE={} empties it.",
            autocompletion=completion.assignments,
        ),
    ] = None
    workdir: Annotated[Path, typer.Option(help="Where cache/ and results/ lie.")] = Path()
    jobs: Annotated[
        int | None,
        typer.Option("-j", "--jobs", help="Jobs at a time, 1 or more; without it one a core, on a cluster all."),
    ] = None
    executor: Annotated[
        str,
        typer.Option(help=f"Where jobs run: {WHERE}.", autocompletion=completion.executors),
    ] = "auto"
    second_cache: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="URL",
            help="A second cache (s3://, ssh://, file:// or a folder): what it has is taken from there and not run.",
        ),
    ] = None
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would run and why; run nothing.")] = False
    force: Annotated[bool, typer.Option("--force", help="Run what is named even if it is up to date.")] = False
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Compute numbers alone; draw nothing.")] = False
    verify: Annotated[bool, typer.Option("--verify", help="Hash every file taken from the cache.")] = False
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document on standard output.")] = False
    verbose: Annotated[bool, typer.Option("-v", "--verbose", help="Say more: every hit, and why things run.")] = False
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="Say nothing but errors.")] = False
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False

    def check(self) -> None:
        """Refuse what no command can work with.

        Raises:
            ConfigError: Fewer jobs at a time than one are asked for.
        """
        if self.jobs is not None and self.jobs < 1:
            raise ConfigError(
                f"-j {self.jobs} asks for no worker",
                cure="give -j a number of at least 1, or leave it out for one job a core, on a cluster all",
            )


def with_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command that takes ``options: Options`` first the options above, behind its own parameters."""
    own = list(inspect.signature(command, eval_str=True).parameters.values())[1:]
    shared = _shared()

    @functools.wraps(command)
    def wrapper(**values: Any) -> Any:
        options = Options(**{p.name: values.pop(p.name) for p in shared})
        return command(options, **values)

    ordered = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own] + shared
    wrapper.__signature__ = inspect.Signature(ordered)  # type: ignore[attr-defined]
    wrapper.__annotations__ = {p.name: p.annotation for p in ordered}
    del wrapper.__wrapped__
    return wrapper


@functools.cache
def _shared() -> list[inspect.Parameter]:
    """Return the options as parameters; made once, as each command has them and ``--help`` must not wait."""
    hints = inspect.get_annotations(Options, eval_str=True).values()
    return [
        inspect.Parameter(f.name, inspect.Parameter.KEYWORD_ONLY, default=f.default, annotation=hint)
        for f, hint in zip(fields(Options), hints, strict=True)
    ]
