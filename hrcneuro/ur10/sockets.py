"""The sockets that programs open, read and write: socket_open and its kin of URScript. Nothing here waits.

A program's thread waits from cycle to cycle (:mod:`hrcneuro.ur10.talk`); here are connections that never block.
"""

from __future__ import annotations

import errno
import ipaddress
import socket

_MOST = 32  # open at a time
_LONGEST = 1 << 16  # bytes that are kept unread
_STARTED = (0, errno.EINPROGRESS, errno.EWOULDBLOCK, errno.EINTR)


class Link:
    """One connection: what has come and is not read yet."""

    def __init__(self, address: str, port: int) -> None:
        """Begin to connect.

        Raises:
            OSError: The address is none, or nobody listens there.
        """
        self.received = b""
        self.ended = False
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        code = self._socket.connect_ex((address, port))
        if code not in _STARTED:
            self._socket.close()
            raise OSError(code, "cannot connect")
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def connected(self) -> bool:
        """Return whether the other side has taken the connection.

        Raises:
            OSError: It has not, and will not.
        """
        code = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if code:
            raise OSError(code, "cannot connect")
        try:
            self._socket.getpeername()
        except OSError:
            return False
        return True

    def take(self) -> bytes:
        """Return all that has come and is unread; ``ended`` says that no more will."""
        while not self.ended and not self.full:
            try:
                piece = self._socket.recv(_LONGEST - len(self.received))
            except BlockingIOError:
                break
            except OSError:
                piece = b""
            self.ended = not piece
            self.received += piece
        return self.received

    @property
    def full(self) -> bool:
        """Whether no more is kept until something is read."""
        return len(self.received) >= _LONGEST

    def send(self, data: bytes) -> bool:
        """Return whether all of ``data`` went on its way."""
        try:
            return self._socket.send(data) == len(data)
        except OSError:
            return False

    def close(self) -> None:
        """Hang up."""
        self._socket.close()


class Sockets:
    """A controller's connections by the names that programs give them."""

    def __init__(self, *, anywhere: bool = False) -> None:
        """Allow connections to this machine only, unless ``anywhere``: whoever sends a program chooses the address."""
        self._anywhere = anywhere
        self._links: dict[str, Link] = {}

    def open(self, name: str, address: str, port: int) -> Link:
        """Begin to connect, in place of what has that name.

        Raises:
            OSError: Nobody listens there, it is no address of this machine, or too many are open.
        """
        self.close(name)
        host = ipaddress.IPv4Address("127.0.0.1" if address == "localhost" else address)
        if not (host.is_loopback or self._anywhere):
            raise OSError(errno.EACCES, "not an address of this machine")
        if len(self._links) >= _MOST:
            raise OSError(errno.EMFILE, "too many sockets")
        self._links[name] = link = Link(str(host), port)
        return link

    def get(self, name: str) -> Link | None:
        """Return an open connection, or None."""
        return self._links.get(name)

    def close(self, name: str) -> None:
        """Hang up, if it is open."""
        link = self._links.pop(name, None)
        if link is not None:
            link.close()

    def close_all(self) -> None:
        """Hang up everywhere."""
        for name in list(self._links):
            self.close(name)
