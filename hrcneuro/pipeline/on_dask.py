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
from hrcneuro.pipeline.cluster import Cluster, Site, Trip
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
        self._sent: dict[Trip, Any] = {}
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
                )
            try:
                self._client = self._distributed.Client(
                    address or self._cluster, timeout=_CONNECT_S, set_as_default=False
                )
            except (OSError, ValueError, TimeoutError) as error:
                raise ConfigError(
                    f"no dask scheduler answers at {address!r}: {str(error) or type(error).__name__}",
                    cure="start one, 'dask scheduler', then workers, 'dask worker ADDRESS'; or leave out "
                    "cluster.scheduler for workers on this machine",
                ) from error
            threading.Thread(target=self._look_after, name="dask", daemon=True).start()

    def send(self, trip: Trip) -> None:
        """Give a job to the scheduler."""
        job = trip.job
        # The tries stand in the name: the scheduler takes an old name for an old answer.
        name = f"{job.task.name}-{job.task.unit}-{job.key}-{self.run}-{trip.tries}"
        try:
            sent = self._client.submit(work, self.ticket(trip, counted=True), key=name, pure=False, retries=0)
        except Exception as error:
            self.broken(trip, error)
            return
        self._sent[trip] = sent
        sent.add_done_callback(lambda done: self._ended_there(trip, done))

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

    def _ended_there(self, trip: Trip, done: Any) -> None:
        """Say what became of a job; called in a thread of dask's."""
        try:
            if done.status == "finished":
                self.arrived(trip, done.result())
            elif done.status == "error":
                error = done.exception()
                if isinstance(error, self._distributed.KilledWorker):
                    self.lost(trip, "its worker was lost")
                else:
                    self.broken(trip, error)
            elif not self._ended.is_set():
                self.missing(trip, "the dask scheduler dropped it")
        except Exception as error:
            self.broken(trip, error)
        finally:
            if self._sent.get(trip) is done:
                self._sent.pop(trip, None)

    def _look_after(self) -> None:
        """End the wait for a scheduler that has had no worker for long, or is gone itself."""
        wait_s, seen = self.site.options.wait_s, time.monotonic()
        told = False
        while not self._ended.wait(_LOOK_S):
            if self._workers() or not self.under_way:
                seen, told = time.monotonic(), False
            elif time.monotonic() - seen > wait_s:
                for trip in list(self.under_way):
                    self.missing(trip, f"the dask scheduler has had no worker for {wait_s:g} s")
            elif not told and time.monotonic() - seen > 2 * _LOOK_S:
                self.site.tell(f"note: the dask scheduler has no worker; it is waited for, {wait_s:g} s")
                told = True

    def _workers(self) -> int:
        try:
            return len(self._client.nthreads()) if self._client.status == "running" else 0
        except Exception:
            return 0


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
