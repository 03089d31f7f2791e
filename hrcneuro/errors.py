"""Errors that a person can act on: what is wrong, and how to cure it. Each class carries the process's exit code."""

from __future__ import annotations

import contextlib
import difflib
from collections.abc import Iterable, Iterator, Mapping


class HrcError(Exception):
    """A failure with one message (what, what was got, what is allowed) and one cure."""

    exit_code = 1

    def __init__(self, problem: str, *, cure: str = "") -> None:
        super().__init__(problem, cure)
        self.problem = problem
        self.cure = cure

    def __str__(self) -> str:
        return f"{self.problem}\n  cure: {self.cure}" if self.cure else self.problem

    def __reduce__(self) -> tuple:
        return _rebuild, (type(self), self.problem, self.cure)


def _rebuild(kind: type[HrcError], problem: str, cure: str) -> HrcError:
    # Keyword-only arguments do not survive pickling, and errors travel back from worker processes.
    return kind(problem, cure=cure)


class StageError(HrcError):
    """A stage could not finish its work (exit code 1)."""


class ConfigError(HrcError):
    """The command line or the configuration is wrong (exit code 2)."""

    exit_code = 2


class DataError(HrcError):
    """A recording, log or artifact is missing, truncated or contradicts another (exit code 3)."""

    exit_code = 3


class HardwareError(HrcError):
    """A robot or a stream is unavailable, or was stopped (exit code 4)."""

    exit_code = 4


class StageInterrupted(KeyboardInterrupt):
    """Ctrl-C in a stage that has more to say about it; it passes every place that KeyboardInterrupt does."""

    def __init__(self, problem: str, *, cure: str) -> None:
        super().__init__(problem)
        self.problem = problem
        self.cure = cure


Cures = Mapping[type[ValueError], tuple[type[HrcError], str]]
"""What a numeric package raises -> what the user gets instead, and its cure."""


@contextlib.contextmanager
def cured(cures: Cures) -> Iterator[None]:
    """Turn a ValueError of the numeric packages, which know no option, into an error that a person can act on.

    Args:
        cures: By the error's class, or the nearest that it derives from; ``{name}`` in a cure stands for an attribute
            of the error. Other errors pass.
    """
    try:
        yield
    except ValueError as error:
        kind, cure = next((cures[one] for one in type(error).__mro__ if one in cures), (None, ""))
        if kind is None:
            raise
        raise kind(str(error), cure=cure.format_map(vars(error))) from error


def did_you_mean(word: str, allowed: Iterable[str]) -> str:
    """Return ``' (did you mean …?)'`` with the nearest allowed spelling, or an empty string."""
    near = difflib.get_close_matches(word, list(allowed), n=1, cutoff=0.6)
    return f" (did you mean {near[0]!r}?)" if near else ""
