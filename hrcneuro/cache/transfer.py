"""Entries pushed to a bucket and pulled from it: files first, record last, every byte hashed on either way.

What comes from a bucket was written by whoever can write there: names, sizes and formats are looked at before anything
is taken into the cache, and what is odd is refused with its name.
"""

from __future__ import annotations

import collections
import concurrent.futures as futures
import enum
import hashlib
import shutil
import stat
import threading
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from hrcneuro.cache import fingerprint
from hrcneuro.cache.bucket import Bucket
from hrcneuro.cache.disk import read_file
from hrcneuro.cache.filesystems import CHUNK
from hrcneuro.cache.formats import Formats, is_of_format
from hrcneuro.cache.record import PULLED, RECORD, Entry, Record, dropped, is_entry, parse_record
from hrcneuro.cache.store import Store
from hrcneuro.errors import DataError, HrcError, StageError


class _Ended(BaseException):
    """A person has ended the command; no Exception, so that nobody on its way takes it for a fault of the network."""


class Fate(enum.StrEnum):
    """What became of an entry."""

    MOVED = "moved"
    THERE = "there"  # already
    SLIM = "slim"  # its files were dropped here
    REFUSED = "refused"  # something is wrong with it
    FAILED = "failed"  # the disk or the network


@dataclass(frozen=True)
class Moved:
    """What became of an entry, how many bytes went, and why it did not."""

    entry: Entry
    fate: Fate
    size: int = 0
    error: HrcError | None = None


def push(
    store: Store, bucket: Bucket, entries: Iterable[Entry], *, force: bool = False, workers: int = 8
) -> Iterator[Moved]:
    """Yield what became of each entry of a cache, in the order in which they are done.

    Args:
        store: The cache.
        bucket: Where entries go.
        entries: Which.
        force: Write also what is there already.
        workers: How many go at a time.

    Raises:
        HrcError: The bucket cannot be read.
    """
    there = set() if force else set(bucket.records()[0])
    ended = threading.Event()

    def one(entry: Entry) -> Moved:
        return _push_one(store, bucket, entry, there, force=force, ended=ended)

    yield from _each(entries, one, workers, ended)


def _push_one(
    store: Store, bucket: Bucket, entry: Entry, there: set[Entry], *, force: bool, ended: threading.Event
) -> Moved:
    if entry in there:
        return Moved(entry, Fate.THERE)
    folder = store.folder(*entry)
    if dropped(folder):
        return Moved(entry, Fate.SLIM)
    try:
        data = read_file(folder / RECORD)
        record = parse_record(data)
    except (OSError, ValueError) as error:
        raise DataError(f"its record cannot be read: {error}", cure="hrcneuro cache verify") from error
    size = 0
    for name, about in record.outputs.items():
        sha256, large = about["sha256"], about["size"]
        chunks = _checked(_chunks(folder / name, name, ended), name, sha256, large)
        if force or not bucket.has(sha256, large):
            bucket.put_file(chunks, sha256)
            size += large
        else:
            # Also what is there already is read: a record goes there only from an entry that is whole here.
            collections.deque(chunks, maxlen=0)
    bucket.put_record(entry, data)
    return Moved(entry, Fate.MOVED, size)


def _chunks(path: Path, name: str, ended: threading.Event) -> Iterator[bytes]:
    """Yield the bytes of an entry's file until a person ends the command."""
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            raise _changed(name)
        with path.open("rb") as file:
            while data := file.read(CHUNK):
                if ended.is_set():
                    raise _Ended
                yield data
    except OSError as error:
        raise DataError(f"{name} cannot be read: {error.strerror}", cure="hrcneuro cache verify") from error


def _checked(chunks: Iterable[bytes], name: str, sha256: str, size: int) -> Iterator[bytes]:
    """Yield the bytes of an entry's file, and DataError behind the last one where they are not what its record says."""
    digest, read = hashlib.sha256(), 0
    for data in chunks:
        digest.update(data)
        read += len(data)
        yield data
    if (digest.hexdigest(), read) != (sha256, size):
        raise _changed(name)


def _changed(name: str) -> DataError:
    return DataError(f"the content of {name} has changed", cure="hrcneuro cache verify")


def pull(
    store: Store,
    bucket: Bucket,
    entries: Iterable[Entry],
    *,
    formats: Formats,
    verify: bool = False,
    force: bool = False,
    workers: int = 8,
) -> Iterator[Moved]:
    """Yield what became of each entry of a bucket, in the order in which they are done.

    Args:
        store: The cache that they go into.
        bucket: Where they come from.
        entries: Which.
        formats: What files may be.
        verify: Read every byte of what is in the cache already.
        force: Bring back also the files that were dropped here to save disk.
        workers: How many come at a time.
    """

    ended = threading.Event()

    def one(entry: Entry) -> Moved:
        if here := _here(store, entry, verify=verify, force=force):
            return Moved(entry, here)
        with store.lock(*entry, ended=ended):
            if ended.is_set():
                raise _Ended
            if here := _here(store, entry, verify=verify, force=force):
                return Moved(entry, here)
            record = take(store, bucket, entry, formats=formats, ended=ended)
        if record is None:
            raise DataError(f"{bucket} has no record of it", cure="ask for what 'hrcneuro cache pull' finds there")
        return Moved(entry, Fate.MOVED, record.size)

    yield from _each(entries, one, workers, ended)


def _here(store: Store, entry: Entry, *, verify: bool, force: bool) -> Fate | None:
    """Return how an entry is in the cache already; None where it is to be taken."""
    if store.lookup(*entry, verify=verify, slim=not force) is None:
        return None
    return Fate.SLIM if dropped(store.folder(*entry)) else Fate.THERE


def take(
    store: Store, bucket: Bucket, entry: Entry, *, formats: Formats, ended: threading.Event | None = None
) -> Record | None:
    """Take an entry of a bucket into the cache and return its record; None where the bucket has none.

    The cache's lock for it is held by who calls. Nothing is taken any more once ``ended`` is set.

    Raises:
        DataError: What is there is not what an entry may be, or not what its record says.
        HrcError: The bucket cannot be read, or the cache not written.
    """
    data = bucket.read_record(entry)
    if data is None:
        return None
    record = _read(data, entry, formats)
    _check_room(store, record)
    with store.workspace(*entry) as work:
        for name, about in record.outputs.items():
            with store.guarded():
                (work / name).parent.mkdir(parents=True, exist_ok=True)
            _fetch(bucket, store, work / name, name, about["sha256"], about["size"], ended)
            if not is_of_format(work / name, formats):
                raise DataError(f"{name} is refused: its content is not of that format", cure=_CURE)
        with store.guarded():
            (work / RECORD).write_bytes(data)
            (work / PULLED).touch()
        store.place(record, work)
    return record


def _read(data: bytes, entry: Entry, formats: Formats) -> Record:
    try:
        record = parse_record(data)
    except ValueError as error:
        raise DataError(f"its record is refused: {error}", cure=_CURE) from error
    if (record.stage, record.unit, record.key) != entry or not is_entry(entry):
        raise DataError(f"its record is of {record.stage}/{record.unit}/{record.key}", cure=_CURE)
    if fingerprint.key(record.parts) != record.key:
        raise DataError("its key is not that of what its record says went into it", cure=_CURE)
    for name in record.outputs:
        if PurePosixPath(name).suffix not in formats:
            allowed = ", ".join(sorted(formats))
            raise DataError(f"{name} is refused; allowed are files of {allowed}", cure=_CURE)
    return record


def _check_room(store: Store, record: Record) -> None:
    with store.guarded():
        free, needed = shutil.disk_usage(store.root).free, record.size
    if needed > free:
        raise DataError(
            f"its files are said to have {needed / 1e9:.1f} GB; free are {free / 1e9:.1f} GB in {store.root}",
            cure="make room, or choose another place with HRCNEURO_CACHE; if no entry of yours is so large, " + _CURE,
        )


def _fetch(
    bucket: Bucket, store: Store, path: Path, name: str, sha256: str, size: int, ended: threading.Event | None
) -> None:
    digest, come = hashlib.sha256(), 0
    with store.guarded():
        file = path.open("xb")
    with file:
        for data in bucket.chunks(sha256, size):
            if ended is not None and ended.is_set():
                raise _Ended
            digest.update(data)
            come += len(data)
            with store.guarded():
                file.write(data)
        with store.guarded():
            file.flush()
    if come != size or digest.hexdigest() != sha256:
        raise DataError(f"the content of {name} in {bucket} has changed (files/{sha256[:2]}/{sha256})", cure=_CURE)


_CURE = (
    "it is left where it is; whoever pushed it can do so anew: hrcneuro cache push URL --force; or remove it from there"
)


def _each(
    entries: Iterable[Entry], one: Callable[[Entry], Moved], workers: int, ended: threading.Event
) -> Iterator[Moved]:
    """Yield what became of each entry, several at a time; what one fails of stops no other.

    ``ended`` is set where nobody asks for more, as after Ctrl-C: ``one`` then raises soon.
    """

    def guarded(entry: Entry) -> Moved:
        if ended.is_set():
            return Moved(entry, Fate.FAILED)
        try:
            return one(entry)
        except _Ended:
            return Moved(entry, Fate.FAILED)
        except DataError as error:
            return Moved(entry, Fate.REFUSED, error=error)
        except HrcError as error:
            return Moved(entry, Fate.FAILED, error=error)
        except Exception as error:
            problem = f"unexpected {type(error).__name__}: {error}"
            return Moved(entry, Fate.FAILED, error=StageError(problem, cure="please report it as a bug"))

    with futures.ThreadPoolExecutor(workers) as threads:
        try:
            for future in futures.as_completed([threads.submit(guarded, entry) for entry in entries]):
                yield future.result()
        finally:
            # Interrupted: those under way break off behind a chunk, and no other begins.
            ended.set()
            threads.shutdown(wait=False, cancel_futures=True)
