"""The command simulate: the stage, and the design sweep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import typer

from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options


@command(
    "Simulate the robot that learns who does what (SIM1-4); design the next experiment.",
    "simulate --set simulate.repetitions=1000",
    "simulate --sweep accuracy=55,60,70 --sweep subtasks=4,6",
    name="simulate",
)
def simulate(
    options: Options,
    sweep: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=VALUES",
            help="Sweep accuracy, subtasks, chosen, alpha, tau, events or period; repeatable. wide: 10,125 cells.",
        ),
    ] = None,
) -> int:
    """Run the stage, with a design sweep where one is asked for."""
    from hrcneuro.cli import bring

    return bring.stage("simulate", _with_sweep(options, sweep or []), None)


def _with_sweep(options: Options, axes: Sequence[str]) -> Options:
    """Return the options with ``--sweep AXIS=VALUES`` written as assignments.

    Raises:
        ConfigError: An axis has no values.
    """
    from hrcneuro.errors import ConfigError
    from hrcneuro.stages.simulate import WIDE_SWEEP

    added = []
    for text in axes:
        if text == "wide":
            added += [f"simulate.sweep.{axis}={list(values)}" for axis, values in WIDE_SWEEP.items()]
            continue
        axis, equals, values = text.partition("=")
        if not equals or not axis.strip() or not values.strip():
            raise ConfigError(
                f"--sweep {text!r} names no values", cure="write --sweep accuracy=55,60,65, or --sweep wide"
            )
        added.append(f"simulate.sweep.{axis.strip()}=[{values}]")
    return replace(options, set=[*(options.set or []), *added])
