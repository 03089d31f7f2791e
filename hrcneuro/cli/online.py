"""The command online: the decoder at work within each move, and what the robot learns of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options
from hrcneuro.errors import ConfigError


@command(
    "Decode and learn within each move of a running session, or of a recording.",
    "online s01 --mode closed",
    "online s01 --replay recordings/s01/2026-01-01T090000",
    name="online",
)
def online(
    options: Options,
    subject: Annotated[str, typer.Argument(help="Whose session.", autocompletion=completion.subjects)],
    mode: Annotated[str, typer.Option(help="shadow, semi or closed.", autocompletion=completion.modes)] = "",
    replay: Annotated[Path | None, typer.Option(help="A recording's folder: the same over what was recorded.")] = None,
    chunk: Annotated[int, typer.Option(help="Samples that come together in a replay.", min=1)] = 10,
    log: Annotated[
        Path | None, typer.Option(help="decisions.jsonl of the live session; without it the one beside the recording.")
    ] = None,
    decoder: Annotated[
        Path | None, typer.Option(help="Folder of a decoder; without it the subject's own, of calibrate.")
    ] = None,
    go_on: Annotated[
        bool, typer.Option("--go-on", help="Begin with what the subject's last loop had learned, from its log.")
    ] = False,
    seconds: Annotated[float, typer.Option(help="End by itself after so long; 0: at the end, or Ctrl-C.", min=0)] = 0,
) -> int:
    """Decide until the session ends; return the exit code."""
    from hrcneuro.cli import bring, onlining
    from hrcneuro.pipeline.graph import check_subject

    if go_on and replay is not None:
        raise ConfigError(
            "--go-on with --replay: a replay goes over what was recorded, and goes on with nothing",
            cure="leave one of them out",
        )
    study = bring.settings(options, others={"--mode": [f"online.mode={mode}"] if mode else []})
    check_subject(study, subject)
    task = onlining.Task(study, subject, options, decoder)
    if options.dry_run:
        return task.look()
    return task.replay(replay, chunk, log) if replay is not None else task.live(seconds, go_on=go_on)
