"""What a file system refuses, in words that a person can act on; folders that those share who share the cache."""

from __future__ import annotations

import contextlib
import errno
import grp
import json
import os
import pwd
import secrets
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hrcneuro.errors import REFUSED, ConfigError, StageError, odd_part

LARGEST_LIST = 2**28
"""So many bytes a list of entries may have; 10^5 entries make 6 MB."""
LARGEST = 16 * 2**20
"""So many bytes a record or another file of the cache's own may have; the largest of the paper's study has 17,000."""
_FULL = (errno.ENOSPC, errno.EDQUOT)
# No fault of the disk: somebody must give another place, or rights to this one.
_REFUSED = REFUSED | {errno.EINVAL, errno.ENOTEMPTY, errno.ENODEV}
_ELSEWHERE = "choose another place: --workdir DIR or HRCNEURO_CACHE"


@contextlib.contextmanager
def guarded(place: Path) -> Iterator[None]:
    """Turn what the file system refuses under ``place`` into an error with a cure."""
    try:
        yield
    except OSError as error:
        raise explain_os_error(error, place) from error


def explain_os_error(error: OSError, place: Path) -> ConfigError | StageError:
    """Return the error that a person can act on; it names the path that failed where the system tells it."""
    if error.errno in _FULL:
        return StageError(
            f"the disk of {place} is full",
            cure="free space ('hrcneuro cache gc' drops unused entries) or choose another place: --workdir DIR",
        )
    if error.errno == errno.EFBIG:
        return StageError(
            f"a file under {place} has become larger than is allowed here",
            cure="raise the limit of a file's size (ulimit -f), or choose another place: --workdir DIR",
        )
    # Of a file that is to take another's place, it is that place which is a folder.
    named = error.filename2 if error.errno == errno.EISDIR and error.filename2 else error.filename
    path = Path(os.fsdecode(named)) if isinstance(named, str | bytes) else place
    if error.errno not in _REFUSED:
        problem = f"the disk of {place} failed: {error}"
        return StageError(problem, cure="check the disk, then run the same command again")
    if odd := odd_part(path, folder=error.errno in (errno.EEXIST, errno.ENOTDIR)):
        cure = f"mend or remove that link or file, or {_ELSEWHERE}"
        return ConfigError(f"{path} cannot be written: {odd}", cure=cure)
    if error.errno == errno.EISDIR:
        cure = f"move that folder away, or {_ELSEWHERE}"
        return ConfigError(f"{path} cannot be written: it is a folder, not a file", cure=cure)
    if error.errno in (errno.EACCES, errno.EPERM):
        return ConfigError(
            f"{path} cannot be written: {error.strerror}{_whose(path)}",
            cure="give yourself the right to write there; who share a cache share a group: 'chgrp -R GROUP "
            f"{place}' and 'chmod -R g+rwXs {place}' by the owner, umask 002 for all; or {_ELSEWHERE}",
        )
    return ConfigError(
        f"{path} cannot be written: {error.strerror}", cure=f"give yourself the right to write there, or {_ELSEWHERE}"
    )


def make_folder(folder: Path, root: Path) -> None:
    """Make a folder of the cache at ``root``, and those above it, for all who may write ``root``."""
    if folder.is_dir():
        return
    if folder != root:
        make_folder(folder.parent, root)
        folder.mkdir(exist_ok=True)
        share(folder, root)
    else:
        folder.mkdir(parents=True, exist_ok=True)


def share(path: Path, root: Path) -> None:
    """Let those read and replace a folder or file of the cache who may write ``root``, whatever our umask."""
    with contextlib.suppress(OSError):
        given, mode = root.stat().st_mode, path.lstat().st_mode
        # In a folder with the sticky bit everybody keeps to what is theirs.
        others = stat.S_IWOTH if given & stat.S_IWOTH and not given & stat.S_ISVTX else 0
        wanted = 0
        for write, read, execute in ((stat.S_IWGRP, stat.S_IRGRP, stat.S_IXGRP), (others, stat.S_IROTH, stat.S_IXOTH)):
            if given & write:
                wanted |= read | (write | execute if stat.S_ISDIR(mode) else 0)
        wanted |= given & stat.S_ISGID if stat.S_ISDIR(mode) else 0
        if not stat.S_ISLNK(mode) and mode | wanted != mode:
            path.chmod(stat.S_IMODE(mode | wanted))


def remove(path: Path) -> None:
    """Remove a folder with all that is in it, a file or a link; what is gone already is no error."""
    while path.is_dir() and not path.is_symlink():
        # Another process may remove the same.
        with contextlib.suppress(FileNotFoundError):
            shutil.rmtree(path)
    path.unlink(missing_ok=True)


def read_file(path: str | Path, *, max_bytes: int = LARGEST) -> bytes:
    """Return the bytes of a file that is small where it is what it should be.

    Somebody may have put a pipe there, which would be waited for, or a link to a device, which has no end.

    Raises:
        OSError: It cannot be read, is no regular file, or has more than ``max_bytes`` bytes.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        about = os.fstat(handle)
        if not stat.S_ISREG(about.st_mode):
            folder = stat.S_ISDIR(about.st_mode)
            words = f"it is no file but a {'folder' if folder else 'device or a pipe'}"
            raise OSError(errno.EISDIR if folder else errno.EINVAL, words, os.fspath(path))
        if about.st_size > max_bytes:
            raise OSError(errno.EFBIG, f"it has more than {max_bytes} bytes", os.fspath(path))
        # Not read with the limit for a length, which would take that much memory each time.
        found = os.read(handle, about.st_size + 1)
        if len(found) == about.st_size:
            return found
        # It grows, or came in pieces: from the beginning, to its end.
        with open(os.dup(handle), "rb") as file:
            file.seek(0)
            return file.read()
    finally:
        os.close(handle)


def read_json(path: str | Path, *, max_bytes: int = LARGEST) -> Any:
    """Return what a JSON file says, whoever wrote it.

    Raises:
        OSError: It cannot be read, is no regular file, or has more than ``max_bytes`` bytes.
        ValueError: It is no JSON that a program can take.
    """
    return parse_json(read_file(path, max_bytes=max_bytes))


def parse_json(text: str | bytes) -> Any:
    """Return what JSON says, whoever wrote it.

    Raises:
        ValueError: It is no JSON, or nested without end.
    """
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error


def disk_time(folder: Path) -> float:
    """Return the time by the clock of a folder's disk, seconds since 1970: a server's may differ from this machine's.

    Raises:
        OSError: Nothing can be written there.
    """
    probe = folder / f".{secrets.token_hex(8)}.time"
    try:
        probe.touch(exist_ok=False)
        return probe.stat().st_mtime
    finally:
        with contextlib.suppress(OSError):
            probe.unlink()


def free_bytes(place: Path) -> int:
    """Return what is free where a folder lies, or would lie, in bytes."""
    while not place.exists() and place != place.parent:
        place = place.parent
    return shutil.disk_usage(place).free


def size(path: Path) -> int:
    """Return the bytes of all files in a folder; what cannot be looked at counts nothing."""
    total = 0
    for folder, _, names in os.walk(path):
        for name in names:
            with contextlib.suppress(OSError):
                total += os.lstat(os.path.join(folder, name)).st_size
    return total


def flush(path: Path) -> None:
    """Wait until a file or folder is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _whose(path: Path) -> str:
    """Return who owns the nearest part of a path that is there, and its rights."""
    for part in (path, *path.parents):
        try:
            about = part.stat()
        except OSError:
            continue
        owner, group = str(about.st_uid), str(about.st_gid)
        with contextlib.suppress(KeyError):
            owner = pwd.getpwuid(about.st_uid).pw_name
        with contextlib.suppress(KeyError):
            group = grp.getgrgid(about.st_gid).gr_name
        return f" ({part} is {stat.filemode(about.st_mode)}, of {owner}, group {group})"
    return ""
