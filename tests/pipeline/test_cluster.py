"""Jobs on other machines: what is lost is sent again, with more of what it ran out of; what stays missing is named."""

import pytest
from one_job import one_job

from hrcneuro.config.cluster import ClusterOptions
from hrcneuro.pipeline import cluster
from hrcneuro.pipeline.cluster import Cluster, Site
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.job import execute
from hrcneuro.pipeline.resources import Resources
from hrcneuro.pipeline.worker import Answer, work


class Engine(Cluster):
    """Loses a job as often as it is told to, then runs it here."""

    def __init__(self, site, *losses):
        super().__init__(site)
        self.losses = list(losses)
        self.allowed = []

    def open(self):
        pass

    def close(self, *, interrupted):
        pass

    def send(self, trip):
        self.allowed.append(trip.resources)
        if self.losses:
            self.lost(trip, **self.losses.pop(0))
        else:
            self.arrived(trip, work(self.ticket(trip, counted=False)))


GONE = {"reason": "its node failed"}
LATE = {"reason": "its 10 min ran out", "ran_out_of": "time"}
FULL = {"reason": "its 2 GB of memory ran out", "ran_out_of": "memory"}
TAKEN = {"reason": "it was preempted", "preempted": True}


@pytest.fixture
def job(tmp_path):
    return one_job(tmp_path)[0]


def outcome(job, *losses, retries=2):
    site = Site(job.root, ClusterOptions(), lambda task: Resources(2.0, 10, retries))
    with Engine(site, *losses) as engine:
        return engine.submit(execute, job).result(timeout=60), engine.allowed


def test_a_lost_job_is_sent_again_and_says_why(job):
    done, allowed = outcome(job, GONE, LATE)
    assert (done.state, done.lost) == (State.RAN, ("its node failed", "its 10 min ran out"))
    assert done.record.key == job.key
    assert [one.minutes for one in allowed] == [10, 10, 20]


def test_what_ran_out_is_doubled_and_nothing_else(job):
    _, allowed = outcome(job, FULL, LATE)
    assert allowed == [Resources(2.0, 10, 2), Resources(4.0, 10, 2), Resources(4.0, 20, 2)]


def test_to_be_preempted_is_no_failure_however_often(job):
    done, _ = outcome(job, *[TAKEN] * 5, retries=0)
    assert (done.state, done.lost) == (State.RAN, ("it was preempted",) * 5)


def test_what_is_lost_too_often_is_named_with_its_causes_and_a_cure(job):
    done, allowed = outcome(job, LATE, GONE, GONE, retries=2)
    assert done.state is State.FAILED
    assert done.error.problem == "acquire of s01 is missing: its 10 min ran out; its node failed, 2 times"
    assert "cluster.stages.acquire.memory_gb" in done.error.cure
    assert len(allowed) == 3


def test_an_answer_without_an_entry_in_the_cache_is_no_result(job, monkeypatch):
    monkeypatch.setattr(cluster, "_SEEN_AFTER_S", 0.0)
    monkeypatch.setitem(globals(), "work", lambda ticket: Answer(State.RAN))
    done, _ = outcome(job)
    assert done.state is State.FAILED
    assert "its entry is not in the cache" in done.error.problem


def test_only_jobs_travel(job):
    site = Site(job.root, ClusterOptions(), lambda task: Resources(2.0, 10, 2))
    with Engine(site) as engine, pytest.raises(TypeError, match="is no job"):
        engine.submit(int, "1")
