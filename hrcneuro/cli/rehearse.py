"""The command rehearse: a session with nobody in it, recorded and analysed, before the first participant comes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options
from hrcneuro.errors import ConfigError


@command(
    "Rehearse a session: amplifier, recorder, experiment and analysis, simulated.",
    "rehearse s01",
    "rehearse s01 --closed",
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
    closed: Annotated[
        bool, typer.Option("--closed", help="Calibrate on it, then closed blocks: the robot learns who does what.")
    ] = False,
    mode: Annotated[
        str, typer.Option(help="Of closed blocks: shadow, semi or closed.", autocompletion=completion.modes)
    ] = "closed",
    sessions: Annotated[int, typer.Option(help="Closed sessions, at virtual pace.", min=1, max=999)] = 1,
    decoder: Annotated[
        Path | None, typer.Option(help="For closed blocks: folder of a decoder, in place of calibrating.")
    ] = None,
) -> int:
    """Run the session and its analysis; return the exit code."""
    from hrcneuro.cli import rehearsing

    if closed:
        from hrcneuro.cli import rehearsing_closed

        rehearsing.check_pace(pace)
        wish = rehearsing_closed.Wish(pace, mode, sessions, decoder, screen, patient=not strict)
        return rehearsing_closed.run(options, subject, wish)
    if sessions != 1 or decoder is not None:
        raise ConfigError(
            f"{'--sessions' if sessions != 1 else '--decoder'} without --closed: it is of closed blocks",
            cure="leave it out, or rehearse closed blocks: --closed",
        )
    return rehearsing.run(options, subject, pace, screen=screen, patient=not strict)
