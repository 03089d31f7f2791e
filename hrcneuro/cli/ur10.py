"""The command ur10 serve: the simulated controller, which has an entry of its own, too (python -m hrcneuro.ur10)."""

from __future__ import annotations

from typing import Annotated

import typer

from hrcneuro.cli.declare import command, group
from hrcneuro.cli.options import Options
from hrcneuro.ur10 import SOFTWARE

_ur10 = group("ur10", "A simulated UR10 controller.")


@command(
    "Run a simulated UR10 (CB3) controller that speaks UR's own protocols, until Ctrl-C or SIGTERM.",
    "ur10 serve --address 127.0.0.2",
    "ur10 serve --fault protective_stop@30",
    name="serve",
    group=_ur10,
)
def ur10_serve(
    options: Options,
    address: Annotated[str, typer.Option(help="Where it listens: ports 29998 to 30004.")] = "127.0.0.1",
    power_off: Annotated[
        bool, typer.Option("--power-off", help="Start without power, as a box just switched on.")
    ] = False,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND[=VALUE][@SECONDS]", help="Something that goes wrong; repeatable. docs/robot.md lists them."
        ),
    ] = None,
    software: Annotated[str, typer.Option(help="The version it says it is.")] = SOFTWARE,
    programs: Annotated[
        str | None, typer.Option(metavar="<path>", help="A folder of URScript files that the dashboard can load.")
    ] = None,
    open_network: Annotated[
        bool, typer.Option("--open-network", help="Allow an address that others can reach.")
    ] = False,
    until_stdin_closes: Annotated[
        bool, typer.Option("--until-stdin-closes", help="End, too, when standard input closes.")
    ] = False,
) -> int:
    """Serve until told to end."""
    from hrcneuro.ur10.serve import serve

    return serve(
        address,
        powered=not power_off,
        faults=fault or (),
        version=software,
        programs=programs,
        open_network=open_network,
        as_json=options.json,
        quiet=options.quiet,
        verbose=options.verbose,
        until_stdin_closes=until_stdin_closes,
    )
