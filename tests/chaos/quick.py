"""Commands in processes that start at once: this process has loaded the libraries, and forks."""

import importlib
import os
import signal
import time
from pathlib import Path

import started
from study import around


class Quick:
    """A command in a process group of its own, as another user where one is named."""

    def __init__(self, folder, *words, environment=None, user=0):
        for name in started.PRODUCT:
            importlib.import_module(name)
        self.err, self.code = folder / "err.txt", None
        request = {
            "code": None,
            "arguments": [*map(str, words)],
            "cwd": str(folder),
            "environment": around(environment),
            "paths": [],
            "out": str(folder / "out.txt"),
            "err": str(self.err),
        }
        self.pid = os.fork()
        if not self.pid:
            os.setsid()
            started.become(request)
            if user:
                os.setgroups([])
                os.setgid(user)
                os.setuid(user)
            started.leave(started.perform(request))

    def poll(self):
        """Return the exit code, or None while it runs."""
        if self.code is None:
            done, status = os.waitpid(self.pid, os.WNOHANG)
            self.code = os.waitstatus_to_exitcode(status) if done else None
        return self.code

    def wait(self, seconds):
        """Return the exit code, or None where it runs for longer."""
        deadline = time.monotonic() + seconds
        while self.poll() is None and time.monotonic() < deadline:
            time.sleep(0.005)
        return self.code

    def kill(self, *, group=False):
        """Kill it, or its whole group, unless it has ended."""
        if self.poll() is None:
            (os.killpg if group else os.kill)(self.pid, signal.SIGKILL)

    def said(self):
        """Return what it has printed on standard error."""
        return Path(self.err).read_text(encoding="utf-8", errors="replace")
