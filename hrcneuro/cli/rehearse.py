"""The command rehearse: a session with nobody in it, recorded and analysed, before the first participant comes."""

from __future__ import annotations

from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options


@command(
    "Rehearse a session: amplifier, recorder, experiment and analysis, simulated.",
    "rehearse s01",
    "rehearse s01 --pace real",
    name="rehearse",
)
def rehearse(
    options: Options,
    subject: Annotated[str, typer.Argument(help="Whose session.", autocompletion=completion.subjects)],
    pace: Annotated[
        str,
        typer.Option(
            help="virtual: a whole session, quickly. real: a block over LSL, with the simulated controller.",
            autocompletion=completion.paces,
        ),
    ] = "virtual",
    screen: Annotated[bool, typer.Option("--screen", help="At real pace: open the person's window, too.")] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="At real pace: stop on packets that come late, as under a real arm.")
    ] = False,
) -> int:
    """Run the session and its analysis; return the exit code."""
    from hrcneuro.cli import rehearsing

    return rehearsing.run(options, subject, pace, screen=screen, patient=not strict)
