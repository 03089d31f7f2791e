"""A dask scheduler and its workers, each a process of its own, as on a cluster."""

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

from tiny_study import ROOT, wait_for


class Lab:
    """What runs: the scheduler's address, and the workers' processes."""

    def __init__(self, folder):
        self.folder = folder
        self.workers = []
        self.started = 0
        self.scheduler = self._start("scheduler", "--port", "0", "--no-dashboard")
        file = folder / "scheduler.json"
        wait_for(lambda: file.exists() and file.read_text().strip().endswith("}"))
        self.address = json.loads(file.read_text())["address"]

    def add_worker(self, **environment):
        """Start one more worker and return its process, once the scheduler knows it."""
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", self.folder)
        self.workers.append(self._start("worker", *options, **environment))
        log = self.folder / f"worker-{self.started}.log"
        wait_for(lambda: "Registered to" in log.read_text())
        return self.workers[-1]

    def end(self):
        """End all processes."""
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()

    def _start(self, what, *options, **environment):
        self.started += 1
        with (self.folder / f"{what}-{self.started}.log").open("w") as log:
            return subprocess.Popen(
                [
                    *(sys.executable, "-m", f"distributed.cli.dask_{what}"),
                    *("--scheduler-file", self.folder / "scheduler.json", *map(str, options)),
                ],
                env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
                cwd=self.folder,
                stdout=log,
                stderr=log,
            )


@contextlib.contextmanager
def dask_lab(folder, *, workers=2):
    """Yield a scheduler with workers; all of it ends with the block."""
    lab = Lab(Path(folder))
    try:
        for _ in range(workers):
            lab.add_worker()
        yield lab
    finally:
        lab.end()
