"""Errors that a person can act on: what is wrong, and how to cure it. Each class carries the process's exit code."""

from __future__ import annotations

import contextlib
import difflib
import errno
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

REFUSED = {
    *(errno.ENOENT, errno.EACCES, errno.EPERM, errno.EROFS, errno.EEXIST),
    *(errno.ENOTDIR, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG, errno.ENXIO),
}
"""Errors of the system that another path or other rights would cure; a disk that is full or broken is none of it."""


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


def is_utf8(text: str) -> bool:
    """Return whether a text can be written in UTF-8; a file's name that is not in UTF-8 cannot (PEP 383)."""
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def of_the_system(error: BaseException) -> HrcError | None:
    """Return what a person can do where the system refused a file, or an encoding its name; None for other errors."""
    if isinstance(error, UnicodeEncodeError):
        around = error.object[max(0, error.start - 60) : error.end + 20]
        if is_utf8(error.object):
            return ConfigError(
                f"{around!r} cannot be written in {error.encoding}, the encoding of this locale",
                cure="choose a locale with UTF-8 (LC_ALL=C.UTF-8), or set PYTHONUTF8=1",
            )
        return ConfigError(f"{around!r} is not in UTF-8", cure="rename the file or folder so that its name is in UTF-8")
    if isinstance(error, OSError) and error.filename is not None:
        kind = ConfigError if error.errno in REFUSED else StageError
        return kind(
            f"{error.filename}: {error.strerror}",
            cure="check the path, its rights and the space there; --debug shows what needed it",
        )
    return None


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


def odd_part(path: Path, *, folder: bool) -> str:
    """Return which part of a path is a link that leads nowhere, or no folder; empty where none is.

    Args:
        path: What the system has refused.
        folder: Whether it should be a folder itself.
    """
    for part in (*reversed(path.parents), path):
        try:
            linked = part.is_symlink()
            mode = part.stat().st_mode
        except FileNotFoundError:
            return f"{part} is a link to {os.readlink(part)}, which is not there" if linked else ""
        except OSError as error:
            return f"{part} is a link that leads back to itself" if error.errno == errno.ELOOP else ""
        if (folder or part != path) and not stat.S_ISDIR(mode):
            return f"{part} is {'a file' if stat.S_ISREG(mode) else 'a device or pipe'}, not a folder"
    return ""
