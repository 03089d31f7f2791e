"""When a job on a dask worker is late: its time begins with the mark of the worker that begins it, not in the queue."""

from types import SimpleNamespace

import pytest
from one_job import one_job

from hrcneuro.pipeline import dask_deadlines
from hrcneuro.pipeline.cluster import Dispatch
from hrcneuro.pipeline.dask_deadlines import Deadlines
from hrcneuro.pipeline.resources import Resources
from hrcneuro.pipeline.worker import begun_as

FIRST, SECOND = "tcp://a:1", "tcp://b:1"


class Look:
    """One job of ten minutes under way, a clock, and who is late."""

    def __init__(self, folder, job):
        self.folder, self.minute, self.marks = folder, 0.0, 0
        self.dispatch = Dispatch(job, Resources(2.0, 10, 2))
        self.deadlines = Deadlines()

    def begin(self):
        self.marks += 1
        (self.folder / f"{begun_as(self.dispatch.job)}.begun-{self.marks}").touch()

    def late(self, minute, worker):
        self.minute = minute
        found = self.deadlines.over(self.folder, {self.dispatch: SimpleNamespace(key="k")}, {"k": worker})
        return list(found.values())


@pytest.fixture
def look(tmp_path, monkeypatch):
    made = Look(tmp_path, one_job(tmp_path)[0])
    monkeypatch.setattr(dask_deadlines, "time", SimpleNamespace(monotonic=lambda: 60.0 * made.minute))
    return made


def test_what_waits_at_a_worker_is_never_late(look):
    assert [look.late(minute, FIRST) for minute in (1, 99)] == [[], []]


def test_the_time_counts_from_the_mark_and_names_the_worker_once(look):
    assert look.late(50, FIRST) == []
    look.begin()
    assert [look.late(minute, FIRST) for minute in (51, 61, 61.1, 99)] == [[], [], [FIRST], []]


def test_a_mark_that_comes_before_dask_says_where_it_is_counts_from_then(look):
    look.begin()
    assert [look.late(minute, worker) for minute, worker in ((0, ""), (5, FIRST), (15, FIRST))] == [[], [], []]
    assert look.late(16, FIRST) == [FIRST]


def test_a_job_that_dask_moved_begins_anew_and_costs_its_next_worker_nothing(look):
    look.begin()
    assert look.late(1, FIRST) == []
    assert look.late(30, SECOND) == []
    look.begin()
    assert [look.late(minute, SECOND) for minute in (31, 41, 42)] == [[], [], [SECOND]]
