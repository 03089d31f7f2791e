"""What a worker on another machine does: it computes only where it stands as the run does."""

import dataclasses
import os
import pickle
import re
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from one_job import one_job

from hrcneuro.cache import transfer
from hrcneuro.cache.bucket import Bucket
from hrcneuro.cache.disk import remove
from hrcneuro.cache.store import Store
from hrcneuro.pipeline import worker
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.keys import PACKAGE
from hrcneuro.pipeline.worker import Ticket, run_folder, work


@pytest.fixture
def job(tmp_path):
    return one_job(tmp_path)[0]


@pytest.fixture
def run(job):
    with run_folder(job.root, "aa") as folder:
        yield folder


def record(job):
    return Store(job.root).lookup(job.task.name, job.task.unit, job.key)


def test_a_worker_publishes_and_its_answer_and_ticket_are_small(job, run):
    ticket = Ticket(job, run.name)
    answer = work(ticket)
    assert (answer.state, answer.begun, answer.error) == (State.RAN, 1, None)
    assert record(job).key == job.key
    assert len(pickle.dumps(answer)) < 1_000
    assert len(pickle.dumps(ticket)) < 100_000
    assert work(ticket).state is State.HIT


def test_a_worker_reads_through_the_second_cache_and_tells_what_was_wrong_there(job, run, tmp_path):
    pytest.importorskip("fsspec", reason="the extra remote is not installed")
    store, bucket = Store(job.root), Bucket(str(tmp_path / "bucket"))
    entry = (job.task.name, job.task.unit, job.key)
    assert work(Ticket(job, run.name)).state is State.RAN
    assert [one.error for one in transfer.push(store, bucket, [entry])] == [None]
    reading = Ticket(dataclasses.replace(job, second_cache=bucket.url), run.name)
    remove(store.folder(*entry))
    answer = work(reading)
    assert (answer.state, answer.pulled, answer.told) == (State.HIT, True, ())
    for file in (p for p in (tmp_path / "bucket" / "files").rglob("*") if p.is_file()):
        file.write_bytes(b"x" * file.stat().st_size)
    remove(store.folder(*entry))
    answer = work(reading)
    assert (answer.state, answer.pulled) == (State.RAN, False)
    assert "has changed" in " ".join(answer.told)


def test_without_the_run_s_file_nothing_is_computed(job, tmp_path):
    answer = work(Ticket(job, "another"))
    assert "a worker does not see the run's file in the cache" in answer.error.problem
    assert "the same cache under the same path" in answer.error.cure
    assert answer.state is State.FAILED
    assert record(job) is None


@pytest.mark.parametrize(
    ("part", "name", "value", "words"),
    [
        ("libs", "numpy", "1.0", r"libs: numpy 1\.0 -> [\d.]+"),
        ("libs", "python", "3.99", r"libs: python 3\.99 -> [\d.]+"),
        ("code", "hrcneuro.stages.acquire", "0" * 64, r"code: hrcneuro\.stages\.acquire"),
    ],
)
def test_another_installation_than_the_key_s_is_named_and_computes_nothing(job, run, part, name, value, words):
    parts = {**job.parts, part: {**job.parts[part], name: value}}
    answer = work(Ticket(dataclasses.replace(job, parts=parts), run.name))
    assert re.fullmatch(f"a worker's installation differs from that of the run: {words}", answer.error.problem)
    assert record(job) is None


def test_a_worker_that_has_loaded_older_code_computes_nothing(job, run, monkeypatch):
    first = dict(worker._stamps())
    monkeypatch.setattr(worker, "_first_stamps", lambda: first)
    first[str(PACKAGE / "cli" / "app.py")] = (1, 1)
    first[str(PACKAGE / "eeg" / "synthetic" / "__init__.py")] = (1, 1)
    answer = work(Ticket(job, run.name))
    assert "has changed since a worker began (hrcneuro.eeg.synthetic); it would" in answer.error.problem
    assert answer.error.cure == "start the workers anew"
    assert record(job) is None


def test_a_job_that_has_cost_too_many_workers_is_not_begun(job, run):
    for _ in range(2):
        worker._begin(Ticket(job, run.name))  # and then the worker was gone
    answer = work(Ticket(job, run.name, tries=2))
    assert (answer.state, answer.given_up, answer.begun) == (State.FAILED, True, 2)
    assert record(job) is None
    assert work(Ticket(job, run.name)).begun == 4


def test_workers_that_begin_at_once_are_all_counted(job, run):
    with ThreadPoolExecutor(8) as threads:
        counts = list(threads.map(worker._begin, [Ticket(job, run.name)] * 40))
    assert sorted(counts) == list(range(1, 41))


def test_a_run_s_folder_is_gone_after_it(job):
    with run_folder(job.root, "bb") as folder:
        assert [path.name for path in folder.iterdir()] == [worker.MARK]
    assert not folder.exists()
    assert Store(job.root).entries() == []


def test_what_a_killed_run_has_left_is_kept_while_its_jobs_may_run_and_then_removed(job):
    runs = job.root / worker.RUNS
    for name, days in (("old", 31), ("young", 3)):
        (runs / name).mkdir(parents=True)
        when = time.time() - days * 86400
        os.utime(runs / name, (when, when))
    with run_folder(job.root, "cc"):
        assert sorted(path.name for path in runs.iterdir()) == ["cc", "young"]
