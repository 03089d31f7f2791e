"""The command simulate: the stage, and the design sweep."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options

_EXAMPLE = "--sweep accuracy=55,60,65"


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
            autocompletion=completion.axes,
        ),
    ] = None,
    evidence: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Session logs of a closed loop with people (Ehrlich & Cheng 2018): replay them, and hold what was "
            "foretold against them.",
        ),
    ] = None,
) -> int:
    """Run the stage, with a design sweep and evidence where they are asked for."""
    from hrcneuro.cli import bring

    assignments, mistakes = _assignments(sweep or [])
    # In quotes, whatever it looks like; a byte that is no text stays one.
    logs = [f"simulate.evidence={json.dumps(str(evidence), ensure_ascii=False)}"] if evidence else []
    others = {"--sweep": assignments, "--evidence": logs}
    return bring.stage("simulate", options, None, others=others, mistakes=mistakes)


def _assignments(texts: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return ``--sweep`` as assignments such as ``--set`` takes, and its mistakes."""
    from hrcneuro.learning.grid import WIDE

    names = [text.partition("=")[0].strip() for text in texts]
    mistakes = [
        f"--sweep names {axis} twice; allowed: each axis once"
        for axis in sorted(set(names) - {""})
        if names.count(axis) > 1
    ]
    asked: dict[str, list[float]] = {}
    for text in texts:
        if text != "wide":
            mistakes += _read_axis(text, asked)
    values = {**(WIDE if "wide" in texts else {}), **asked}
    return [f"simulate.sweep.{axis}={list(numbers)}" for axis, numbers in values.items()], mistakes


def _read_axis(text: str, asked: dict[str, list[float]]) -> list[str]:
    """Put the numbers of ``AXIS=VALUES`` into ``asked``; return what is wrong with the text."""
    name, _, rest = text.partition("=")
    # A comma at the end is no value, as in TOML.
    axis, words = name.strip(), [word.strip() for word in rest.strip().removesuffix(",").split(",")]
    if not axis or words == [""]:
        return [f"--sweep {text!r} names no {'values' if axis else 'axis'}; allowed: {_EXAMPLE}"]
    numbers, mistakes = [], []
    for word in words:
        try:
            numbers.append(float(word))
        except ValueError:
            mistakes.append(f"--sweep {axis}: {word!r} is no number; allowed: each value by itself, {_EXAMPLE}")
    if not mistakes:
        asked.setdefault(axis, []).extend(numbers)
    return mistakes
