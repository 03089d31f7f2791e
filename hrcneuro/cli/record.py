"""The command record: a session's streams into a file, until Ctrl-C."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options


@command(
    "Record a session's LSL streams, until Ctrl-C.",
    "record s01 --check",
    "record s01 --seconds 600",
    name="record",
)
def record(
    options: Options,
    subject: Annotated[str, typer.Argument(help="Who is recorded.", autocompletion=completion.subjects)],
    check: Annotated[bool, typer.Option("--check", help="Look at the streams only; record nothing.")] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the subject's last recording, in a new part.")
    ] = False,
    seconds: Annotated[float, typer.Option(help="End by itself after so long; 0: at Ctrl-C.", min=0)] = 0,
) -> int:
    """Look at the declared streams, record them, and check the file; return the exit code."""
    from hrcneuro.cli import bring, recording
    from hrcneuro.live.parameters import undeclared
    from hrcneuro.pipeline.graph import check_subject

    study = bring.settings(options)
    check_subject(study, subject)
    wanted = study.live["record"]
    if said := undeclared(wanted):
        bring.console(options).say(f"note: {said}", style="yellow")
    if options.dry_run or check:
        looked = recording.check(wanted)
        print(json.dumps(looked, indent=1) if options.json else "\n".join(recording.in_words(looked)))
        return 0
    talk = bring.console(options)
    answer = recording.run(options.workdir, subject, wanted, talk, seconds=seconds, resume=resume)
    if options.json:
        print(json.dumps({"command": "record", "ok": answer.code == 0, **answer.about}, indent=1))
    else:
        talk.results(answer.lines)
    return answer.code
