"""The command line: a file a subject, in the order in which ``--help`` lists them."""

from __future__ import annotations

# Importing a file declares its commands.
from hrcneuro.cli import (  # noqa: F401
    acquire,
    amp,
    cache,
    config,
    doctor,
    experiment,
    export,
    init,
    multiverse,
    online,
    record,
    rehearse,
    robot,
    run,
    simulate,
    stages,
    timing,
    transfer,
    ur10,
)  # fmt: skip
from hrcneuro.cli.declare import app

__all__ = ["app"]
