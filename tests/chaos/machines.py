"""Machines that share one cache and race: ``python tests/chaos/machines.py [TRIALS] [SEED]``.

Each machine is a namespace of its own: another host name, process numbers that others have, too, and the cache under
another path. The cache has locks, refuses them (as NFS without its lock daemon), gives them to everybody (as some that
only seem to lock), or has others on each machine; then the second begins while the first is at work. In every second
trial a machine is killed. All must end complete, with the bytes of one alone.
"""

import os
import random
import shutil
import subprocess
import sys
import time

from study import COMMAND, RUN, around, complete, fresh, reference  # first: it makes the helpers importable
from table import Fault, Lost, tell

MINE_ALONE = "locks that each machine has for itself"
LOCKS = {
    "locks that work": "",
    "no locks (ENOLCK)": "import fcntl, os, errno\ndef f(*_): raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))\n",
    "locks that do nothing": "import fcntl\ndef f(*_): return None\n",
    # As NFS with nolock or Lustre with localflock: two kinds of locks that do not see each other.
    MINE_ALONE: """
import fcntl, socket, struct
def f(file, how, flock=fcntl.flock):
    if socket.gethostname() == "node0":
        return flock(file, how)
    kind = fcntl.F_UNLCK if how & fcntl.LOCK_UN else fcntl.F_WRLCK
    fcntl.fcntl(file, fcntl.F_OFD_SETLK, struct.pack("hhqqi4x", kind, 0, 0, 0, 0))
""",
}
_APART = ("unshare", "--uts", "--pid", "--fork", "--kill-child", "--mount", "--mount-proc", "sh", "-c")
_SCRIPT = 'hostname "$1"; mount --bind "$2" "$3"; shift 3; exec "$@"'


def main(trials=6, seed=0):
    """Return 0 where nothing was lost."""
    base, draw = fresh("machines"), random.Random(seed)
    try:
        if subprocess.run([*_APART, "true"], capture_output=True, check=False).returncode:
            return tell([Fault("machines that race").skip("namespaces need root")])
        wanted = reference(base)
        faults = []
        for name, patch in LOCKS.items():
            fault = Fault(f"two machines race, {name}")
            faults.append(fault)
            for number in range(trials):
                with fault.trial(f"trial {number + 1}"):
                    place = base / f"trial{len(faults)}-{number}"
                    _race(place, base, wanted, patch, draw, killed=number % 2, at_work=name == MINE_ALONE)
        return tell(faults)
    finally:
        shutil.rmtree(base, ignore_errors=True)


def _race(place, base, wanted, patch, draw, *, killed, at_work):
    """Let two machines run; ``at_work``: the second begins while the first is in the middle of a task."""
    shared, site = place / "shared", place / "site"
    for folder in (shared, site, *(place / f"node{n}" / "cache" for n in range(2))):
        folder.mkdir(parents=True)
    if patch:
        (site / "sitecustomize.py").write_text(f"{patch}fcntl.flock = f\n")
    # The second begins where the first is, or a little later.
    runs = []
    for n in range(2):
        runs.append(_start(place, base, n, site))
        if at_work:
            _until_at_work(shared, runs[0], draw)
        else:
            time.sleep(draw.choice((0.0, 0.0, 0.5)))
    if killed:
        time.sleep(draw.uniform(1.5, 6.0))
        os.killpg(runs[0].pid, 9)
    for n, run in enumerate(runs):
        _, err = run.communicate(timeout=300)
        if killed and n == 0:
            continue
        if run.returncode != 0:
            raise Lost(f"machine {n} ends with {run.returncode}: {err[-500:]}")
    _whole(place, shared, wanted, range(killed, 2))
    if killed:
        again = _start(place, base, 0, site)
        _, err = again.communicate(timeout=300)
        if again.returncode != 0:
            raise Lost(f"the killed machine, begun again, ends with {again.returncode}: {err[-500:]}")
        _whole(place, shared, wanted, range(2))
    shutil.rmtree(place)


def _until_at_work(shared, run, draw):
    """Wait until somebody writes an entry, and a little longer."""
    deadline = time.monotonic() + 120
    while not list(shared.glob("[!.]*/*/.tmp-*")) and run.poll() is None:
        if time.monotonic() > deadline:
            raise Lost("nobody begins")
        time.sleep(0.005)
    time.sleep(draw.uniform(0.0, 0.3))


def _start(place, base, n, site):
    node = place / f"node{n}"
    environment = around({"HRCNEURO_LOCK_WAIT": "2.5"})
    environment["PYTHONPATH"] = f"{site}{os.pathsep}{environment['PYTHONPATH']}"
    machine = [*_APART, _SCRIPT, "sh", f"node{n}", place / "shared", node / "cache"]
    words = [*COMMAND, *RUN, "--workdir", node, "-q", "-j", "2", "--executor", ("processes", "serial")[n]]
    return subprocess.Popen(
        [*map(str, machine), *map(str, words)], cwd=base, env=environment, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def _whole(place, shared, wanted, machines):
    """Hold the cache, seen from each machine, to what one machine alone makes."""
    for n in machines:
        seen = place / f"node{n}" / "cache"
        seen.rmdir()
        seen.symlink_to(shared)
        try:
            complete(place / f"node{n}", wanted)
        finally:
            seen.unlink()
            seen.mkdir()


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
