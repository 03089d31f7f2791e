"""Workers of dask that the run starts on this machine."""

from pathlib import Path

import pytest

from hrcneuro.config.cluster import ClusterOptions
from hrcneuro.pipeline.cluster import Site
from hrcneuro.pipeline.resources import Resources

pytest.importorskip("distributed", reason="the extra dask is not installed")


def test_they_are_killed_for_their_memory_no_sooner_than_worker_processes(tmp_path):
    from hrcneuro.pipeline.on_dask import Dask

    site = Site(Path(tmp_path), ClusterOptions(), lambda task: Resources(2.0, 10, 1), workers=1)
    with Dask(site) as dask:
        dask._client.wait_for_workers(1, timeout=60)
        limits = [worker["memory_limit"] for worker in dask._client.scheduler_info()["workers"].values()]
    assert limits == [0]
