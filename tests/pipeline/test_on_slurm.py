"""What the executor does where SLURM is busy, refuses, holds jobs, or a disk does not answer; SLURM is scripted."""

import dataclasses
import errno

import pytest
from one_job import one_job
from scripted_slurm import Scripted, leave, until

from hrcneuro.config.cluster import ClusterOptions
from hrcneuro.errors import ConfigError, StageError
from hrcneuro.pipeline import on_slurm, slurm_job
from hrcneuro.pipeline.cluster import Site
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.job import execute
from hrcneuro.pipeline.resources import Resources
from hrcneuro.pipeline.worker import Answer, Ticket, work

pytest.importorskip("submitit", reason="the extra slurm is not installed")
FAILED = Answer(State.FAILED, error=StageError("it has run and failed"))


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    return one_job(tmp_path_factory.mktemp("job"))[0]


@pytest.fixture
def scripted(tmp_path, monkeypatch):
    made = Scripted(tmp_path)
    monkeypatch.setenv("PATH", made.path)
    for name in ("_GATHER_S", "_LOOK_S", "_ASK_S", "_BUSY_S", "_REFUSED_S", "_ANSWER_S"):
        monkeypatch.setattr(on_slurm, name, 0.05)
    return made


@pytest.fixture
def notes():
    return []


@pytest.fixture
def slurm(job, scripted, notes):
    """An executor at work; a test that leaves jobs behind leaves them to nobody."""
    options = ClusterOptions(wait_s=1.0)
    with on_slurm.Slurm(Site(job.root, options, lambda task: Resources(2.0, 10, 1), notify=notes.append)) as engine:
        yield engine


def jobs_of(slurm, number):
    return until(lambda: len(slurm._sent) == number and sorted(sent.job.job_id for sent in slurm._sent.values()))


def settled(future):
    outcome = future.result(timeout=30)
    return outcome.state, outcome.error.problem if outcome.error else ""


def test_a_busy_server_is_asked_again_and_that_is_told(slurm, scripted, notes, job):
    said = "Batch job submission failed: Socket timed out on send/recv operation"
    scripted.says(said)
    future = slurm.submit(execute, job)
    leave(slurm._private, *jobs_of(slurm, 1), FAILED)
    assert settled(future) == (State.FAILED, "it has run and failed")
    assert len(scripted.lengths) == 2
    assert notes == [f"note: SLURM takes no job at the moment ({said}); it is asked again, 1 s long"]


@pytest.mark.parametrize("memory_gb", [1.0, 1.5, 2.3])
def test_memory_is_asked_for_as_sbatch_takes_it(job, scripted, notes, memory_gb):
    site = Site(job.root, ClusterOptions(wait_s=1.0), lambda task: Resources(memory_gb, 10, 1), notify=notes.append)
    with on_slurm.Slurm(site) as engine:
        future = engine.submit(execute, job)
        leave(engine._private, *jobs_of(engine, 1), FAILED)
        assert settled(future) == (State.FAILED, "it has run and failed")


def test_a_server_that_stays_busy_is_given_up_and_its_words_are_told(slurm, scripted, job):
    scripted.says(*["Unable to contact slurm controller (connect failure)"] * 1000)
    state, problem = settled(slurm.submit(execute, job))
    assert state is State.FAILED
    assert "SLURM has taken no job for 1 s: Unable to contact slurm controller" in problem
    assert len(scripted.lengths) > 2
    assert list(slurm._private.glob("*.pkl")) == []


def test_what_slurm_refuses_is_not_tried_again(slurm, scripted, job):
    said = "Memory specification can not be satisfied"
    scripted.says(*[said] * 9)
    futures = [slurm.submit(execute, job) for _ in range(5)]
    for future in futures:
        error = future.result(timeout=30).error
        assert isinstance(error, ConfigError)
        assert error.problem == f"SLURM takes no job of acquire with 2 GB and 12 min: {said}"
    assert scripted.lengths == [5, 2, 1]


def test_where_other_runs_use_up_the_limit_of_jobs_ours_wait_and_that_is_told(slurm, scripted, notes, job):
    said = "QOSMaxSubmitJobPerUserLimit"
    scripted.says(*[said] * 3)
    future = slurm.submit(execute, job)
    leave(slurm._private, *jobs_of(slurm, 1), FAILED)
    assert settled(future) == (State.FAILED, "it has run and failed")
    assert len(scripted.lengths) == 4
    assert notes == [f"note: SLURM takes no more jobs at the moment ({said}); they wait until others have ended"]


def test_an_array_that_is_too_long_goes_in_parts(slurm, scripted, job):
    scripted.takes(2)
    futures = [slurm.submit(execute, job) for _ in range(5)]
    for one in jobs_of(slurm, 5):
        leave(slurm._private, one, FAILED)
    assert {settled(future) for future in futures} == {(State.FAILED, "it has run and failed")}
    taken = [length for length in scripted.lengths if length <= 2]
    assert sum(taken) == 5
    assert len(scripted.lengths) <= 8


def test_one_answer_that_cannot_be_read_costs_its_own_job_alone(slurm, scripted, job, monkeypatch):
    def read(path):
        if path.name.startswith("1_0_"):
            raise OSError(errno.ESTALE, "Stale file handle")
        return slurm_job.read_answer(path)

    monkeypatch.setattr(on_slurm, "read_answer", read)
    scripted.queue(*((f"1_{n}", "RUNNING", 0, "None") for n in range(2)), (2, "RUNNING", 0, "None"))
    futures = [slurm.submit(execute, job) for _ in range(2)]
    bad, good = jobs_of(slurm, 2)
    leave(slurm._private, good, FAILED)
    assert settled(futures[1]) == (State.FAILED, "it has run and failed")
    again = until(lambda: [sent.job.job_id for sent in slurm._sent.values() if sent.job.job_id != bad])[0]
    assert scripted.cancelled == [bad]
    leave(slurm._private, again, FAILED)
    outcome = futures[0].result(timeout=30)
    assert outcome.lost == ("its answer cannot be read: Stale file handle",)
    assert outcome.error.problem == "it has run and failed"


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        ("JobHeldUser", "its job is held (JobHeldUser)"),
        ("BadConstraints", "SLURM cannot start its job (BadConstraints)"),
        ("PartitionTimeLimit", "SLURM cannot start its job (PartitionTimeLimit)"),
    ],
)
def test_a_job_that_cannot_begin_is_told_once_then_given_up_and_cancelled(slurm, scripted, notes, job, reason, words):
    scripted.queue(*((f"1_{n}", "PENDING", 0, reason) for n in range(2)))
    futures = [slurm.submit(execute, job) for _ in range(2)]
    assert {settled(future) for future in futures} == {(State.FAILED, f"acquire of s01 is missing: {words}")}
    assert notes == [f"note: jobs of acquire cannot begin: {words}; they are given up after 1 s"]
    assert sorted(scripted.cancelled) == ["1_0", "1_1"]


def test_a_job_that_waits_for_its_turn_is_waited_for(slurm, scripted, notes, job):
    scripted.queue((1, "PENDING", 0, "Priority"))
    future = slurm.submit(execute, job)
    (one,) = jobs_of(slurm, 1)
    seen = slurm._answered
    until(lambda: slurm._answered > seen + 1.2)
    assert (future.done(), notes, scripted.cancelled) == (False, [], [])
    leave(slurm._private, one, FAILED)
    assert settled(future)[1] == "it has run and failed"


def test_where_slurm_no_longer_answers_jobs_are_named_and_cancelled(slurm, scripted, job):
    scripted.queue((1, "RUNNING", 0, "None"))
    future = slurm.submit(execute, job)
    jobs_of(slurm, 1)
    scripted.is_away()
    assert settled(future) == (State.FAILED, "acquire of s01 is missing: SLURM has not answered for 1 s")
    assert scripted.cancelled == ["1"]


def test_a_cancelled_job_that_had_published_its_result_has_run(slurm, scripted, job):
    scripted.queue((1, "RUNNING", 0, "None"))
    future = slurm.submit(execute, job)
    jobs_of(slurm, 1)
    assert work(Ticket(job, slurm.run)).state is State.RAN
    scripted.queue((1, "CANCELLED", 15, "None"))
    outcome = future.result(timeout=30)
    assert (outcome.state, outcome.record.key, outcome.lost) == (State.RAN, job.key, ())


def test_an_entry_that_is_seen_late_keeps_no_other_job_waiting(slurm, scripted, job):
    late = dataclasses.replace(job, key="0" * 16)
    scripted.queue(*((f"1_{n}", "RUNNING", 0, "None") for n in range(2)))
    futures = [slurm.submit(execute, one) for one in (late, job)]
    first, second = jobs_of(slurm, 2)
    leave(slurm._private, first, Answer(State.RAN))
    until(lambda: slurm._unseen)
    leave(slurm._private, second, FAILED)
    assert settled(futures[1]) == (State.FAILED, "it has run and failed")
    assert not futures[0].done()
    slurm._unseen = {dispatch: (answer, 0.0) for dispatch, (answer, _) in slurm._unseen.items()}
    assert "its entry is not in the cache" in settled(futures[0])[1]


def test_of_an_answer_that_means_nothing_here_the_last_words_of_the_job_s_log_are_told(slurm, scripted, job):
    future = slurm.submit(execute, job)
    (one,) = jobs_of(slurm, 1)
    (slurm._private / f"{one}_0_log.err").write_text("Traceback\nImportError: libmkl.so.2\nsrun: error: exit code 1\n")
    (slurm._private / f"{one}_0_result.pkl").write_bytes(b"cos\nno_such_name\n.")
    problem = settled(future)[1]
    assert "acquire of s01 came to no result on a worker: AttributeError" in problem
    assert problem.endswith("its log ends with: ImportError: libmkl.so.2")
