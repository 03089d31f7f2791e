"""The edge of every command: whatever ends it becomes a message with a cure, and an exit code."""

from __future__ import annotations

import functools
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from typing import Any

import typer

from hrcneuro.errors import HrcError, StageError
from hrcneuro.options import Options


class Interrupted(HrcError):
    """Ctrl-C, or a request to end from the system (exit code 130)."""

    exit_code = 130


def bounded(name: str, command: Callable[..., int]) -> Callable[..., None]:
    """Return a command that exits with 0 ok, 1 failed, 2 usage, 3 data, 4 hardware or 130 interrupted."""

    @functools.wraps(command)
    def run(options: Options, **values: Any) -> None:
        _end_as_by_interrupt()
        try:
            code = command(options, **values)
            if sys.stdout is not None:
                sys.stdout.flush()
        except KeyboardInterrupt:
            cure = "nothing half-written is kept; the same command goes on from here"
            code = _fail(name, options, Interrupted("interrupted", cure=cure))
        except HrcError as error:
            code = _fail(name, options, error)
        except Exception as error:
            if isinstance(error, OSError) and _reader_is_gone():
                code = _without_a_reader(error)
            else:
                cure = "run it again with --debug for the traceback, and please report it as a bug"
                code = _fail(name, options, StageError(f"unexpected {type(error).__name__}: {error}", cure=cure))
        raise typer.Exit(code)

    return run


def _end_as_by_interrupt() -> None:
    # What a scheduler, a shutdown or a closed terminal sends unwinds like Ctrl-C, so that nothing stays behind.
    if threading.current_thread() is not threading.main_thread():
        return
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


def _reader_is_gone() -> bool:
    """Return whether standard output cannot be written (a socket of a stage may break too, and that is a failure)."""
    try:
        sys.stdout.flush()
    except OSError:
        # What could not be written must not be tried again when the interpreter ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return True
    return False


def _without_a_reader(error: OSError) -> int:
    if isinstance(error, BrokenPipeError):
        # hrcneuro ... | head: no failure of ours.
        return 0
    print(f"error: standard output cannot be written: {error.strerror}", file=sys.stderr)
    return StageError.exit_code


def _fail(name: str, options: Options, error: HrcError) -> int:
    from hrcneuro.console import Console

    if options.debug:
        traceback.print_exc()
    Console(as_json=options.json).fail(name, error)
    return error.exit_code
