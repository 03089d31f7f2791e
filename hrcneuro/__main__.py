"""The entry point."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable
from typing import Any

from hrcneuro import interrupts, streams

# A shell after TAB: which one it is.
_ASKED = "_HRCNEURO_COMPLETE"


def main() -> None:
    """Run ``hrcneuro`` with the arguments of this process, and exit."""
    streams.prepare()
    try:
        # What is imported stays: looking through it for garbage takes a tenth of the time of --help.
        gc.disable()
        from hrcneuro.cli import named

        app = named.program([] if _ASKED in os.environ else sys.argv[1:])
        gc.freeze()
        gc.enable()
        if _ASKED in os.environ:
            from hrcneuro.cli import shells

            code = shells.offer(app, os.environ.pop(_ASKED))
        else:
            code = _for_a_program(app) if "--json" in sys.argv[1:] else _for_a_person(app)
    except KeyboardInterrupt:
        # So early that no command has begun.
        print("interrupted", file=sys.stderr)
        code = 130
    code = streams.ended(code)
    # A second Ctrl-C may come while Python ends, and would be the exit code of a command that has told everything.
    interrupts.over()
    sys.exit(code)


def _for_a_person(app: Callable[..., Any]) -> int:
    """Return the exit code; Typer says itself what is wrong with the command line."""
    try:
        app(prog_name="hrcneuro")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


def _for_a_program(app: Callable[..., Any]) -> int:
    """Return the exit code; a mistake in the command line itself is told in JSON too."""
    try:
        return int(app(prog_name="hrcneuro", standalone_mode=False) or 0)
    except Exception as error:
        # Typer's own errors; their class lives in a module that moves from version to version.
        if not hasattr(error, "format_message") or not hasattr(error, "show"):
            raise
        from hrcneuro.cli.console import Console
        from hrcneuro.errors import ConfigError

        mistake = ConfigError(error.format_message(), cure="hrcneuro COMMAND --help lists what is allowed")
        Console(as_json=True).fail(" ".join(a for a in sys.argv[1:2] if not a.startswith("-")), mistake)
        return mistake.exit_code


if __name__ == "__main__":
    main()
