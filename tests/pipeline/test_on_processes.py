"""Jobs in worker processes: one whose worker dies is run again, as often as it may be, and nothing finished is."""

import dataclasses

import pytest
from one_job import one_job

from hrcneuro.pipeline import executors
from hrcneuro.pipeline.executors import Processes, WorkerDied
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.job import execute
from hrcneuro.pipeline.on_processes import LocalJobs

KILLED = "it was ended by SIGKILL"
LOST = f"its worker died: {KILLED}"


@pytest.fixture
def job(tmp_path):
    return one_job(tmp_path)[0]


@pytest.fixture
def deaths(monkeypatch):
    """Return a list of what happens to the next workers at their job: a function of it, and then their death."""
    coming = []

    def run(pool, call, job):
        if not coming:
            return call(job)
        coming.pop(0)(job)
        raise WorkerDied(KILLED)

    monkeypatch.setattr(Processes, "_run", run)
    return coming


def outcome(job, *, retries):
    with LocalJobs(1, lambda task: {"acquire": retries}[task.name]) as workers:
        return executors.outcome(workers.submit(execute, job), "acquire of s01")


def test_a_job_whose_worker_died_is_run_again_and_says_why_each_time(job, deaths):
    deaths += [lambda job: None] * 2
    done = outcome(job, retries=2)
    assert (done.state, done.record.key, done.lost) == (State.RAN, job.key, (LOST,) * 2)


def test_a_job_that_kills_each_of_its_workers_fails_with_the_number_of_them_and_a_cure(job, deaths):
    deaths += [lambda job: None] * 9
    done = outcome(job, retries=2)
    assert (done.state, done.lost) == (State.FAILED, (LOST,) * 3)
    assert done.error.problem == f"the worker of acquire of s01 died: {KILLED}, 3 times"
    assert "use fewer workers (-j 1)" in done.error.cure
    assert len(deaths) == 6


def test_without_retries_the_first_death_is_the_last(job, deaths):
    deaths.append(lambda job: None)
    done = outcome(job, retries=0)
    assert done.error.problem == f"the worker of acquire of s01 died: {KILLED}"


def test_what_was_published_before_its_worker_died_has_run_and_is_not_run_again(job, deaths):
    deaths += [execute, lambda job: pytest.fail("it was run again")]
    done = outcome(job, retries=2)
    assert (done.state, done.record.key, done.lost) == (State.RAN, job.key, ())
    assert len(deaths) == 1


def test_a_forced_job_is_run_again_though_its_key_has_an_entry(job, deaths):
    assert execute(job).state is State.RAN
    deaths.append(lambda job: None)
    done = outcome(dataclasses.replace(job, force=True), retries=1)
    assert (done.state, done.lost) == (State.RAN, (LOST,))


def test_a_worker_that_the_end_of_the_run_ended_is_not_replaced(job, deaths):
    with LocalJobs(1, lambda task: 9) as workers:

        def close(job):
            workers._closed = True

        deaths += [close, lambda job: pytest.fail("it was run again")]
        with pytest.raises(WorkerDied):
            workers.submit(execute, job).result(timeout=60)


def test_only_jobs_are_run(job):
    with LocalJobs(1, lambda task: 0) as workers, pytest.raises(TypeError, match="is no job"):
        workers.submit(int, "1").result(timeout=60)
