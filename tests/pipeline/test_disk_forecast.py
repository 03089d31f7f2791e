"""The disk that a run will want, by what earlier ones wrote."""

import pytest

from hrcneuro.cache.record import Record
from hrcneuro.pipeline.disk_forecast import DiskForecast, expected
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.workdir import Workdir


@pytest.fixture
def workdir(tmp_path):
    return Workdir(tmp_path)


def written(workdir, stage, unit, size, *, key="0" * 16, pointed=True):
    with workdir.cache.workspace(stage, unit, key) as work:
        (work / "a.txt").write_bytes(bytes(size))
        record = workdir.cache.publish(Record(stage, unit, key, {}, {}), work)
    if pointed:
        workdir.point(record)


def would_run(*places):
    return [Item(stage, unit, state=State.WOULD_RUN) for stage, unit in places]


def test_a_task_is_expected_to_write_what_it_wrote_last_and_others_what_their_kind_did(workdir):
    for unit, size in (("s01", 10), ("s02", 20), ("s03", 60)):
        written(workdir, "scale", unit, size)
    written(workdir, "scale", "group", 7)
    assert expected(workdir, would_run(("scale", "s01"))).size == 10
    assert expected(workdir, would_run(("scale", "s09"))).size == 20
    assert expected(workdir, would_run(("scale", "s01"), ("scale", "s09"), ("scale", "group"))).size == 37


def test_what_is_there_wants_nothing_and_what_never_ran_is_named(workdir):
    written(workdir, "scale", "s01", 10)
    fresh = [Item("scale", "s01", state=State.HIT)]
    pictures = Item("total.figures", "group", draws=True, state=State.WOULD_RUN)
    found = expected(workdir, [*fresh, *would_run(("total", "group")), pictures])
    assert (found.tasks, found.size, found.unknown) == (2, 0, ("total",))
    assert "not known before something has run" in str(found)


def test_another_study_s_results_in_the_same_cache_tell_as_well(workdir):
    written(workdir, "scale", "s01", 10, key="1" * 16, pointed=False)
    assert expected(workdir, would_run(("scale", "s02"))).size == 10


def test_a_disk_that_is_too_small_is_told_of_with_what_makes_room():
    room = DiskForecast(tasks=3, size=5 * 10**9, unknown=("erp",), free=10**9)
    assert not room.enough
    assert "5.0 GB will be written" in str(room)
    assert "1.0 GB are free; that is not enough: 'hrcneuro cache gc' and 'hrcneuro cache slim' make room" in str(room)
    assert "nothing has run yet of erp" in str(room)
