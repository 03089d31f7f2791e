"""The command amp: a simulated amplifier on LSL."""

from __future__ import annotations

from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options


@command(
    "Send a simulated amplifier's EEG over LSL, at true pace, until Ctrl-C.",
    "amp s01",
    "amp s01 --replay --fault drop=0.5@60",
    name="amp",
)
def amp(
    options: Options,
    subject: Annotated[str, typer.Argument(help="Whose EEG.", autocompletion=completion.subjects)],
    replay: Annotated[
        bool, typer.Option("--replay", help="Send what acquire reads, with its markers, to its end.")
    ] = False,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND[=VALUE][@SECONDS]",
            help="Something that goes wrong; repeatable. docs/recording.md lists them.",
        ),
    ] = None,
    seconds: Annotated[float, typer.Option(help="End by itself after so long; 0: at Ctrl-C.", min=0)] = 0,
    sitting: Annotated[int, typer.Option(help="Another recording of the same simulated person: 1, 2, …", min=0)] = 0,
    stream: Annotated[str, typer.Option(help="The stream's name.")] = "actiCHamp",
) -> int:
    """Send until told to end."""
    from hrcneuro.cli import amplifying, bring
    from hrcneuro.live.faults import parse
    from hrcneuro.pipeline.graph import check_subject

    faults = [parse(text) for text in fault or ()]
    study = bring.settings(options)
    check_subject(study, subject)
    recorded = amplifying.recorded(options, study, subject) if replay else None
    return amplifying.run(
        study,
        subject,
        stream,
        recorded,
        faults,
        bring.console(options),
        seconds=seconds,
        as_json=options.json,
        sitting=sitting,
    )
