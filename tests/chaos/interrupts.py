"""Ctrl-C, and Ctrl-C again, at random instants: ``python tests/chaos/interrupts.py [TRIALS] [SEED]``.

The key reaches the whole terminal, so all processes of the run. It must end soon, with 130, leave no process, and lose
nothing; the next run completes. After one key nothing half-written is left; after two there may be, and it is swept.
"""

import contextlib
import importlib.util
import os
import random
import shutil
import signal
import sys
import time

from study import RUN, check, complete, ended, fresh, half_written, reference  # first: it makes the helpers importable

from quick import Quick  # isort: skip
from table import Fault, Lost, tell

SOON_S = 20.0


def main(trials=20, seed=0):
    """Return 0 where nothing was lost."""
    base, draw = fresh("interrupts"), random.Random(seed)
    wanted = reference(base)
    names = ["serial", "processes", *(["dask"] if importlib.util.find_spec("distributed") else [])]
    faults = []
    for name in names:
        fault = Fault(f"Ctrl-C twice, executor {name}")
        faults.append(fault)
        for number in range(trials):
            with fault.trial(f"trial {number + 1}"):
                _trial(base, wanted, draw, name, keys=1 + (number % 4 > 0))
    shutil.rmtree(base)
    return tell(faults)


def _trial(base, wanted, draw, name, keys):
    study = base / name
    words = [*RUN, "--workdir", study, "--executor", name, "-j", "2"]
    run = Quick(base, *words)
    # Not before it has begun to listen.
    deadline = time.monotonic() + 60
    while not list(study.glob("results/log/*")) and run.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    run.wait(draw.uniform(0.0, 4.0 if name != "serial" else 2.0))
    for _ in range(keys):
        if run.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGINT)
            run.wait(draw.choice((0.0, 0.01, 0.3)))
    begin = time.monotonic()
    code = run.wait(SOON_S)
    if code is None:
        run.kill(group=True)
        raise Lost(f"after {keys} keys the run does not end within {SOON_S:g} s: {run.said()[-500:]}")
    ended(run, SOON_S)
    said = run.said()
    if code not in (0, 130) or "Traceback" in said:
        raise Lost(f"exit code {code} after {time.monotonic() - begin:.1f} s: {said[-900:]}")
    before = check(study, wanted)
    if code == 0:
        complete(study, wanted)
    elif keys == 1 and (left := half_written(study)):
        raise Lost(f"half-written after one key: {left[:2]}")
    again = Quick(base, *RUN, "--workdir", study, "--executor", "serial")
    if again.wait(120) != 0:
        raise Lost(f"the next run ends with {again.code}: {again.said()[-500:]}")
    check(study, wanted, before)
    complete(study, wanted)
    shutil.rmtree(study)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
