"""An SSH server on loopback that serves one folder by SFTP, as a lab's machine does: paramiko's own server side."""

import os
import socket
import threading
from pathlib import Path

import paramiko

USER, PASSWORD = "jane", "hunter2-hunter2"


class _Door(paramiko.ServerInterface):
    def check_auth_password(self, username, password):
        return paramiko.AUTH_SUCCESSFUL if (username, password) == (USER, PASSWORD) else paramiko.AUTH_FAILED

    def get_allowed_auths(self, username):
        return "password"

    def check_channel_request(self, kind, chanid):
        return paramiko.OPEN_SUCCEEDED


class _Handle(paramiko.SFTPHandle):
    def stat(self):
        return paramiko.SFTPAttributes.from_stat(os.fstat(self.readfile.fileno()))


def _served(method):
    """Answer what the file system refuses with its number, as an SFTP server does."""

    def answer(self, path, *rest):
        try:
            found = method(self, self.folder / path.lstrip("/"), *rest)
        except OSError as error:
            return paramiko.SFTPServer.convert_errno(error.errno)
        return paramiko.SFTP_OK if found is None else found

    return answer


def _of(folder):
    class Folder(paramiko.SFTPServerInterface):
        def __init__(self, *args, **kwargs):
            super().__init__(*args, **kwargs)
            self.folder = folder

        @_served
        def open(self, path, flags, attr):
            handle = _Handle(flags)
            mode = "rb" if not flags & (os.O_WRONLY | os.O_RDWR) else "r+b"
            file = os.fdopen(os.open(path, flags, 0o644), mode if mode == "rb" else "wb")
            handle.readfile = handle.writefile = file
            return handle

        @_served
        def list_folder(self, path):
            found = []
            for one in path.iterdir():
                about = paramiko.SFTPAttributes.from_stat(one.lstat())
                about.filename = one.name
                found.append(about)
            return found

        @_served
        def stat(self, path):
            return paramiko.SFTPAttributes.from_stat(path.stat())

        @_served
        def lstat(self, path):
            return paramiko.SFTPAttributes.from_stat(path.lstat())

        @_served
        def mkdir(self, path, attr):
            path.mkdir()

        @_served
        def remove(self, path):
            path.unlink()

        @_served
        def posix_rename(self, path, new):
            path.replace(self.folder / new.lstrip("/"))

        @_served
        def chattr(self, path, attr):
            return None

    return Folder


class SftpLab:
    """The server; ``url`` is that of its root, ``line`` what a sound ``known_hosts`` has of it."""

    def __init__(self, folder):
        self.key = paramiko.RSAKey.generate(2048)
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.url = f"ssh://{USER}:{PASSWORD}@127.0.0.1:{self.port}"
        self.line = f"[127.0.0.1]:{self.port} {self.key.get_name()} {self.key.get_base64()}\n"
        self._folder = _of(Path(folder))
        self._open = []
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self):
        while True:
            try:
                connection, _ = self.socket.accept()
            except OSError:
                return
            transport = paramiko.Transport(connection)
            transport.add_server_key(self.key)
            transport.set_subsystem_handler("sftp", paramiko.SFTPServer, self._folder)
            self._open.append(transport)
            try:
                transport.start_server(server=_Door())
            except (EOFError, paramiko.SSHException):
                transport.close()  # whoever came does not trust this machine

    def close(self):
        """Hang up."""
        self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()
        for transport in self._open:
            transport.close()
        self._thread.join(10)
