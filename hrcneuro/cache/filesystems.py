"""What fsspec leaves to do for a bucket: folders listed, files looked at and written, SSH that gives up in the end."""

from __future__ import annotations

import contextlib
import os
import socket
import stat
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from hrcneuro.errors import ConfigError

SSH = ("sftp", "ssh")
"""Protocols that go through SSH."""
CHUNK = 2**20
"""So many bytes are read or written at a time."""
# So long a machine behind SSH may not answer.
_SILENCE_S = 60.0


def lstat(fs: Any, path: str) -> dict[str, Any]:
    """Return size and type of what lies behind SSH: fsspec follows links there, and calls a pipe a file."""
    about = fs.ftp.lstat(path)
    return {"name": path, "size": about.st_size, "type": "file" if stat.S_ISREG(about.st_mode) else "other"}


def below(fs: Any, base: str) -> Iterator[dict[str, Any]]:
    """Yield what lies in the folders of stages and units: what cannot be listed is an error, not absent.

    Folders may be links, which lead anywhere and in circles: they are not followed.
    """
    try:
        fs.info(base)
    except FileNotFoundError:
        return
    folders = [(base, 1)]
    while folders:
        folder, level = folders.pop()
        for about in fs.ls(folder, detail=True):
            if level < 3 and about["type"] == "directory" and not about.get("islink"):
                folders.append((about["name"], level + 1))
            else:
                yield about


def send(fs: Any, path: str, chunks: Iterable[bytes], protocol: str) -> None:
    """Write a file, chunk by chunk; where that breaks off, nothing of it stays."""
    size = 0
    file = fs.open(path, "wb", block_size=8 * CHUNK)
    try:
        if protocol in SSH:
            file.set_pipelined(True)
        for data in chunks:
            file.write(data)
            size += len(data)
        if protocol in SSH:
            file.close()
            # What was written last may have failed without a word.
            if (there := fs.ftp.lstat(path).st_size) != size:
                raise OSError(f"{there} of {size} bytes have come")
            return
    except BaseException:
        with contextlib.suppress(Exception):
            if protocol == "s3":
                file.discard()
                file.closed = True
            else:
                file.close()
                fs.rm_file(path)
        raise
    file.close()


def ssh_options() -> dict[str, Any]:
    """Return how a machine behind SSH is connected to: one that is known, and that answers."""
    import paramiko

    class Transport(paramiko.Transport):
        """Gives a channel up where nothing comes; and a connection where what was sent is not received."""

        def __init__(self, sock: Any, *args: Any, **kwargs: Any) -> None:
            if hasattr(socket, "TCP_USER_TIMEOUT"):
                with contextlib.suppress(OSError):
                    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(1000 * _SILENCE_S))
            super().__init__(sock, *args, **kwargs)

        def open_channel(self, *args: Any, **kwargs: Any) -> Any:
            channel = super().open_channel(*args, **kwargs)
            channel.settimeout(_SILENCE_S)
            return channel

    limits = dict.fromkeys(("timeout", "banner_timeout", "auth_timeout", "channel_timeout"), _SILENCE_S)
    return {
        "host_key_policy": _known_hosts(),
        "transport_factory": Transport,
        "skip_instance_cache": True,
        **limits,
    }


def _known_hosts() -> Any:
    """Return the rule that a machine is talked to where ``~/.ssh/known_hosts`` has its key, and no other."""
    import paramiko

    class KnownHosts(paramiko.MissingHostKeyPolicy):
        def missing_host_key(self, client: Any, hostname: str, key: Any) -> None:
            path = Path("~/.ssh/known_hosts").expanduser()
            if not (os.path.exists(path) and paramiko.HostKeys(str(path)).check(hostname, key)):
                raise ConfigError(
                    f"{path} does not have the {key.get_name()} key that {hostname} shows",
                    cure=f"compare it with that of its administrator: 'ssh {hostname}' shows it and notes it",
                )

    return KnownHosts()
