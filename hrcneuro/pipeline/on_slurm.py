"""Jobs on a SLURM cluster: arrays of them, submitted by submitit; SLURM's own queue says what becomes of each."""

from __future__ import annotations

import contextlib
import pickle
import shutil
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from hrcneuro.errors import ConfigError
from hrcneuro.pipeline import slurm_queue
from hrcneuro.pipeline.cluster import Cluster, Dispatch, Site
from hrcneuro.pipeline.slurm_job import OUT_OF_TIME, PREEMPTED, WARNED_MIN, last_words, private_folder, read_answer
from hrcneuro.pipeline.slurm_submission import LONGEST, NotTaken, alike, submit

# So long jobs are gathered for one array: the walk hands them over one by one.
_GATHER_S = 0.5
# Answers are files, and cheap to look for; the queue is a question to a server that all users share.
_LOOK_S, _ASK_S = 0.5, 5.0
# So long after they were not taken jobs are submitted once more: SLURM may be busy, or there may be too many.
_BUSY_S, _REFUSED_S = 5.0, 15.0
# An answer may become visible that long after SLURM has taken the job for ended.
_ANSWER_S = 30.0


@dataclass
class _Sent:
    """A job in SLURM's hands.

    Attributes:
        job: What submitit knows of it.
        ended: Since when SLURM takes it for ended; 0 while it does not.
        unreadable: Since when its answer is there and cannot be read; 0 where it can.
        stuck: Since when it waits for what will not come; 0 while it does not.
    """

    job: Any
    ended: float = 0.0
    unreadable: float = 0.0
    stuck: float = 0.0


@dataclass
class _Gathered:
    """Dispatches that wait to be submitted together, and since when."""

    dispatches: list[Dispatch] = field(default_factory=list)
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
        self._sent: dict[Dispatch, _Sent] = {}
        # How long an array SLURM takes; since when it has been too busy to take any; what was told.
        self._length = LONGEST
        self._busy_since = 0.0
        self._noted: set[str] = set()
        self._guard = threading.Lock()
        self._ended = threading.Event()
        self._answered = time.monotonic()
        self._thread = threading.Thread(target=self._look_after, name="slurm", daemon=True)
        self._folders = contextlib.ExitStack()

    def open(self) -> None:
        """Ask SLURM whether it is there, and begin to look after jobs.

        Raises:
            ConfigError: It does not answer, or there is no folder for its jobs that others may not write.
        """
        code, said = slurm_queue.asked(["sinfo", "--noheader", "--format=%P"])
        if code:
            raise ConfigError(f"SLURM does not answer: {said}", cure="see whether 'sinfo' works on this machine")
        self._private = self._folders.enter_context(private_folder(self.folder))
        self._thread.start()

    def send(self, dispatch: Dispatch) -> None:
        """Put a job among those that go with the next array."""
        with self._guard:
            self._waiting.dispatches.append(dispatch)
            self._waiting.since = time.monotonic()

    def close(self, *, interrupted: bool) -> None:
        """Leave SLURM; what is under way there is cancelled where the run was interrupted."""
        self._ended.set()
        self._thread.join(30.0)
        with self._folders:
            if interrupted:
                _cancel(self._sent.values())

    def _look_after(self) -> None:
        looked = asked = 0.0
        while not self._ended.wait(0.1):
            now = time.monotonic()
            try:
                self._submit_gathered(now)
                if now - looked >= _LOOK_S:
                    self.look_for_entries()
                    self._take_answers()
                    looked = now
                if now - asked >= _ASK_S and self._sent:
                    self._ask()
                    asked = time.monotonic()
            except Exception as error:
                # Nobody else looks after the jobs: a run that waits for ever would say less.
                with self._guard:
                    self._waiting = _Gathered()
                self._give_up(list(self._sent))
                for dispatch in list(self.under_way):
                    self.broken(dispatch, error)

    def _submit_gathered(self, now: float) -> None:
        with self._guard:
            dispatches = self._waiting.dispatches if now - self._waiting.since >= _GATHER_S else []
            if dispatches:
                self._waiting = _Gathered()
        for group in alike(dispatches):
            self._submit(group)

    def _submit(self, dispatches: list[Dispatch]) -> None:
        """Submit jobs that may use the same, in one array; in shorter ones where SLURM takes none so long."""
        while dispatches:
            these = dispatches[: self._length]
            try:
                jobs = self._submit_array(these)
            except NotTaken as error:
                if error.busy:
                    self._wait_while_busy(dispatches, error)
                    return
                self._busy_since = 0.0
                if len(these) == 1:
                    self._take_refusal(dispatches, error)
                    return
                self._length = len(these) // 2
            else:
                self._busy_since = 0.0
                self._length = min(2 * self._length, LONGEST)
                self._answered = time.monotonic()
                self._sent |= {dispatch: _Sent(job) for dispatch, job in zip(these, jobs, strict=True)}
                dispatches = dispatches[len(these) :]

    def _submit_array(self, dispatches: list[Dispatch]) -> list[Any]:
        tickets = [self.ticket(one, counted=False) for one in dispatches]
        site, what = self.site, dispatches[0].resources
        return submit(self._submitit, self._private, tickets, what, site.options, workers=site.workers)

    def _take_refusal(self, dispatches: list[Dispatch], said: NotTaken) -> None:
        if self._sent or said.crowded:
            # There may have been too many, of this run's or of another's.
            self._note(f"SLURM takes no more jobs at the moment ({said}); they wait until others have ended")
            self._submit_later(dispatches, _REFUSED_S)
            return
        for dispatch in dispatches:
            self.fail(dispatch, _refused(dispatch, said))

    def _wait_while_busy(self, dispatches: list[Dispatch], said: NotTaken) -> None:
        """Submit jobs later, as SLURM has no time for them now; not for ever."""
        wait_s, now = self.site.options.wait_s, time.monotonic()
        self._busy_since = self._busy_since or now
        if now - self._busy_since > wait_s:
            self._busy_since = 0.0
            for dispatch in dispatches:
                self.missing(dispatch, f"SLURM has taken no job for {wait_s:g} s: {said}")
            return
        self._note(f"SLURM takes no job at the moment ({said}); it is asked again, {wait_s:g} s long")
        self._submit_later(dispatches, min(_BUSY_S, wait_s / 4))

    def _submit_later(self, dispatches: list[Dispatch], seconds: float) -> None:
        with self._guard:
            self._waiting.dispatches += dispatches
            self._waiting.since = time.monotonic() + seconds - _GATHER_S

    def _note(self, text: str) -> None:
        """Tell something once."""
        if text not in self._noted:
            self._noted.add(text)
            self.site.notify(f"note: {text}")

    def _take_answers(self) -> None:
        """Settle the dispatches whose jobs have left an answer."""
        unreadable: dict[Dispatch, str] = {}
        for dispatch, sent in list(self._sent.items()):
            # Not by submitit's result(): it asks SLURM's accounting first, which many clusters do not keep.
            try:
                answer = read_answer(sent.job.paths.result_pickle)
            except (OSError, EOFError, pickle.UnpicklingError) as error:
                # A network's disk may come back.
                sent.unreadable = sent.unreadable or time.monotonic()
                if time.monotonic() - sent.unreadable > self.site.options.wait_s:
                    unreadable[dispatch] = f"its answer cannot be read: {getattr(error, 'strerror', '') or error}"
            except Exception as error:
                del self._sent[dispatch]
                self.broken(dispatch, error, log=last_words(sent.job.paths.stderr))
            else:
                sent.unreadable = 0.0
                if answer is not None:
                    del self._sent[dispatch]
                    self._take(dispatch, *answer)
        for dispatch in self._give_up(unreadable):
            self.lost(dispatch, unreadable[dispatch])

    def _take(self, dispatch: Dispatch, succeeded: str, value: Any) -> None:
        """Settle a dispatch by what its job has left."""
        if succeeded != "success":
            self.missing(dispatch, f"its job failed: {(value.strip().splitlines() or ['no words'])[-1][-200:]}")
        elif value in (OUT_OF_TIME, PREEMPTED):
            state = "TIMEOUT" if value == OUT_OF_TIME else "PREEMPTED"
            self._lose(dispatch, slurm_queue.verdict(state, 0, dispatch.resources))
        else:
            self.arrived(dispatch, value)

    def _ask(self) -> None:
        """Settle the dispatches of whose jobs SLURM says that they have ended without an answer, or never begin."""
        rows = slurm_queue.rows(self._sent[dispatch].job.job_id for dispatch in self._sent)
        wait_s, now = self.site.options.wait_s, time.monotonic()
        if rows is None:
            if now - self._answered > wait_s:
                for dispatch in self._give_up(list(self._sent)):
                    self.missing(dispatch, f"SLURM has not answered for {wait_s:g} s")
            return
        self._answered = now
        stuck: dict[Dispatch, slurm_queue.Verdict] = {}
        for dispatch, sent in list(self._sent.items()):
            row = rows.get(sent.job.job_id, slurm_queue.Row("GONE"))
            if row.state in slurm_queue.LIVES:
                sent.ended = 0.0
                if judged := self._watch(dispatch, sent, row, now):
                    stuck[dispatch] = judged
            elif not sent.ended:
                sent.ended = now
            elif now - sent.ended > (_ANSWER_S if row.state in ("COMPLETED", "GONE") else 0.0):
                del self._sent[dispatch]
                judged = slurm_queue.verdict(row.state, row.code, dispatch.resources)
                self._lose(dispatch, judged, last_words(sent.job.paths.stderr) if row.state == "FAILED" else "")
        for dispatch in self._give_up(stuck):
            self._lose(dispatch, stuck[dispatch])

    def _watch(self, dispatch: Dispatch, sent: _Sent, row: slurm_queue.Row, now: float) -> slurm_queue.Verdict | None:
        """Say why a job does not begin; return what is to become of its task where it has not been able to for long."""
        judged = slurm_queue.stuck(row)
        if judged is None:
            sent.stuck = 0.0
            return None
        wait_s = self.site.options.wait_s
        sent.stuck = sent.stuck or now
        self._note(
            f"jobs of {dispatch.job.task.name} cannot begin: {judged.reason}; they are given up after {wait_s:g} s"
        )
        return judged if now - sent.stuck > wait_s else None

    def _lose(self, dispatch: Dispatch, judged: slurm_queue.Verdict, said: str = "") -> None:
        if judged.again:
            self.lost(dispatch, judged.reason, ran_out_of=judged.ran_out_of, preempted=judged.preempted)
        else:
            self.missing(dispatch, f"{judged.reason}{f': {said}' if said else ''}")

    def _give_up(self, dispatches: Iterable[Dispatch]) -> list[Dispatch]:
        """Cancel jobs of which nothing is waited for any more: they would take the place of others."""
        dispatches = list(dispatches)
        _cancel([self._sent.pop(dispatch) for dispatch in dispatches])
        return dispatches


def _cancel(jobs: Iterable[_Sent]) -> None:
    if ids := [sent.job.job_id for sent in jobs]:
        slurm_queue.asked(["scancel", *ids])


def _refused(dispatch: Dispatch, said: NotTaken) -> ConfigError:
    asked = f"{dispatch.resources.memory_gb:g} GB and {dispatch.resources.minutes + WARNED_MIN} min"
    return ConfigError(
        f"SLURM takes no job of {dispatch.job.task.name} with {asked}: {said}",
        cure="see memory_gb, minutes, partition, account and sbatch in [cluster]; 'sinfo' shows what the cluster has",
    )
