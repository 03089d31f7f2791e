"""The edge of every command: whatever ends it becomes a message with a cure, and an exit code."""

from __future__ import annotations

import functools
import os
import sys
import traceback
from collections.abc import Callable
from typing import Any

import typer

from hrcneuro.errors import HrcError, StageError
from hrcneuro.options import Options

INTERRUPTED = 130


def bounded(name: str, command: Callable[..., int]) -> Callable[..., None]:
    """Return a command that exits with 0 ok, 1 failed, 2 usage, 3 data, 4 hardware or 130 interrupted."""

    @functools.wraps(command)
    def run(options: Options, **values: Any) -> None:
        try:
            code = command(options, **values)
            sys.stdout.flush()
        except KeyboardInterrupt:
            print("interrupted: nothing half-written is kept; the same command goes on from here", file=sys.stderr)
            code = INTERRUPTED
        except BrokenPipeError:
            # The reader went away (hrcneuro ... | head): no failure of ours, and no complaint at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            code = 0
        except HrcError as error:
            code = _fail(name, options, error)
        except Exception as error:
            cure = "run it again with --debug for the traceback, and please report it as a bug"
            code = _fail(name, options, StageError(f"unexpected {type(error).__name__}: {error}", cure=cure))
        raise typer.Exit(code)

    return run


def _fail(name: str, options: Options, error: HrcError) -> int:
    from hrcneuro.console import Console

    if options.debug:
        traceback.print_exc()
    Console(as_json=options.json).fail(name, error)
    return error.exit_code
