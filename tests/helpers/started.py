"""Processes of their own that start at once: a process that has loaded the libraries forks for each.

Loading takes a second or more and is the same for every command. The child is a process like any other: its own
arguments, folder, environment, streams and exit code; only that a run has one worker where -j does not say otherwise,
and that what one child has read of the program's source, for the keys, the next need not parse again.
``python started.py MODULE …`` is the process that forks, with these modules loaded: it reads one request a line and
answers with the number of the child, then with its exit code.
"""

import atexit
import functools
import gc
import importlib
import json
import os
import runpy
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

LIBRARIES = (
    *("numpy", "pandas", "scipy.signal", "scipy.stats", "scipy.fft", "scipy.interpolate", "pyarrow.parquet", "mne"),
    *("sklearn.discriminant_analysis", "sklearn.model_selection", "matplotlib.figure", "threadpoolctl", "jinja2"),
)
PRODUCT = (*LIBRARIES, "hrcneuro.cli.app")
# What Python and its libraries read but once, while they are loaded.
_READ_ONCE = ("PYTHON", "LC_", "LANG", "LD_", "MPL", "OMP_", "OPENBLAS_", "MKL_", "LSL")


def read_once(names):
    """Return whether some of these variables of the environment no longer count where the libraries are loaded."""
    return any(name.startswith(_READ_ONCE) for name in names)


class Starter:
    """Runs one process after another; the one that forks lives until :meth:`end`, with ``modules`` loaded.

    ``memory`` is the file in which they keep what they have read of the program's source; it may be others', too.
    """

    def __init__(self, folder, modules=PRODUCT, memory=None):
        # One thread: a process that forks must have no other.
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        self.environment = {**os.environ, **threads, "NO_COLOR": "1"}
        self.environment.pop("HRCNEURO_CACHE", None)
        self._memory = memory
        self._process = subprocess.Popen(
            [sys.executable, __file__, *modules],
            cwd=folder,
            env=self.environment,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )

    def run(self, arguments, *, cwd, timeout, code=None, environment=None, paths=()):
        """Return exit code, standard output and standard error of ``python -m hrcneuro``, or of ``python -c code``.

        ``environment`` comes to what there is; ``paths`` are searched for modules before all others.
        """
        with tempfile.TemporaryDirectory() as folder:
            out, err = Path(folder, "out"), Path(folder, "err")
            around = {**self.environment, **(environment or {})}
            asked = request(arguments, cwd, around, out, err, code=code, paths=paths, memory=self._memory)
            self._process.stdin.write(json.dumps(asked) + "\n")
            self._process.stdin.flush()
            child = int(self._process.stdout.readline())
            late = threading.Timer(timeout, os.kill, (child, signal.SIGKILL))
            late.start()
            ended = int(self._process.stdout.readline())
            late.cancel()
            assert late.is_alive() or ended != -signal.SIGKILL, f"{arguments} took more than {timeout} s"
            return ended, out.read_text(encoding="utf-8"), err.read_text(encoding="utf-8")

    def end(self):
        """End the process that forks."""
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()


def request(arguments, cwd, environment, out, err, *, code=None, paths=(), memory=None):
    """Return what :func:`become` and :func:`perform` take, as JSON has it."""
    return {
        "code": code,
        "arguments": [*map(str, arguments)],
        "cwd": str(cwd),
        "environment": dict(environment),
        "paths": [*map(str, paths)],
        "memory": memory and str(memory),
        "out": str(out),
        "err": str(err),
    }


@functools.cache
def libraries():
    """Return a starter with nothing of the product loaded, for code that loads a copy of it, or asks what it loads."""
    starter = Starter(Path(__file__).parents[2], LIBRARIES)
    atexit.register(starter.end)
    return starter


def serve(modules):
    """Fork for each request; return it in the child, with its arguments, folder and streams in place."""
    for name in modules:
        importlib.import_module(name)
    if "hrcneuro" in sys.modules:
        # Without -j a run has a worker a core, each of which loads anew what is loaded here.
        importlib.import_module("hrcneuro.pipeline.executors").cores = lambda: 1
    gc.freeze()  # else the child's first collection copies all that was loaded
    for line in sys.stdin:
        request = json.loads(line)
        child = os.fork()
        if not child:
            become(request)
            return request
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
    return None


def become(request):
    """Take over what a process of its own would have been started with."""
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.path[:0] = [request["cwd"], *request["paths"]]
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for number, name in ((1, "out"), (2, "err")):
        os.dup2(os.open(request[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.argv = ["-c" if request["code"] else "hrcneuro", *request["arguments"]]


def remember(place):
    """Read no source file a second time that is as it was when another process read it; ``place`` is its memory.

    A fresh working folder has everything to read, which takes seconds. What is remembered goes the product's usual way
    from there: into the memo of the folder's own cache.
    """
    from hrcneuro.cache import fingerprint

    read, new = fingerprint.read_code, {}

    @functools.cache
    def known():
        return json.loads(place.read_text(encoding="utf-8")) if place.exists() else {}

    def remembered(path, name, package):
        stat = path.stat()
        row = json.dumps([str(path.absolute()), stat.st_size, stat.st_mtime_ns, stat.st_ino, name, package])
        if row not in known():
            value = read(path, name, package)
            # As for the memo: what was written a moment ago may change again within a tick of the clock.
            if time.time_ns() - stat.st_mtime_ns > 2e9:
                new[row] = value
            return value
        digest, imports = known()[row]
        return digest, imports

    def save():
        if new:
            part = place.with_name(f"{place.name}.{os.getpid()}")
            part.write_text(json.dumps({**known(), **new}), encoding="utf-8")
            part.replace(place)

    fingerprint.read_code = remembered
    atexit.register(save)


def perform(request):
    """Do what was asked for; return the exit code."""
    if request["memory"]:
        remember(Path(request["memory"]))
    try:
        if request["code"]:
            exec(compile(request["code"], "<string>", "exec"), {"__name__": "__main__"})
        else:
            runpy.run_module("hrcneuro", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        return end.code or 0
    except BaseException:
        sys.excepthook(*sys.exc_info())
        return 1
    return 0


def leave(code):
    """End as Python does, except for taking the loaded libraries apart, which takes a second."""
    threading._shutdown()
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    sys.path.pop(0)  # the folder of this file
    if asked := serve(sys.argv[1:]):
        leave(perform(asked))
