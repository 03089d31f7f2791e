"""Holds the own worker pool against pebble and loky: what a death, an odd answer and an interrupt cost, and time.

Each trial runs in a process of its own. The libraries get all that their public interfaces let one add: a first call in
every worker that leaves Ctrl-C to the parent, makes an exit of SIGTERM and watches the parent. A library that is not
installed (``pip install pebble loky``) is left out. The exit code is 1 where the own pool fails what it is kept for.
"""

from __future__ import annotations

import argparse
import concurrent.futures as futures
import contextlib
import importlib.util
import json
import multiprocessing
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

import _measure

Submit = Callable[..., futures.Future]
Pool = Callable[[int], AbstractContextManager[Submit]]
GOOD = "3 of 3 others came back"


@contextlib.contextmanager
def own(workers: int) -> Iterator[Submit]:
    from hrcneuro.pipeline.executors import Processes

    with Processes(workers) as pool:
        yield pool.submit


@contextlib.contextmanager
def pebble(workers: int) -> Iterator[Submit]:
    from pebble import ProcessPool

    pool = ProcessPool(workers, initializer=prepare, context=multiprocessing.get_context("spawn"))
    try:
        yield lambda call, *args: pool.schedule(call, args=args)
        pool.close()
    except BaseException:
        pool.stop()
        raise
    finally:
        pool.join()


@contextlib.contextmanager
def loky(workers: int) -> Iterator[Submit]:
    from loky.process_executor import ProcessPoolExecutor

    pool = ProcessPoolExecutor(workers, context=multiprocessing.get_context("spawn"), initializer=prepare)
    try:
        yield pool.submit
        pool.shutdown()
    except BaseException:
        pool.shutdown(kill_workers=True)
        raise


POOLS: dict[str, Pool] = {"own": own, "pebble": pebble, "loky": loky}


def prepare() -> None:
    """Do in a library's worker what the own pool's workers do."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    threading.Thread(target=end_with_parent, daemon=True).start()


def end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def die(after_s: float) -> None:
    """End as where memory has run out."""
    time.sleep(after_s)
    os.kill(os.getpid(), signal.SIGKILL)


def work_in(folder: Path, deaf: bool = False) -> None:
    """Work in a temporary folder that goes when the job ends; deaf to SIGTERM, as deep in a numeric library."""
    if deaf:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    with tempfile.TemporaryDirectory(dir=folder):
        time.sleep(120)


class Unpickled:
    """Something that calls a function while it is unpickled, as modules are imported then."""

    def __init__(self, call: Callable[..., Any], *args: Any) -> None:
        self.call, self.args = call, args

    def __reduce__(self) -> tuple:
        return self.call, self.args


class Refused(Exception):
    """An exception that can be pickled, but not unpickled: many libraries have one."""

    def __init__(self, quantity: str, value: float) -> None:
        super().__init__(f"{quantity} is {value}")


def refuse() -> None:
    raise Refused("temperature", 451.0)


def one_bad(bad: tuple[Any, ...], pool: Pool, patience_s: float) -> str:
    """Return how many of three good jobs came back beside a bad one, one of them at work when that begins."""
    with pool(2) as submit:
        futures.wait([submit(time.sleep, 0.2), submit(time.sleep, 0.2)])
        others = [submit(time.sleep, 1.0)]
        time.sleep(0.3)
        odd = submit(*bad)
        others += [submit(time.sleep, 0.2), submit(time.sleep, 0.2)]
        begin = time.perf_counter()
        _, waiting = futures.wait([odd, *others], timeout=patience_s)
        took = time.perf_counter() - begin
        good = sum(other.done() and other.exception() is None for other in others)
        error = None if odd in waiting else odd.exception()
        code = getattr(error, "exitcode", None)
        said = f"{type(error).__name__} {' '.join(str(error).split())[:40]}" + (f", code {code}" if code else "")
        without = f", {len(waiting)} jobs without an end" if waiting else ""
        print(json.dumps(f"{good} of 3 others came back{without} after {took:.0f} s: {said}"), flush=True)
        os.killpg(0, signal.SIGKILL)  # who waits for what never ends would wait here too
    return ""


def interrupt(deaf: bool, pool: Pool, _: float) -> str:
    """Return how soon all has ended after Ctrl-C, with four workers at work, and what is left."""
    folder = Path(tempfile.mkdtemp(prefix="bench-pool-"))
    begin = 0.0
    with contextlib.suppress(KeyboardInterrupt), pool(4) as submit:
        for _number in range(4):
            submit(work_in, folder, deaf)
        while len(list(folder.iterdir())) < 4:
            time.sleep(0.01)
        begin = time.perf_counter()
        os.killpg(0, signal.SIGINT)
        time.sleep(60)
    took, left = time.perf_counter() - begin, len(list(folder.iterdir()))
    shutil.rmtree(folder)
    return f"{took:.1f} s, {left} of 4 temporary folders left"


def orphans(pool: Pool, _: float) -> str:
    """Be killed while two workers work; who started this counts those that live on."""
    with pool(2) as submit:
        submit(time.sleep, 30)
        submit(time.sleep, 30)
        time.sleep(2)
        os.kill(os.getpid(), signal.SIGKILL)
    return ""


def imports(pool: Pool, _: float) -> str:
    """Return how long four workers, which are there, take for a job each that takes 1 s to be unpickled."""
    with pool(4) as submit:
        futures.wait([submit(time.sleep, 1.0) for _number in range(4)])
        begin = time.perf_counter()
        futures.wait([submit(time.sleep, Unpickled(sleep, 1.0)) for _number in range(4)])
        return f"{time.perf_counter() - begin:.1f} s"


def sleep(seconds: float) -> float:
    time.sleep(seconds)
    return 0.0


def costs(pool: Pool, _: float) -> str:
    """Return what two workers cost where nothing goes wrong."""
    begin = time.perf_counter()
    with pool(2) as submit:
        futures.wait([submit(time.sleep, 0.1), submit(time.sleep, 0.1)])
        start, turns = time.perf_counter() - begin - 0.1, []
        for _number in range(300):
            begin = time.perf_counter()
            submit(abs, 1).result()
            turns.append(time.perf_counter() - begin)
        pids = [os.getpid(), *workers_of(os.getpgrp())]
        memory, busy = sum(memory_mb(pid) for pid in pids), processor_s(pids)
        time.sleep(10)
        busy = (processor_s(pids) - busy) / 10
    turn = statistics.median(turns)
    return f"start {start:.2f} s, a turn {1e3 * turn:.2f} ms, idle {1e3 * busy:.2f} ms/s, {memory:.0f} MB"


TRIALS: dict[str, tuple[Callable[[Pool, float], str], Callable[[str], bool]]] = {
    "a worker is killed at work": (partial(one_bad, (die, 0.1)), lambda v: GOOD in v and "SIGKILL" in v),
    "… while it unpickles a job": (
        partial(one_bad, (abs, Unpickled(die, 0.1))), lambda v: GOOD in v and "SIGKILL" in v),
    "an exception cannot be unpickled": (partial(one_bad, (refuse,)), lambda v: GOOD in v),
    "Ctrl-C, four workers": (partial(interrupt, False), lambda v: ", 0 of 4" in v),
    "… deaf to SIGTERM": (partial(interrupt, True), lambda v: float(v.split()[0]) < 4),
    "the parent is killed": (orphans, lambda v: v.startswith("0 of 2")),
    "four jobs, 1 s of imports each": (imports, lambda v: float(v.split()[0]) < 2),
    "costs of two workers": (costs, lambda v: True),
}  # fmt: skip


def trial(pool: str, name: str, patience_s: float) -> str:
    """Return what a trial in a process group of its own gives."""
    command = [sys.executable, __file__, "--trial", name, "--pool", pool, "--patience", str(patience_s)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
    )
    try:
        if TRIALS[name][0] is orphans:
            process.wait()
            time.sleep(3)
            return f"{len(workers_of(process.pid))} of 2 workers live on after 3 s"
        return json.loads(process.communicate(timeout=patience_s + 60)[0])
    except subprocess.TimeoutExpired:
        return f"no end after {patience_s + 60:.0f} s"
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def workers_of(leader: int) -> list[int]:
    """Return the living workers in a process group: neither its leader nor multiprocessing's resource tracker."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            fields = (path / "stat").read_text().rpartition(")")[2].split()
            of_group = int(fields[2]) == leader and fields[0] != "Z" and path.name != str(leader)
            if of_group and b"resource_tracker" not in (path / "cmdline").read_bytes():
                found.append(int(path.name))
    return found


def processor_s(pids: list[int]) -> float:
    threads = [thread for pid in pids for thread in Path(f"/proc/{pid}/task").iterdir()]
    return sum(int((thread / "schedstat").read_text().split()[0]) for thread in threads) / 1e9


def memory_mb(pid: int) -> float:
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("Pss:"))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="give a job up after 10 s instead of 90")
    parser.add_argument("--trial", choices=TRIALS, help="one trial, in this process")
    parser.add_argument("--pool", choices=POOLS, default="own", help="the pool of --trial")
    parser.add_argument("--patience", type=float, default=90.0, help="seconds after which a job of --trial is given up")
    chosen = parser.parse_args()
    if chosen.trial:
        print(json.dumps(TRIALS[chosen.trial][0](POOLS[chosen.pool], chosen.patience)))
        return 0
    pools = [name for name in POOLS if name == "own" or importlib.util.find_spec(name)]
    print(_measure.machine())
    print(f"| trial | {' | '.join(pools)} |\n|{'---|' * (len(pools) + 1)}")
    failed = []
    for name, (_, will_do) in TRIALS.items():
        values = [trial(pool, name, 10.0 if chosen.quick else 90.0) for pool in pools]
        print(f"| {name} | {' | '.join(values)} |", flush=True)
        failed += [] if will_do(values[0]) else [name]
    print(f"the own pool fails: {', '.join(failed)}" if failed else "the own pool holds")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
