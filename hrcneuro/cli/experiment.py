"""The command experiment: the study with a person, the arrow keys, the grid and the arm."""

from __future__ import annotations

from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options

_ARMS = ("sim", "ursim", "ur", "ros", "none")


@command(
    "Run the study with a person, or rehearse it with a simulated one.",
    "experiment s01 --backend ursim --human simulated --no-screen",
    "experiment s01 --human simulated --pace virtual",
    name="experiment",
)
def experiment(
    options: Options,
    subjects: Annotated[
        list[str], typer.Argument(help="Whose session; several at virtual pace.", autocompletion=completion.subjects)
    ],
    backend: Annotated[
        str, typer.Option(help="The arm: sim, ursim, ur, ros, or none.", autocompletion=completion.arms)
    ] = "",
    host: Annotated[str, typer.Option(help="Address of a real arm's controller.")] = "",
    at_the_robot: Annotated[
        bool, typer.Option("--i-am-at-the-robot", help="Someone stands at its emergency stop: a real arm needs this.")
    ] = False,
    human: Annotated[
        str, typer.Option(help="Who presses: person or simulated.", autocompletion=completion.humans)
    ] = "",
    pace: Annotated[str, typer.Option(help="The clock: real or virtual.", autocompletion=completion.paces)] = "",
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on behind the block in which the session was broken off.")
    ] = False,
    windowed: Annotated[bool, typer.Option("--windowed", help="A window in place of the full screen.")] = False,
    display: Annotated[int, typer.Option(help="Number of the person's screen.", min=0)] = 0,
    no_screen: Annotated[bool, typer.Option("--no-screen", help="No window: for a simulated person.")] = False,
    no_lsl: Annotated[bool, typer.Option("--no-lsl", help="Send no markers over LSL.")] = False,
    closed: Annotated[
        bool, typer.Option("--closed", help="Closed blocks: the robot acts by what 'hrcneuro online' learns.")
    ] = False,
    patient: Annotated[
        bool, typer.Option("--patient", help="Count packets that come late instead of stopping: ursim only.")
    ] = False,
) -> int:
    """Run sessions; return the exit code."""
    from hrcneuro.cli import experimenting
    from hrcneuro.errors import ConfigError, did_you_mean

    if backend and backend not in _ARMS:
        raise ConfigError(
            f"--backend {backend!r}{did_you_mean(backend, _ARMS)}; allowed: {', '.join(_ARMS)}",
            cure="choose one of them; none draws the tool on the grid",
        )
    given = {
        "--backend": _arm(backend),
        "--host": [f"robot.host={host}"] if host else [],
        "--i-am-at-the-robot": ["robot.at_the_robot=true"] if at_the_robot else [],
        "--human": [f"experiment.human={human}"] if human else [],
        "--pace": [f"experiment.pace={pace}"] if pace else [],
        "--windowed": ["experiment.window.windowed=true"] if windowed else [],
        "--display": [f"experiment.window.display={display}"] if display else [],
        "--no-screen": ["experiment.screen=false"] if no_screen else [],
        "--no-lsl": ["experiment.markers=none"] if no_lsl else [],
        "--closed": ["experiment.loop=closed"] if closed else [],
        "--patient": ["robot.patient=true"] if patient else [],
    }
    return experimenting.run(options, subjects, given, resume=resume)


def _arm(backend: str) -> list[str]:
    """Return the settings of ``--backend``: whichever was configured before, it is this arm or none."""
    if backend == "none":
        return ["experiment.drawn_tool=true"]
    return ["experiment.drawn_tool=false", f"robot.backend={backend}"] if backend else []
