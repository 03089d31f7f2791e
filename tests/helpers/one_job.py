"""A job of the tiny study as the walk hands it to an executor, without an executor that runs it."""

from tiny_study import write_tiny

from hrcneuro.config import settings as config
from hrcneuro.errors import StageError
from hrcneuro.pipeline import graph, walk
from hrcneuro.pipeline.executors import Serial
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.job import Outcome
from hrcneuro.pipeline.workdir import Workdir


class Taken(Serial):
    """Keeps what it is handed, and runs nothing."""

    def __init__(self):
        self.jobs = []

    def submit(self, call, /, *args):
        self.jobs += args
        return super().submit(Outcome, State.FAILED, None, 0.0, StageError("taken"))


def one_job(folder, subject="s01"):
    """Return the job that acquires a subject, and its working folder."""
    write_tiny(folder)
    settings = config.load(folder / "tiny.toml")
    workdir = Workdir(folder / "study")
    wanted = graph.targets(settings, ["acquire"], [subject])
    with Taken() as taken:
        walk.Run(settings, workdir, graph.closure(settings, wanted)).run(taken)
    return taken.jobs[0], workdir
