"""Jobs on a SLURM cluster: arrays of them, submitted by submitit; SLURM's own queue says what becomes of each."""

from __future__ import annotations

import pickle
import shutil
import signal
import sys
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hrcneuro.errors import ConfigError
from hrcneuro.pipeline import slurm_queue
from hrcneuro.pipeline.cluster import Cluster, Site, Trip
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.worker import Answer, Ticket, work

# So long jobs are gathered for one array: the walk hands them over one by one.
_GATHER_S = 0.5
# Answers are files, and cheap to look for; the queue is a question to a server that all users share.
_LOOK_S, _ASK_S = 0.5, 5.0
# SLURM takes no longer arrays where nobody has told it to (MaxArraySize).
_LONGEST = 1000
# So long after a refusal jobs are submitted once more, while others are under way: there may have been too many.
_REFUSED_S = 15.0
# So long before the end of its time a job is told, so that it can remove what is half-written; SLURM may do it a minute
# earlier, and the job has its own minutes besides.
_WARNED_S, _WARNED_MIN = 30, 2
# An answer may become visible that long after SLURM has taken the job for ended.
_ANSWER_S = 30.0


@dataclass
class _Sent:
    """A job in SLURM's hands: what submitit knows of it, and since when SLURM takes it for ended."""

    job: Any
    ended: float = 0.0


@dataclass
class _Gathered:
    """Trips that wait to be submitted together, and since when."""

    trips: list[Trip] = field(default_factory=list)
    since: float = 0.0


class Slurm(Cluster):
    """Sends jobs to SLURM, those that may use the same in one array."""

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        if not shutil.which("sbatch"):
            raise ConfigError(
                "--executor slurm needs the command sbatch, which is not here",
                cure="run it on a machine of the cluster that may submit jobs, or choose another executor",
            )
        try:
            import submitit
        except ModuleNotFoundError as error:
            raise ConfigError(
                f"--executor slurm needs {error.name}, which is not installed", cure="pip install 'hrcneuro[slurm]'"
            ) from error
        self._submitit = submitit
        self._waiting = _Gathered()
        self._sent: dict[Trip, _Sent] = {}
        self._guard = threading.Lock()
        self._ended = threading.Event()
        self._answered = time.monotonic()
        self._thread = threading.Thread(target=self._look_after, name="slurm", daemon=True)

    def open(self) -> None:
        """Ask SLURM whether it is there, and begin to look after jobs.

        Raises:
            ConfigError: It does not answer.
        """
        code, said = slurm_queue.asked(["sinfo", "--noheader", "--format=%P"])
        if code:
            raise ConfigError(f"SLURM does not answer: {said}", cure="see whether 'sinfo' works on this machine")
        self._thread.start()

    def send(self, trip: Trip) -> None:
        """Put a job among those that go with the next array."""
        with self._guard:
            self._waiting.trips.append(trip)
            self._waiting.since = time.monotonic()

    def close(self, *, interrupted: bool) -> None:
        """Leave SLURM; what is under way there is cancelled where the run was interrupted."""
        self._ended.set()
        self._thread.join(30.0)
        ids = [sent.job.job_id for sent in self._sent.values()]
        if interrupted and ids:
            slurm_queue.asked(["scancel", *ids])

    def _look_after(self) -> None:
        looked = asked = 0.0
        while not self._ended.wait(0.1):
            now = time.monotonic()
            try:
                self._submit_gathered(now)
                if now - looked >= _LOOK_S:
                    self._take_answers()
                    looked = now
                if now - asked >= _ASK_S and self._sent:
                    self._ask()
                    asked = time.monotonic()
            except Exception as error:
                # Nobody else looks after the jobs: a run that waits for ever would say less.
                for trip in list(self.under_way):
                    self.broken(trip, error)

    def _submit_gathered(self, now: float) -> None:
        with self._guard:
            trips = self._waiting.trips if now - self._waiting.since >= _GATHER_S else []
            if trips:
                self._waiting = _Gathered()
        for alike in _grouped(trips):
            self._submit(alike)

    def _submit(self, trips: list[Trip]) -> None:
        """Submit jobs of one stage that may use the same, as one array."""
        what, task, options = trips[0].resources, trips[0].job.task, self.site.options
        try:
            engine = self._submitit.SlurmExecutor(self.folder / "slurm")
            engine.update_parameters(
                job_name=f"hrcneuro-{task.name}",
                time=what.minutes + _WARNED_MIN,
                mem=f"{what.memory_gb:g}GB",
                cpus_per_task=1,
                ntasks_per_node=1,
                array_parallelism=self.site.workers or _LONGEST,
                signal_delay_s=_WARNED_S,
                **({"partition": options.partition} if options.partition else {}),
                **({"account": options.account} if options.account else {}),
                additional_parameters=dict(options.sbatch),
            )
            with engine.batch():
                jobs = [engine.submit(in_a_job, self.ticket(trip, counted=False)) for trip in trips]
        except Exception as error:
            if self._sent:
                with self._guard:
                    self._waiting.trips += trips
                    self._waiting.since = time.monotonic() + _REFUSED_S
                return
            said = "; ".join(line.removeprefix("sbatch: ").removeprefix("error: ") for line in str(error).splitlines())
            for trip in trips:
                self.fail(trip, _refused(trip, said))
            return
        self._answered = time.monotonic()
        self._sent |= {trip: _Sent(job) for trip, job in zip(trips, jobs, strict=True)}

    def _take_answers(self) -> None:
        """Settle the trips whose jobs have left an answer."""
        answers = {trip: sent for trip, sent in self._sent.items() if sent.job.paths.result_pickle.exists()}
        for trip, sent in answers.items():
            del self._sent[trip]
            self._take(trip, sent)

    def _ask(self) -> None:
        """Settle the trips of whose jobs SLURM says that they have ended without an answer."""
        states = slurm_queue.states(self._sent[trip].job.job_id for trip in self._sent)
        wait_s, now = self.site.options.wait_s, time.monotonic()
        if states is None:
            if now - self._answered > wait_s:
                for trip in list(self._sent):
                    del self._sent[trip]
                    self.missing(trip, f"SLURM has not answered for {wait_s:g} s")
            return
        self._answered = now
        for trip, sent in list(self._sent.items()):
            state, code = states.get(sent.job.job_id, ("GONE", 0))
            if state in slurm_queue.LIVES:
                sent.ended = 0.0
            elif not sent.ended:
                sent.ended = now
            elif now - sent.ended > (_ANSWER_S if state in ("COMPLETED", "GONE") else 0.0):
                del self._sent[trip]
                self._lost(trip, sent, state, code)

    def _take(self, trip: Trip, sent: _Sent) -> None:
        """Settle a trip by what its job has left."""
        # Not by submitit's result(): it asks SLURM's accounting first, which many clusters do not keep.
        try:
            succeeded, value = pickle.loads(sent.job.paths.result_pickle.read_bytes())
        except Exception as error:
            self.broken(trip, error)
            return
        if succeeded != "success":
            self.missing(trip, f"its job failed: {(value.strip().splitlines() or ['no words'])[-1][-200:]}")
        elif value == OUT_OF_TIME:
            late = slurm_queue.late(trip.resources)
            self.lost(trip, late.reason, ran_out_of=late.ran_out_of)
        else:
            self.arrived(trip, value)

    def _lost(self, trip: Trip, sent: _Sent, state: str, code: int) -> None:
        judged = slurm_queue.verdict(state, code, trip.resources)
        if judged.again:
            self.lost(trip, judged.reason, ran_out_of=judged.ran_out_of, preempted=judged.preempted)
        else:
            said = last_words(sent.job.paths.stderr) if state == "FAILED" else ""
            self.missing(trip, f"{judged.reason}{f': {said}' if said else ''}")


OUT_OF_TIME = "out of time"


def in_a_job(ticket: Ticket) -> Answer | str:
    """Return the answer to a ticket, or ``OUT_OF_TIME``; the life of a SLURM job.

    SLURM tells a job some time before it ends it: what is half-written is removed then.
    """
    told = threading.Event()

    def out_of_time(*_: object) -> None:
        told.set()
        raise SystemExit(1)

    # submitit would have the job queued again by itself, or fail it with an exception that looks like the stage's own.
    signal.signal(signal.SIGUSR2, out_of_time)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        answer = work(ticket)
    except SystemExit:
        if told.is_set():
            return OUT_OF_TIME
        raise
    # Some places make another exception of an exit, such as those that import.
    return OUT_OF_TIME if told.is_set() and answer.state is State.FAILED else answer


def _refused(trip: Trip, said: str) -> ConfigError:
    asked = f"{trip.resources.memory_gb:g} GB and {trip.resources.minutes + _WARNED_MIN} min"
    return ConfigError(
        f"SLURM takes no job of {trip.job.task.name} with {asked}: {said}",
        cure="see memory_gb, minutes, partition, account and sbatch in [cluster]; 'sinfo' shows what the cluster has",
    )


def _grouped(trips: Iterable[Trip]) -> list[list[Trip]]:
    alike: dict[Any, list[Trip]] = {}
    for trip in trips:
        alike.setdefault((trip.job.task.name, trip.resources), []).append(trip)
    return [trips[n : n + _LONGEST] for trips in alike.values() for n in range(0, len(trips), _LONGEST)]


def last_words(path: Path) -> str:
    """Return the last line that a job wrote on standard error before SLURM did; empty where there is none."""
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    except OSError:
        return ""
    # SLURM only says behind it that the job has failed.
    own = [line for line in lines if not line.startswith(("srun: ", "slurmstepd: "))]
    return (own or lines or [""])[-1][-200:]
