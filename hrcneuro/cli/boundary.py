"""The edge of every command: whatever ends it becomes a message with a cure, and an exit code."""

from __future__ import annotations

import contextlib
import functools
import logging
import os
import select
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import typer

from hrcneuro.cli.options import Options
from hrcneuro.errors import HrcError, StageError, StageInterrupted


class Interrupted(HrcError):
    """Ctrl-C, or a request to end from the system (exit code 130)."""

    exit_code = 130


def bounded(name: str, command: Callable[..., int]) -> Callable[..., None]:
    """Return a command that exits with 0 ok, 1 failed, 2 usage, 3 data, 4 hardware or 130 interrupted."""

    @functools.wraps(command)
    def run(options: Options, **values: Any) -> None:
        _end_as_by_interrupt()
        try:
            with contextlib.nullcontext() if options.debug else _libraries_are_silent():
                code = command(options, **values)
            if sys.stdout is not None:
                sys.stdout.flush()
        except StageInterrupted as error:
            code = _fail(name, options, Interrupted(error.problem, cure=error.cure))
        except KeyboardInterrupt:
            cure = "nothing half-written is kept; the same command goes on from here"
            code = _fail(name, options, Interrupted("interrupted", cure=cure))
        except HrcError as error:
            code = _fail(name, options, error)
        except Exception as error:
            if isinstance(error, BrokenPipeError) and _reader_is_gone():
                # hrcneuro ... | head: no failure of ours.
                code = 0
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


@contextlib.contextmanager
def _libraries_are_silent() -> Iterator[None]:
    """Keep from the terminal what libraries warn of: it speaks to programmers. Python's -W and --debug let it through.

    What a user must know of a recording reaches the notes (``sources.formats``), of a task its record.
    """
    silence = logging.NullHandler()
    logging.getLogger().addHandler(silence)
    try:
        with warnings.catch_warnings():
            if not sys.warnoptions:
                warnings.simplefilter("ignore")
            yield
    finally:
        logging.getLogger().removeHandler(silence)


def _reader_is_gone() -> bool:
    """Return whether nobody reads standard output any more (a socket of a stage may break too: that is a failure)."""
    stdout = select.poll()
    stdout.register(1, 0)
    gone = any(event & select.POLLERR for _, event in stdout.poll(0))
    if gone:
        _drop_output()
    return gone


def _drop_output() -> None:
    # What could not be written must not be tried again when the interpreter ends.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def _fail(name: str, options: Options, error: HrcError) -> int:
    from hrcneuro.cli.console import Console

    if options.debug:
        traceback.print_exc()
    try:
        Console(as_json=options.json).fail(name, error)
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        _drop_output()
        Console().fail(name, error)
    return error.exit_code
