"""A second cache at a URL, through fsspec: ``records/STAGE/UNIT/KEY.json`` and ``files/AB/SHA256``.

A file lies under the hash of its content, and a record appears once its files are there. So two who push at once write
the same bytes under the same name, a push that was broken off goes on, and a record never tells of another's files.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from hrcneuro.cache.address import absent, read_address, without_login
from hrcneuro.cache.disk import LARGEST, flush, make_folder, share
from hrcneuro.cache.filesystems import CHUNK, SSH, below, lstat, send, ssh_options
from hrcneuro.cache.record import Entry, is_entry, is_key
from hrcneuro.errors import DataError, HrcError, StageError

_SUFFIX = ".json"


class Bucket:
    """A second cache; every thread has a connection of its own.

    Args:
        url: ``s3://…``, ``ssh://…``, ``sftp://…``, ``file://…`` or a folder.
        cache: The cache that it stands beside, which it may not lie in.

    Raises:
        ConfigError: The URL is of no kind that can be used, looks like a slip, or lies in the cache; or the extra
            ``remote`` is not installed.
    """

    def __init__(self, url: str, *, cache: Path | None = None) -> None:
        self.url = read_address(url, cache=cache)
        self.protocol = self.url.partition("://")[0]
        self._own = threading.local()

    def __str__(self) -> str:
        return without_login(self.url)

    def records(self) -> tuple[dict[Entry, int], list[str]]:
        """Return the entries that have a record with its size in bytes, and names there that can be of none.

        Raises:
            HrcError: The bucket cannot be read.
        """
        with self._explained(self.url):
            fs, root = self._fs()
            base = f"{root}/records"
            # An object store has no folders.
            found = list(fs.find(base, detail=True).values() if self.protocol == "s3" else below(fs, base))
        entries, odd = {}, []
        for about in found:
            path = about["name"]
            name = path[path.index(base) + len(base) + 1 :] if base in path else path
            entry = _entry_of(name)
            if entry is None or not _is_file(about):
                odd.append(name)
            else:
                entries[entry] = int(about["size"])
        return dict(sorted(entries.items())), sorted(odd)

    def read_record(self, entry: Entry) -> bytes | None:
        """Return an entry's record as it is there, or None where there is none.

        Raises:
            DataError: It is no file, or larger than any record.
            HrcError: The bucket cannot be read.
        """
        path = self._record(entry)
        about = self._about(path)
        if about is None:
            return None
        self._refuse(path, about, max_bytes=LARGEST)
        return b"".join(self._chunks(path, LARGEST))

    def has(self, sha256: str, size: int) -> bool:
        """Return whether a file of this hash and size is there; its content is not looked at.

        Raises:
            HrcError: The bucket cannot be read.
        """
        about = self._about(self._file(sha256))
        return about is not None and _is_file(about) and about["size"] == size

    def chunks(self, sha256: str, size: int) -> Iterator[bytes]:
        """Yield the bytes of a file, never more than ``size`` of them.

        Raises:
            DataError: It is not there, no file, or of another size.
            HrcError: The bucket cannot be read.
        """
        path = self._file(sha256)
        about = self._about(path)
        if about is None:
            raise DataError(f"{self}/{path} is missing", cure=_AGAIN)
        self._refuse(path, about, exactly=size)
        yield from self._chunks(path, size)

    def put_file(self, chunks: Iterable[bytes], sha256: str) -> None:
        """Write a file under the hash of its content; nothing appears where ``chunks``, its bytes, end with an error.

        Raises:
            HrcError: The bucket cannot be written.
        """
        self._put(self._file(sha256), chunks)

    def put_record(self, entry: Entry, data: bytes) -> None:
        """Write the record of an entry, of which all files are there.

        Raises:
            HrcError: The bucket cannot be written.
        """
        self._put(self._record(entry), [data])

    def _put(self, name: str, chunks: Iterable[bytes]) -> None:
        with self._explained(f"{self.url}/{name}"):
            fs, root = self._fs()
            place = f"{root}/{name}"
            if self.protocol == "s3":
                # An object is whole as soon as it is there; elsewhere a file is written beside its place and renamed.
                send(fs, place, chunks, self.protocol)
                return
            part = f"{root}/.part/{secrets.token_hex(8)}"
            for path in (place, part):
                self._make_folder(fs, root, path.rpartition("/")[0])
            send(fs, part, chunks, self.protocol)
            if self.protocol != "file":
                fs.mv(part, place)
                return
            share(Path(part), Path(root))
            flush(Path(part))
            os.replace(part, place)
            flush(Path(place).parent)

    def _make_folder(self, fs: Any, root: str, folder: str) -> None:
        if self.protocol == "file":
            make_folder(Path(folder), Path(root))
            return
        # Over SSH, of two who make a folder at once one hears of a failure: then it is there, and the next is tried.
        for left in reversed(range(folder.count("/") + 1)):
            try:
                fs.makedirs(folder, exist_ok=True)
                return
            except OSError:
                if fs.isdir(folder):
                    return
                if not left:
                    raise

    def _about(self, name: str) -> dict[str, Any] | None:
        with self._explained(f"{self.url}/{name}"):
            fs, root = self._fs()
            try:
                return lstat(fs, f"{root}/{name}") if self.protocol in SSH else fs.info(f"{root}/{name}")
            except FileNotFoundError:
                return None

    def _chunks(self, name: str, max_bytes: int) -> Iterator[bytes]:
        with self._explained(f"{self.url}/{name}"):
            fs, root = self._fs()
            with fs.open(f"{root}/{name}", "rb", block_size=8 * CHUNK) as file:
                while max_bytes > 0 and (data := file.read(min(CHUNK, max_bytes))):
                    max_bytes -= len(data)
                    yield data

    def _refuse(
        self, name: str, about: dict[str, Any], *, exactly: int | None = None, max_bytes: int | None = None
    ) -> None:
        size = about.get("size")
        if not _is_file(about):
            raise DataError(f"{self}/{name} is no file but a link, a folder or a device", cure=_AGAIN)
        if exactly is not None and size != exactly:
            raise DataError(f"{self}/{name} has {size} bytes instead of {exactly}", cure=_AGAIN)
        if max_bytes is not None and (not isinstance(size, int) or size > max_bytes):
            raise DataError(f"{self}/{name} has {size} bytes; allowed: {max_bytes}", cure=_AGAIN)

    @staticmethod
    def _record(entry: Entry) -> str:
        return "records/" + "/".join(entry) + _SUFFIX

    @staticmethod
    def _file(sha256: str) -> str:
        return f"files/{sha256[:2]}/{sha256}"

    def _fs(self) -> tuple[Any, str]:
        """Return this thread's file system, and the bucket's place in it."""
        if not hasattr(self._own, "place"):
            from fsspec.core import url_to_fs

            options: dict[str, Any] = {}
            if self.protocol == "s3":
                options = {"use_listings_cache": False}
            if self.protocol in SSH:
                options = ssh_options()
            fs, root = url_to_fs(self.url, **options)
            self._own.place = (fs, root.rstrip("/"))
        return self._own.place

    @contextlib.contextmanager
    def _explained(self, place: str) -> Iterator[None]:
        """Turn what a file system or a network says into an error with a cure, without the URL's password."""
        try:
            yield
        except (HrcError, KeyboardInterrupt, GeneratorExit):
            raise
        except ImportError as error:
            raise absent(self.protocol) from error
        except Exception as error:
            if self.protocol in SSH:
                self._hang_up()
            said = f"{type(error).__name__}: {error}".replace(urlsplit(self.url).netloc, urlsplit(str(self)).netloc)
            raise StageError(
                f"{without_login(place)} failed: {said}",
                cure="check the address, the network and your rights there; the same command goes on from here",
            ) from error

    def _hang_up(self) -> None:
        """Give up a connection that has failed: the next call makes a new one."""
        place = self._own.__dict__.pop("place", None)
        if place is not None:
            with contextlib.suppress(Exception):
                place[0].client.close()


_AGAIN = "push it anew from a machine whose cache is sound: hrcneuro cache push URL --force"


def _entry_of(name: str) -> Entry | None:
    """Return the entry that a record's name stands for, or None where it stands for none."""
    parts = name.removesuffix(_SUFFIX).split("/")
    if not name.endswith(_SUFFIX) or len(parts) != 3 or not is_entry((parts[0], parts[1], parts[2])):
        return None
    return parts[0], parts[1], parts[2]


def is_like_record(name: str) -> bool:
    """Return whether a name below ``records/`` looks like that of an entry's record, whatever lies there."""
    parts = name.split("/")
    return len(parts) == 3 and name.endswith(_SUFFIX) and is_key(parts[2].removesuffix(_SUFFIX))


def _is_file(about: dict[str, Any]) -> bool:
    return about.get("type") == "file" and not about.get("islink", False)
