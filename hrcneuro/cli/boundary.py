"""The edge of every command: whatever ends it becomes a message with a cure, and an exit code."""

from __future__ import annotations

import contextlib
import functools
import logging
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import typer

from hrcneuro import interrupts
from hrcneuro.cli.options import Options
from hrcneuro.errors import HrcError, StageError, StageInterrupted, of_the_system


class Interrupted(HrcError):
    """Ctrl-C, or another signal that asks a command to end."""

    def __init__(self, problem: str, *, cure: str) -> None:
        super().__init__(problem, cure=cure)
        self.exit_code = interrupts.told()[0]


def bounded(name: str, command: Callable[..., int]) -> Callable[..., None]:
    """Return a command that exits with 0 ok, 1 failed, 2 usage, 3 data, 4 hardware or 130 and more, interrupted."""

    @functools.wraps(command)
    def run(options: Options, **values: Any) -> None:
        interrupts.listen()
        try:
            options.check()
            with contextlib.nullcontext() if options.debug else _libraries_are_silent():
                code = command(options, **values)
        except StageInterrupted as error:
            code = _fail(name, options, Interrupted(error.problem, cure=error.cure))
        except KeyboardInterrupt:
            cure = "nothing half-written is kept; the same command goes on from here"
            code = _fail(name, options, Interrupted(interrupts.told()[1], cure=cure))
        except HrcError as error:
            code = _fail(name, options, error)
        except Exception as error:
            code = _fail(name, options, of_the_system(error) or _unexpected(error))
        raise typer.Exit(code)

    return run


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


def _unexpected(error: Exception) -> StageError:
    cure = "run it again with --debug for the traceback, and please report it as a bug"
    return StageError(f"unexpected {type(error).__name__}: {error}", cure=cure)


def _fail(name: str, options: Options, error: HrcError) -> int:
    from hrcneuro.cli.console import Console

    if options.debug:
        traceback.print_exc()
    Console(as_json=options.json).fail(name, error)
    return error.exit_code
