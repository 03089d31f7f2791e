"""The log of a run: ``results/log/<UTC time>-<command>.jsonl``, one JSON object a line, kept for the last fifty runs.

The first line says what was asked (command line, digest of the configuration), then one line tells each change of an
item, and the last how it ended. Neither user nor host is named: of an absolute path only its last part is written,
of an address its scheme.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import platform
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

from hrcneuro import __version__
from hrcneuro.cache import fingerprint
from hrcneuro.config.settings import Settings
from hrcneuro.contract import params
from hrcneuro.errors import HrcError
from hrcneuro.pipeline.anonymous import anonymous
from hrcneuro.pipeline.item import Item, State

KEEP = 50
# Words of the program and of the study, though a machine may be called the same.
_NAMES = {"command", "stage", "unit", "state", "states", "key", "study", "config", "utc", "outcome", "file"}


class RunLog:
    """Writes lines to a file; a log that cannot be written is no reason to stop a study."""

    def __init__(self, file: TextIO | None, hidden: Sequence[str] = ()) -> None:
        """Write to a file; ``hidden`` is what must not be in it, such as folders."""
        self._file = file
        self._hidden = hidden
        self._start = time.perf_counter()

    def write(self, event: str, **values: Any) -> None:
        """Append one line, and hand it to the operating system, so that a killed run leaves what it knew."""
        if self._file is None:
            return
        line = {"event": event, "at_s": round(time.perf_counter() - self._start, 3), **self._clean(values)}
        with contextlib.suppress(OSError):
            self._file.write(json.dumps(line, ensure_ascii=False) + "\n")
            self._file.flush()

    def item(self, item: Item) -> None:
        """Log what became of an item."""
        error = {"error": {"problem": item.error.problem, "cure": item.error.cure}} if item.error else {}
        seconds = {"seconds": item.seconds} if item.state is State.RAN else {}
        also = {**seconds, **error, **({"lost": item.lost} if item.lost else {})}
        self.write("item", stage=item.stage, unit=item.unit, state=item.state, key=item.key, why=item.why, **also)

    def _clean(self, value: Any) -> Any:
        if isinstance(value, Mapping):
            return {name: one if name in _NAMES else self._clean(one) for name, one in value.items()}
        if isinstance(value, list | tuple):
            return [self._clean(one) for one in value]
        return anonymous(value, self._hidden) if isinstance(value, str) else value

    def end(self, items: Iterable[Item], code: int) -> None:
        """Log how a run that came to its end ended."""
        states = Counter(item.state for item in items)
        self.write("end", outcome="ok" if code == 0 else "failed", exit_code=code, states=states)


@contextlib.contextmanager
def recorded(
    results: Path, command: str, settings: Settings, line: str, *, hidden: Sequence[str] = ()
) -> Iterator[RunLog]:
    """Yield the log of a run; its last line says whether it came to an end, was interrupted or failed.

    ``hidden`` is what must not be in it, such as folders.
    """
    file = _open(results / "log", command)
    log = RunLog(file, hidden)
    log.write(
        "start",
        command=command,
        utc=_now().isoformat(timespec="seconds"),
        study=settings.study.name,
        config=digest(settings),
        hrcneuro=__version__,
        python=platform.python_version(),
        line=line,
    )
    try:
        yield log
    except BaseException as error:
        problem = error.problem if isinstance(error, HrcError) else f"{type(error).__name__}: {error}"
        interrupted = isinstance(error, KeyboardInterrupt | SystemExit)
        log.write("end", outcome="interrupted" if interrupted else "failed", problem=problem)
        raise
    finally:
        if file is not None:
            with contextlib.suppress(OSError):
                file.close()


def digest(settings: Settings) -> str:
    """Return the sha256 of everything in a configuration that decides results, first 16 digits."""
    sections = {name: params(section) for name, section in settings.sections.items()}
    return fingerprint.digest({"study": params(settings.study), "shared": params(settings.shared), **sections})[:16]


def _open(folder: Path, command: str) -> TextIO | None:
    name = f"{_now().strftime('%Y%m%dT%H%M%S.%fZ')}-{command}.jsonl"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for old in sorted(folder.glob("*.jsonl"))[: -KEEP + 1]:
            old.unlink(missing_ok=True)
        return (folder / name).open("x", encoding="utf-8", errors="backslashreplace")
    except OSError:
        return None


def _now() -> datetime.datetime:
    return datetime.datetime.now(datetime.UTC)
