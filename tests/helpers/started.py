"""Commands in processes of their own that start at once: a process that has loaded the libraries forks for each.

Loading takes a second or more and is the same for every command. The child is a process like any other: its own
arguments, folder, streams and exit code. ``python started.py`` is the process that forks: it reads one request a line
and answers with the number of the child, then with its exit code.
"""

import atexit
import gc
import importlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

LIBRARIES = (
    *("numpy", "pandas", "scipy.signal", "scipy.stats", "scipy.fft", "scipy.interpolate", "pyarrow.parquet", "mne"),
    *("sklearn.discriminant_analysis", "sklearn.model_selection", "matplotlib.figure", "threadpoolctl", "jinja2"),
    "hrcneuro.cli.app",
)


class Starter:
    """Runs commands one after another; the process that forks lives until :meth:`end`."""

    def __init__(self, folder):
        # One thread: a process that forks must have no other.
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        environment = {**os.environ, **threads, "NO_COLOR": "1"}
        environment.pop("HRCNEURO_CACHE", None)
        self._process = subprocess.Popen(
            [sys.executable, __file__],
            cwd=folder,
            env=environment,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )

    def run(self, arguments, *, cwd, timeout):
        """Return exit code, standard output and standard error of ``hrcneuro`` with these arguments."""
        with tempfile.TemporaryDirectory() as folder:
            out, err = Path(folder, "out"), Path(folder, "err")
            request = {"arguments": arguments, "cwd": str(cwd), "out": str(out), "err": str(err)}
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
            child = int(self._process.stdout.readline())
            late = threading.Timer(timeout, os.kill, (child, signal.SIGKILL))
            late.start()
            code = int(self._process.stdout.readline())
            late.cancel()
            assert late.is_alive() or code != -signal.SIGKILL, f"{arguments} took more than {timeout} s"
            return code, out.read_text(encoding="utf-8"), err.read_text(encoding="utf-8")

    def end(self):
        """End the process that forks."""
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()


def serve():
    """Fork for each request; return in the child, with its arguments, folder and streams in place."""
    for name in LIBRARIES:
        importlib.import_module(name)
    gc.freeze()  # else the child's first collection copies all that was loaded
    for line in sys.stdin:
        request = json.loads(line)
        child = os.fork()
        if not child:
            become(request)
            return True
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
    return False


def become(request):
    """Take over what a process of its own would have been started with."""
    os.chdir(request["cwd"])
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for number, name in ((1, "out"), (2, "err")):
        os.dup2(os.open(request[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.argv = ["hrcneuro", *request["arguments"]]


def leave(code):
    """End as Python does, except for taking the loaded libraries apart, which takes a second."""
    threading._shutdown()
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    sys.path.pop(0)  # the folder of this file
    if serve():
        from hrcneuro.__main__ import main

        try:
            main()
        except SystemExit as end:
            leave(end.code or 0)
