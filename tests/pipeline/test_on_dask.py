"""Workers of dask that the run starts on this machine."""

import contextlib
from pathlib import Path

import pytest
from one_job import one_job

from hrcneuro.cache.store import Store
from hrcneuro.config.cluster import ClusterOptions
from hrcneuro.pipeline.cluster import Site
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.job import execute
from hrcneuro.pipeline.resources import Resources

pytest.importorskip("distributed", reason="the extra dask is not installed")


def test_they_are_killed_for_their_memory_no_sooner_than_worker_processes(tmp_path):
    from hrcneuro.pipeline.on_dask import Dask

    site = Site(Path(tmp_path), ClusterOptions(), lambda task: Resources(2.0, 10, 1), workers=1)
    with Dask(site) as dask:
        dask._client.wait_for_workers(1, timeout=60)
        limits = [worker["memory_limit"] for worker in dask._client.scheduler_info()["workers"].values()]
    assert limits == [0]


class Briefly(Resources):
    """No time at all, and then enough on any machine."""

    def doubled(self, what):
        assert what == "time"
        return Resources(2.0, 60, 1)


def test_a_job_that_hangs_is_sent_again_with_more_time_and_its_worker_is_ended(tmp_path):
    from hrcneuro.pipeline.on_dask import Dask

    job = one_job(tmp_path)[0]
    held = Store(job.root).lock(job.task.name, job.task.unit, job.key)
    site = Site(job.root, ClusterOptions(), lambda task: Briefly(2.0, 0, 1), workers=1)
    with contextlib.ExitStack() as lock, Dask(site) as dask:
        # What another process is at, the job waits for.
        lock.enter_context(held)
        dask._client.wait_for_workers(1, timeout=60)
        hung = set(dask._client.scheduler_info()["workers"])
        send, tries = dask.send, []

        def send_and_let_go_at_the_second_try(dispatch):
            tries.append(dispatch.resources.minutes)
            if len(tries) == 2:
                lock.close()
            send(dispatch)

        dask.send = send_and_let_go_at_the_second_try
        done = dask.submit(execute, job).result(timeout=300)
        dask._client.wait_for_workers(1, timeout=60)
        assert not hung & set(dask._client.scheduler_info()["workers"])
    assert (done.state, done.record.key, done.lost) == (State.RAN, job.key, ("its 0 min ran out",))
    assert tries == [0, 60]
