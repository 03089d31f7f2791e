"""Where jobs run: what becomes of workers that die, are told to end, or are given what cannot travel."""

import concurrent.futures as futures
import contextlib
import os
import signal
import threading
import time
from pathlib import Path

import executor_jobs as jobs
import pytest

from hrcneuro.errors import ConfigError
from hrcneuro.pipeline import executors
from hrcneuro.pipeline.executors import Processes, Serial, WorkerDied
from hrcneuro.pipeline.item import State

PATIENCE_S = 60.0
# An interrupted pool gives its workers 3 s all together; test machines are shared.
TOGETHER_S = 3.0 + 2.0


class Interrupted(BaseException):
    """What comes out of the walk at Ctrl-C, where no other Ctrl-C is mistaken for it."""


@pytest.fixture
def pool():
    with Processes(2) as workers:
        yield workers


def until(condition):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@contextlib.contextmanager
def interrupted_pool(job, folder, workers):
    """Begin a job in each worker; when the block ends, interrupt them, and see that no process is left."""
    pids = []
    try:
        with contextlib.suppress(Interrupted), Processes(workers) as pool:
            for _ in range(workers):
                pool.submit(*job)
            until(lambda: len(list(folder.glob("work-*"))) == workers)
            pids = [int(path.name.rpartition("-")[2]) for path in folder.glob("work-*")]
            yield pool
            raise Interrupted
    finally:
        assert [pid for pid in pids if Path(f"/proc/{pid}").exists()] == []


@pytest.mark.parametrize(
    "fatal",
    [(jobs.kill_itself, 0.1), (jobs.add, jobs.WhenUnpickled(jobs.kill_itself, 0.1), 1)],
    ids=["at-work", "while-it-unpickles-its-job"],
)
def test_a_killed_worker_costs_its_own_job_and_is_replaced(pool, tmp_path, fatal):
    at_work = pool.submit(jobs.wait_for_a_file, tmp_path / "go")
    lost = pool.submit(*fatal)
    later = [pool.submit(jobs.add, n, 1) for n in range(4)]
    with pytest.raises(WorkerDied, match="SIGKILL"):
        lost.result(timeout=PATIENCE_S)
    assert [one.result(timeout=PATIENCE_S) for one in later] == [1, 2, 3, 4]
    (tmp_path / "go").touch()
    assert at_work.result(timeout=PATIENCE_S) != os.getpid()


def test_a_worker_killed_between_two_jobs_costs_nothing():
    with Processes(1) as pool:
        first = pool.submit(jobs.pid).result(timeout=PATIENCE_S)
        os.kill(first, signal.SIGKILL)
        until(lambda: not pool._workers[0].process.is_alive())
        assert pool.submit(jobs.pid).result(timeout=PATIENCE_S) != first


@pytest.mark.parametrize(
    ("job", "error", "words"),
    [
        ((jobs.return_a_lambda,), RuntimeError, "the answer cannot travel between processes"),
        ((jobs.raise_what_cannot_be_unpickled,), TypeError, "NotUnpicklable.* missing 1 required positional argument"),
        ((jobs.add, jobs.WhenUnpickled(int, "one"), 1), ValueError, "'one'"),
        ((lambda: None,), Exception, "(?i)pickle"),
    ],
    ids=["answer-not-pickled", "answer-not-unpickled", "job-not-unpickled", "job-not-pickled"],
)
def test_what_cannot_travel_fails_its_own_job_in_a_worker_that_lives_on(capfd, job, error, words):
    with Processes(1) as pool:
        before = pool.submit(jobs.pid).result(timeout=PATIENCE_S)
        with pytest.raises(error, match=words):
            pool.submit(*job).result(timeout=PATIENCE_S)
        assert pool.submit(jobs.pid).result(timeout=PATIENCE_S) == before
    assert capfd.readouterr().err == ""


def test_no_answer_is_lost_among_many(pool):
    answers = [pool.submit(jobs.add, n, n) for n in range(200)]
    assert not futures.wait(answers, timeout=PATIENCE_S).not_done
    assert [one.result() for one in answers] == [2 * n for n in range(200)]


def test_an_interrupt_unwinds_every_job_and_a_second_signal_does_not_disturb_that(tmp_path, capfd):
    begin = 0.0
    with interrupted_pool((jobs.work_in_a_folder, tmp_path, 0.5), tmp_path, 2) as pool:
        for worker in pool._workers:
            os.kill(worker.process.pid, signal.SIGINT)  # the terminal's: nobody but the parent minds it
        for worker in pool._workers:
            worker.process.terminate()  # the first of two signals; the pool itself sends the second
        until(lambda: len(list(tmp_path.glob("unwinding-*"))) == 2)
        begin = time.monotonic()
    assert time.monotonic() - begin < TOGETHER_S
    assert list(tmp_path.glob("work-*")) == []
    assert capfd.readouterr().err == ""


def test_workers_deep_in_a_call_are_given_up_together(tmp_path):
    begin = 0.0
    with interrupted_pool((jobs.work_deaf_to_sigterm, tmp_path), tmp_path, 3):
        begin = time.monotonic()
    assert time.monotonic() - begin < TOGETHER_S


def test_a_second_interrupt_does_not_wait_for_workers_deep_in_a_call(tmp_path):
    begin = 0.0
    with pytest.raises(KeyboardInterrupt), interrupted_pool((jobs.work_deaf_to_sigterm, tmp_path), tmp_path, 2):
        again = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        again.start()
        begin = time.monotonic()
    assert time.monotonic() - begin < 2.0


def test_jobs_that_wait_when_the_run_is_interrupted_never_begin(tmp_path):
    with interrupted_pool((jobs.work_in_a_folder, tmp_path), tmp_path, 1) as pool:
        waiting = pool.submit(jobs.work_in_a_folder, tmp_path)
    assert waiting.cancelled()
    assert len(list(tmp_path.glob("unwinding-*"))) == 1


def test_a_worker_that_is_told_to_end_does_so_quietly_wherever_it_is(capfd):
    with Processes(1) as workers:
        lost = workers.submit(jobs.end_inside_a_class_body)
        with pytest.raises(WorkerDied, match="exit code 1"):
            lost.result(timeout=PATIENCE_S)
        assert workers.submit(jobs.add, 1, 2).result(timeout=PATIENCE_S) == 3
    assert capfd.readouterr().err == ""


def test_a_serial_job_that_fails_fails_its_future():
    with Serial() as here:
        assert here.submit(jobs.pid).result() == os.getpid()
        assert isinstance(here.submit(int, "one").exception(), ValueError)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (WorkerDied("it was ended by SIGKILL"), "the worker of erp of s01 died: it was ended by SIGKILL"),
        (TypeError("one argument"), "erp of s01 came to no result: TypeError: one argument"),
    ],
)
def test_a_job_that_never_came_back_failed_with_the_cause_and_a_cure(error, words):
    future = futures.Future()
    future.set_exception(error)
    outcome = executors.outcome(future, "erp of s01")
    assert outcome.state is State.FAILED
    assert outcome.error.problem == words
    assert outcome.error.cure


@pytest.mark.parametrize(
    ("name", "workers", "kind"),
    [("auto", 1, Serial), ("auto", 2, Processes), ("serial", 4, Serial), ("processes", 1, Processes)],
)
def test_the_executor_that_is_asked_for_is_made(monkeypatch, name, workers, kind):
    monkeypatch.setattr(executors.job, "one_thread", lambda: None)  # it would hold this process to that too
    with executors.create(name, workers) as made:
        assert isinstance(made, kind)


def test_an_unknown_executor_is_refused_with_what_is_allowed():
    with pytest.raises(ConfigError, match=r"'procesess' \(did you mean 'processes'\?\)") as refused:
        executors.create("procesess", 2)
    assert "auto, serial, processes" in refused.value.cure
