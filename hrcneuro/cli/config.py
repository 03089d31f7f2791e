"""The commands of the configuration: show, check."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command, group
from hrcneuro.cli.options import Options

_config = group("config", "Show or check the configuration.")


@command(
    "Print every value, its range and where it came from.",
    "config show",
    "config show --set decode.repeats=5",
    name="show",
    group=_config,
)
def show(
    options: Options,
    section: Annotated[
        str, typer.Argument(help="One section; none prints all.", autocompletion=completion.sections)
    ] = "",
) -> int:
    """Print the effective configuration, with the origin and the range of each value."""
    from hrcneuro.cli import bring
    from hrcneuro.config import text

    print(text.render(bring.settings(options), section, as_json=options.json))
    return 0


@command(
    "Report every mistake of a configuration.",
    "config check",
    "config check --config smoke",
    name="check",
    group=_config,
)
def check(options: Options) -> int:
    """Report the mistakes of a configuration (by raising them), else its warnings.

    Its recordings, and estimators of other people that it names, are looked at, too.
    """
    from hrcneuro import stages
    from hrcneuro.cli import bring
    from hrcneuro.config import recordings

    settings = bring.settings(options)
    for name in settings.stages:
        stages.load(name).ready(settings.sections[name])
    warnings = [*settings.warnings, *recordings.check(settings)]
    if options.json:
        print(json.dumps({"command": "config check", "ok": True, "warnings": warnings}, indent=1))
    else:
        for warning in warnings:
            print(f"note: {warning}")
        print("the configuration is sound")
    return 0
