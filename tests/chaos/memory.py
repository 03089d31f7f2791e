"""Workers that run out of memory: ``python tests/chaos/memory.py [TRIALS] [SEED]``.

A worker at its job may have no more memory than it has (a limit of its address space), or the whole run is held in a
control group that the kernel ends processes of. The run must name what failed, and the next one complete.
"""

import contextlib
import os
import random
import resource
import shutil
import sys
import time
from pathlib import Path

from study import RUN, check, complete, ended, fresh, reference  # first: it makes the helpers importable

from quick import Quick  # isort: skip
from table import Fault, Lost, tell

# Where control groups lie, and the file of one that limits memory: the first version of them, and the second.
GROUPS = (("/sys/fs/cgroup/memory", "memory.limit_in_bytes"), ("/sys/fs/cgroup", "memory.max"))


def main(trials=10, seed=0):
    """Return 0 where nothing was lost."""
    base, draw = fresh("memory"), random.Random(seed)
    wanted = reference(base)
    limited, killed = Fault("out of memory, a worker's limit"), Fault("out of memory, the kernel's killer")
    for number in range(trials):
        with limited.trial(f"trial {number + 1}"):
            _trial(base, wanted, draw, _limit_a_worker)
    if _limit_of(base) is None:
        killed.skip("no control group of memory can be made here, of either version")
    else:
        for number in range(trials):
            with killed.trial(f"trial {number + 1}"):
                _trial(base, wanted, draw, _limit_the_run)
        with contextlib.suppress(OSError):
            _limit_of(base).parent.rmdir()
    shutil.rmtree(base)
    return tell([limited, killed])


def _trial(base, wanted, draw, limit):
    study = base / "study"
    words = [*RUN, "--workdir", study, "-j", "2", "--executor", "processes"]
    run = Quick(base, *words)
    limit(base, study, run, draw)
    code = run.wait(300)
    ended(run)
    said = run.said()
    if code == 0:
        complete(study, wanted)
    elif code == -9:
        pass  # the kernel chose the run itself
    elif code != 1 or "report it as a bug" in said or not any(w in said for w in ("died", "memory")):
        raise Lost(f"exit code {code}: {said[-900:]}")
    before = check(study, wanted)
    again = Quick(base, *RUN, "--workdir", study, "--executor", "serial")
    if again.wait(120) != 0:
        raise Lost(f"the next run ends with {again.code}: {again.said()[-500:]}")
    check(study, wanted, before)
    complete(study, wanted)
    shutil.rmtree(study)


def _limit_a_worker(base, study, run, draw):
    """Let a worker at its job have hardly more memory than it has."""
    goal, deadline = draw.randint(0, 3), time.monotonic() + 120
    while run.poll() is None and time.monotonic() < deadline:
        done = len(list(study.glob("cache/[!.]*/*/[!.]*/record.json")))
        at_work = [p for p in study.glob("cache/*/*/.tmp-*") if p.name[-1].isdigit()]
        if done >= goal and at_work:
            worker = int(draw.choice(at_work).name.rpartition("-")[2])
            with contextlib.suppress(OSError, ValueError):
                pages = int(Path(f"/proc/{worker}/statm").read_text().split()[0])
                most = pages * os.sysconf("SC_PAGE_SIZE") + draw.randint(0, 2**25)
                resource.prlimit(worker, resource.RLIMIT_AS, (most, most))
                return
        time.sleep(0.002)


def _limit_the_run(base, study, run, draw):
    """Let the whole run have less than it wants."""
    limit = _limit_of(base)
    limit.write_text(str(draw.randint(100, 700) * 2**20))
    with contextlib.suppress(OSError):
        # Else what is too much goes to the swap, and nothing is killed.
        (limit.parent / "memory.swap.max").write_text("0")
    with contextlib.suppress(OSError):
        (limit.parent / "cgroup.procs").write_text(str(run.pid))


def _limit_of(base):
    """Return the file that limits the memory of a control group of our own; None where none can be made."""
    for root, name in GROUPS:
        group = Path(root) / base.name
        with contextlib.suppress(OSError):
            if name == "memory.max":
                (Path(root) / "cgroup.subtree_control").write_text("+memory")
            group.mkdir(exist_ok=True)
            if (group / name).exists():
                return group / name
            group.rmdir()
    return None


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
