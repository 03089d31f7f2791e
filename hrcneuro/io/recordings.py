"""Recordings of what cannot be done again: each in a folder of its own, written while it goes on, deleted by nothing.

``<folder>/<subject>/<start>/`` holds ``session.json`` and, until the tables are whole, ``telemetry.arrows``: an Arrow
stream of plain numbers, to which a thread adds what is new ten times a second. Whatever ends the process, even
SIGKILL, what was written stays, and :func:`read_stream` reads it.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import threading
from array import array
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from hrcneuro.errors import REFUSED, ConfigError, DataError, StageError, odd_part
from hrcneuro.io.places import new_folder

STREAM = "telemetry.arrows"
_RESERVE = ".reserved"
_EVERY = 0.1  # s between two pieces: a disk that is full stops the arm as soon as other faults do
_SYNC = 10  # pieces between two waits for the disk

Rows = Callable[[int], "array[float]"]


class SessionRecording:
    """One recording as it grows.

    Attributes:
        place: Its folder.
        fault: Why nothing more can be written; empty while it can.
    """

    def __init__(self, parent: Path, about: Mapping[str, Any], *, reserve: int = 0) -> None:
        """Make its folder, named by the time of day, and say in ``session.json`` what it is of.

        Args:
            parent: The subject's folder.
            about: JSON values: what was asked for.
            reserve: Bytes that are set aside for the tables, which are written last: a disk that fills up meanwhile
                must not cost them.

        Raises:
            ConfigError, StageError: It may not, or cannot, be written there.
        """
        self.fault = ""
        self._stream: _Stream | None = None
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._reserve: int | None = None  # of a file without a name: its room is free again however this process ends
        try:
            self.place = new_folder(parent)
            now = datetime.now().astimezone().isoformat(timespec="seconds")
            text = json.dumps({"began": now, **about}, indent=1)
            (self.place / "session.json").write_text(f"{text}\n", encoding="utf-8")
            if reserve:
                self._reserve = _set_aside(self.place / _RESERVE, reserve)
        except OSError as error:
            # Another place, or rights, as the configuration must name; or the disk's own fault.
            kind = ConfigError if error.errno in REFUSED else StageError
            odd = odd_part(parent, folder=True) if kind is ConfigError else ""
            first = "mend or remove that link or file" if odd else "give yourself the right to write there"
            raise kind(
                f"the recording cannot be written in {parent}: {odd or error.strerror or error}; nothing has moved",
                cure=f"{first}, or choose another place: robot.rescue_folder",
            ) from error

    def follow(self, columns: Sequence[str], rows: Rows) -> None:
        """Begin to write what comes.

        Args:
            columns: Names of the numbers in a row.
            rows: Returns the rows from a number on, one after the other.
        """
        self._stream = _Stream(self.place / STREAM, columns, rows)
        self._thread = threading.Thread(target=self._write, name="recording", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Write what is left; ``fault`` says afterwards whether the stream is whole."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
        if self._reserve is not None:
            os.close(self._reserve)
            self._reserve = None
        if self._stream is not None:
            try:
                self._stream.close()
                self.fault = ""
            except OSError as error:
                self.fault = str(error)

    def seal(self) -> None:
        """Make sure that the tables are on the disk, and remove the stream, whose numbers they hold.

        Raises:
            OSError: They are not.
        """
        for path in [*sorted(self.place.glob("*.parquet")), self.place]:
            file = os.open(path, os.O_RDONLY)
            try:
                os.fsync(file)
            finally:
                os.close(file)
        (self.place / STREAM).unlink(missing_ok=True)

    def discard(self) -> None:
        """Remove a recording of nothing."""
        shutil.rmtree(self.place, ignore_errors=True)

    def _write(self) -> None:
        assert self._stream is not None
        pieces = 0
        while not self._ended.wait(_EVERY):
            pieces += 1
            try:
                self._stream.add(sync=pieces % _SYNC == 0)
            except OSError as error:
                self.fault = str(error)
                return


class _Stream:
    """An Arrow stream in a file; what could not be written is kept and tried again."""

    def __init__(self, path: Path, columns: Sequence[str], rows: Rows) -> None:
        self._rows, self._done = rows, 0
        self._schema = pa.schema([pa.field(name, pa.float64()) for name in columns])
        self._bytes = io.BytesIO()
        self._writer = pa.ipc.new_stream(self._bytes, self._schema)
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)

    def add(self, *, sync: bool = False) -> None:
        width = len(self._schema)
        numbers = np.frombuffer(self._rows(self._done), float).reshape(-1, width)
        if len(numbers):
            arrays = [pa.array(column) for column in np.ascontiguousarray(numbers.T)]
            self._writer.write_batch(pa.record_batch(arrays, schema=self._schema))
            self._done += len(numbers)
        self._flush()
        if sync:
            os.fsync(self._file)

    def close(self) -> None:
        try:
            self.add()
            self._writer.close()
            self._flush()
            os.fsync(self._file)
        finally:
            os.close(self._file)

    def _flush(self) -> None:
        waiting = memoryview(self._bytes.getvalue())
        try:
            while waiting:
                waiting = waiting[os.write(self._file, waiting) :]
        finally:
            left = bytes(waiting)
            self._bytes.seek(0)
            self._bytes.truncate()
            self._bytes.write(left)


def read_stream(path: Path) -> pd.DataFrame:
    """Return the rows of a stream, of one that was cut short all that are whole.

    Raises:
        DataError: It is no such stream.
    """
    batches = []
    try:
        with path.open("rb") as file, pa.ipc.open_stream(file) as stream:
            schema = stream.schema
            with contextlib.suppress(StopIteration, pa.ArrowInvalid, OSError):
                while True:
                    batches.append(stream.read_next_batch())
    except (OSError, pa.ArrowInvalid) as error:
        raise DataError(f"{path} is no stream of a recording: {error}") from error
    return pa.Table.from_batches(batches, schema=schema).to_pandas()


def _set_aside(path: Path, size: int) -> int:
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    with contextlib.suppress(OSError):
        path.unlink()
    with contextlib.suppress(OSError):
        # Where the file system cannot, check_room must do.
        os.posix_fallocate(file, 0, size)
    return file
