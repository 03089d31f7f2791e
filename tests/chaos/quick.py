"""Commands in processes that start at once: this process has loaded the libraries, and forks."""

import importlib
import os
import signal
import subprocess
import time
from pathlib import Path

import started
from study import COMMAND, around


class Quick:
    """A command in a process group of its own."""

    def __init__(self, folder, *words, environment=None):
        for name in started.PRODUCT:
            importlib.import_module(name)
        self.err, self.code = folder / "err.txt", None
        request = started.request(words, folder, around(environment), folder / "out.txt", self.err)
        self.pid = os.fork()
        if not self.pid:
            os.setsid()
            started.become(request)
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


class Unprivileged(Quick):
    """A command of an account that owns nothing; it starts from the beginning.

    It may read everything, as the interpreter may lie where only root reads, and write what is its own.
    """

    RIGHTS = ("--inh-caps", "-all,+dac_read_search", "--ambient-caps", "-all,+dac_read_search")
    PREFIX = ("setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups", *RIGHTS)

    def __init__(self, folder, *words, environment=None):
        self.err, self.code = folder / "err.txt", None
        with self.err.open("w") as err:
            self.process = subprocess.Popen(
                [*self.PREFIX, "--bounding-set", "-all,+dac_read_search", *COMMAND, *map(str, words)],
                cwd=folder, env=around(environment), stdout=err, stderr=err, start_new_session=True,
            )  # fmt: skip
        self.pid = self.process.pid

    def poll(self):
        """Return the exit code, or None while it runs."""
        self.code = self.process.poll()
        return self.code
