"""Kill -9 runs, and their workers, at random instants: ``python tests/chaos/kills.py [KILLS] [SEED] [EXECUTOR…]``.

An instant is drawn as a number of further entries and a time after them, so that a busy machine sees the whole run too.
After each kill every entry that was there is still there, verifies, and has the bytes of a run that nobody disturbed.
A run that was killed is begun again where it stopped; one that says it is complete is held to it, and begins anew.
"""

import contextlib
import importlib.util
import os
import random
import shutil
import signal
import sys
import time

from study import RUN, check, complete, ended, fresh, reference  # first: it makes the helpers importable

from quick import Quick  # isort: skip
from dask_lab import dask_lab
from slurm_lab import slurm, why_not
from table import Fault, Lost, shared_out, tell

# What share of the kills an executor gets: the first starts at once, the last takes many seconds. And how long after an
# entry a kill may come.
SHARES = {"serial": 0.5, "processes": 0.28, "dask": 0.16, "slurm": 0.06}
LATEST_S = {"serial": 0.6, "processes": 3.0, "dask": 1.5, "slurm": 4.0}
_RUN_S = 300.0


def main(kills=500, seed=0, *names):
    """Return 0 where nothing was lost."""
    base = fresh("kills")
    wanted = reference(base)
    absent = {name: reason for name in names or SHARES if (reason := _absent(name))}
    numbers = dict.fromkeys(names, kills) or shared_out(kills, {n: s for n, s in SHARES.items() if n not in absent})
    faults = [Fault(f"kill -9, executor {name}").skip(reason) for name, reason in absent.items()]
    for name, number in numbers.items():
        if name in absent or not number:
            continue
        fault, again = Fault(f"kill -9, executor {name}"), Fault(f"begun again after kills, executor {name}")
        faults += [fault, again]
        with _engine(name, base) as (words, environment, lab):
            killer = _Killer(name, base, wanted, random.Random(f"{seed} {name}"), words, environment, lab)
            killer.kill(number, fault, again)
    shutil.rmtree(base)
    return tell(faults)


@contextlib.contextmanager
def _engine(name, base):
    """Yield the words and the environment that choose an executor, and a dask laboratory."""
    with contextlib.ExitStack() as exits:
        words, environment, lab = ["--executor", name, "-j", "2"], {}, None
        if name == "dask":
            (base / "dask-lab").mkdir()
            lab = exits.enter_context(dask_lab(base / "dask-lab"))
            words = ["--executor", "dask", "--set", f"cluster.scheduler={lab.address}"]
        if name == "slurm":
            environment = exits.enter_context(slurm(base / "slurm-lab", cores=4))
        yield words, environment, lab


def _absent(executor):
    """Return why an executor cannot be tried here; empty where it can."""
    if executor == "dask":
        return "" if importlib.util.find_spec("distributed") else "the extra dask is not installed"
    if executor == "slurm":
        return why_not() or ("" if importlib.util.find_spec("submitit") else "submitit is not installed")
    return ""


class _Killer:
    def __init__(self, name, base, wanted, draw, words, environment, lab):
        self.name, self.base, self.wanted, self.draw = name, base, wanted, draw
        self.words, self.environment, self.lab = words, environment, lab
        self.study = base / name
        self.before = {}
        self.complete = 0

    def kill(self, number, fault, again):
        """Kill so often, then let a last run complete, which is no kill; tell how it went."""
        begin = time.monotonic()
        while fault.tried < number:
            run = Quick(self.base, *RUN, "--workdir", self.study, *self.words, environment=self.environment)
            self._wait(run)
            if run.poll() is not None:
                self._completed(run)
                continue
            with fault.trial(f"kill {fault.tried + 1}"):
                self._kill_one(run)
                self.before = check(self.study, self.wanted, self.before)
        with again.trial("the last run completes"):
            run = Quick(self.base, *RUN, "--workdir", self.study, *self.words, environment=self.environment)
            if run.wait(_RUN_S) != 0:
                raise Lost(f"exit code {run.code}: {run.said()[-500:]}")
            self.before = {}
            complete(self.study, self.wanted)
        fault.note = f"{self.complete} runs completed in between; {time.monotonic() - begin:.0f} s"
        print(f"{fault.fault}: {fault.tried} tried, {fault.lost} lost, {fault.note}", flush=True)

    def _wait(self, run):
        """Wait for an instant that is drawn."""
        goal, deadline = len(self._entries()) + self.draw.randint(0, 2), time.monotonic() + _RUN_S
        while len(self._entries()) < goal and run.poll() is None and time.monotonic() < deadline:
            time.sleep(0.005)
        run.wait(self.draw.uniform(0.0, LATEST_S[self.name]))

    def _entries(self):
        return list(self.study.glob("cache/[!.]*/*/[!.]*/record.json"))

    def _completed(self, run):
        """Hold a run that has ended to its word, and begin anew."""
        if run.code != 0:
            raise SystemExit(f"a run that nobody disturbed ended with {run.code}: {run.said()[-2000:]}")
        complete(self.study, self.wanted)
        self.complete += 1
        self.before = {}
        memo = (self.study / "cache" / ".memo.json").read_bytes()
        shutil.rmtree(self.study)
        # Hashes of the program's code: to make them again each time would only cost time.
        (self.study / "cache").mkdir(parents=True)
        (self.study / "cache" / ".memo.json").write_bytes(memo)

    def _kill_one(self, run):
        """Kill the run, its group, or a worker at its job."""
        victim = self._victim() if self.draw.random() < 0.35 else None
        if victim is None:
            run.kill(group=self.draw.random() < 0.5)
            run.wait(30.0)
            ended(run)
            return
        with contextlib.suppress(ProcessLookupError):
            os.kill(victim, signal.SIGKILL)
        if self.lab is not None:
            for worker in self.lab.workers:
                if worker.pid == victim:
                    worker.wait()
                    self.lab.workers.remove(worker)
                    self.lab.add_worker()
                    break
        code = run.wait(_RUN_S)
        said = run.said()
        if code is None:
            run.kill(group=True)
            raise Lost("a run whose worker was killed does not end")
        if code == 0:
            self.before = {}
            complete(self.study, self.wanted)
        elif code != 1 or not any(word in said for word in ("died", "missing", "killed")):
            raise Lost(f"exit code {code}, and nobody says what is missing: {said[-500:]}")

    def _victim(self):
        """Return the process that works at a job, if it is none of the run itself."""
        if self.name == "serial":
            return None
        found = [int(p.name.rpartition("-")[2]) for p in self.study.glob("cache/*/*/.tmp-*") if p.name[-1].isdigit()]
        return self.draw.choice(found) if found else None


if __name__ == "__main__":
    sys.exit(main(*(int(word) if word.isdigit() else word for word in sys.argv[1:])))
