"""Jobs on the workers of a dask scheduler: one that runs already, by its address, or workers on this machine."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import threading
import time
from collections.abc import Iterator
from multiprocessing import resource_tracker
from typing import Any

from hrcneuro.errors import ConfigError
from hrcneuro.pipeline.cluster import Cluster, Dispatch, Site
from hrcneuro.pipeline.dask_deadlines import Deadlines, end_workers, places
from hrcneuro.pipeline.worker import work

_CONNECT_S = 5.0
_LOOK_S = 1.0


class Dask(Cluster):
    """Sends jobs to a dask scheduler.

    A worker that dies costs the scheduler nothing: it gives the job to another one and does not say so. So whoever
    begins a job leaves a mark in the run's folder, and does not begin one that has cost too many workers already.
    """

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        try:
            import distributed
        except ModuleNotFoundError as error:
            raise ConfigError(
                f"--executor dask needs {error.name}, which is not installed", cure="pip install 'hrcneuro[dask]'"
            ) from error
        self._distributed = distributed
        # What dask tells of its connections speaks to programmers; of what is lost the run tells itself.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        self._client: Any = None
        self._cluster: Any = None
        self._sent: dict[Dispatch, Any] = {}
        self._guard = threading.Lock()
        self._deadlines = Deadlines()
        self._ended = threading.Event()

    def open(self) -> None:
        """Connect with the scheduler; start one with workers on this machine where none is named.

        Raises:
            ConfigError: It does not answer.
        """
        address = self.site.options.scheduler
        with _threads_without_interrupts():
            if not address:
                self._cluster = self._distributed.LocalCluster(
                    n_workers=max(1, self.site.workers),
                    threads_per_worker=1,
                    dashboard_address=None,
                    silence_logs=logging.CRITICAL,
                    # dask would share the machine's memory out, and kill what runs with --executor processes.
                    memory_limit=0,
                )
            try:
                self._client = _client(self._distributed, address or self._cluster)
            except Exception as error:
                # Of many kinds: dask leaves open what it raises of an address, a certificate or another version.
                if not address:
                    raise
                raise ConfigError(
                    f"no dask scheduler answers at {address!r}: {str(error) or type(error).__name__}",
                    cure="give its address with the port, as tcp://head:8786; start one, 'dask scheduler', then "
                    "workers, 'dask worker ADDRESS'; or leave out cluster.scheduler for workers on this machine",
                ) from error
            threading.Thread(target=self._look_after, name="dask", daemon=True).start()

    def send(self, dispatch: Dispatch) -> None:
        """Give a job to the scheduler."""
        job = dispatch.job
        # The tries stand in the name: the scheduler takes an old name for an old answer.
        name = f"{job.task.name}-{job.task.unit}-{job.key}-{self.run}-{dispatch.tries}"
        try:
            sent = self._client.submit(work, self.ticket(dispatch, counted=True), key=name, pure=False, retries=0)
        except Exception as error:
            self.broken(dispatch, error)
            return
        self._sent[dispatch] = sent
        sent.add_done_callback(lambda done: self._ended_there(dispatch, done))

    def close(self, *, interrupted: bool) -> None:
        """Leave the scheduler; what is under way there and cannot be stopped comes to its end in the cache."""
        self._ended.set()
        with contextlib.suppress(Exception):
            if interrupted and self._sent:
                self._client.cancel(list(self._sent.values()), force=True)
        if interrupted and self._cluster is not None:
            self._kill_workers()
        for one in (self._client, self._cluster):
            with contextlib.suppress(Exception):
                if one is not None:
                    one.close(timeout=3.0)

    def _kill_workers(self) -> None:
        """End the workers on this machine at once: what they leave half-written is swept after the run."""
        for nanny in self._cluster.workers.values():
            nanny.auto_restart = False
            with contextlib.suppress(OSError, TypeError):
                os.kill(nanny.pid, signal.SIGKILL)

    def _ended_there(self, dispatch: Dispatch, done: Any) -> None:
        """Say what became of a job; called in a thread of dask's."""
        if not self._take(dispatch, done):
            return
        try:
            if done.status == "finished":
                self.arrived(dispatch, done.result())
            elif done.status == "error":
                error = done.exception()
                if isinstance(error, self._distributed.KilledWorker):
                    self.lost(dispatch, "its worker was lost")
                else:
                    self.broken(dispatch, error)
            elif not self._ended.is_set():
                self.missing(dispatch, "the dask scheduler dropped it")
        except Exception as error:
            self.broken(dispatch, error)

    def _take(self, dispatch: Dispatch, sent: Any) -> bool:
        """Take a job out of what is under way; return whether nobody else has: it is settled or sent again once."""
        with self._guard:
            mine = self._sent.get(dispatch) is sent
            if mine:
                del self._sent[dispatch]
            return mine

    def _end_late(self) -> None:
        """Send jobs again whose time ran out, once the workers that hang in them are ended."""
        sent = dict(self._sent)
        try:
            late = self._deadlines.over(self.folder, sent, places(self._client)) if sent else {}
        except Exception:
            # A scheduler that does not answer is looked after elsewhere.
            return
        mine = {dispatch: worker for dispatch, worker in late.items() if self._take(dispatch, sent[dispatch])}
        if not mine:
            return
        with contextlib.suppress(Exception):
            # First: else the scheduler gives them to other workers by itself, with no more time.
            self._client.cancel([sent[dispatch] for dispatch in mine], force=True)
        end_workers(self._client, set(mine.values()), self.site.options.wait_s)
        for dispatch in mine:
            self.lost(dispatch, f"its {dispatch.resources.minutes} min ran out", ran_out_of="time")

    def _look_after(self) -> None:
        """Look for late entries; end the wait for a scheduler that has had no worker for long, or is gone itself."""
        wait_s, seen = self.site.options.wait_s, time.monotonic()
        noted = False
        while not self._ended.wait(_LOOK_S):
            self.look_for_entries()
            self._end_late()
            if self._workers() or not self.under_way:
                seen, noted = time.monotonic(), False
            elif time.monotonic() - seen > wait_s:
                for dispatch in list(self.under_way):
                    self.missing(dispatch, f"the dask scheduler has had no worker for {wait_s:g} s")
            elif not noted and time.monotonic() - seen > 2 * _LOOK_S:
                self.site.notify(f"note: the dask scheduler has no worker; it is waited for, {wait_s:g} s")
                noted = True

    def _workers(self) -> int:
        try:
            return len(self._client.nthreads()) if self._client.status == "running" else 0
        except Exception:
            return 0


def _client(distributed: Any, where: Any) -> Any:
    """Return a client that is connected with a scheduler, or nothing: half of one would speak up when Python ends."""

    class Whole(distributed.Client):
        def start(self, **how: Any) -> None:
            try:
                super().start(**how)
            except BaseException:
                with contextlib.suppress(Exception):
                    self.close(timeout=_CONNECT_S)
                raise

    return Whole(where, timeout=_CONNECT_S, set_as_default=False)


@contextlib.contextmanager
def _threads_without_interrupts() -> Iterator[None]:
    # Threads hand their mask on to the processes that they start: a key reaches the whole terminal, and workers must
    # not die of it before the run has said what becomes of their jobs.
    # The resource tracker unblocks the interrupt in the thread that starts it.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGQUIT))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
