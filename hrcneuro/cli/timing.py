"""The command timing: how punctual a recorded session was, as numbers, a picture and a page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options


@command(
    "Measure the chain from command to trigger edge: delays, jitter, drift.",
    "timing s01",
    "timing s01 --live 60",
    name="timing",
)
def timing(
    options: Options,
    subject: Annotated[str, typer.Argument(help="Whose session.", autocompletion=completion.subjects)],
    recording: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="A recording; without it the subject's newest one.")
    ] = None,
    live: Annotated[float, typer.Option(metavar="SECONDS", help="Measure a running session for so long.", min=0)] = 0,
    end: Annotated[
        str, typer.Option(metavar="CHANNEL", help="A channel that sees the event itself: photodiode or loop-back.")
    ] = "",
) -> int:
    """Measure, print, draw; return 0."""
    from hrcneuro.cli import bring, timing_of
    from hrcneuro.pipeline.graph import check_subject

    study = bring.settings(options)
    check_subject(study, subject)
    done = timing_of.measure(options.workdir, subject, study, recording, bring.console(options), live=live, end=end)
    if options.json:
        print(json.dumps({"command": "timing", "ok": True, **done.about}, indent=1))
    else:
        bring.console(options).results(done.lines)
    return 0
