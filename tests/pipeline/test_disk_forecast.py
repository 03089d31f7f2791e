"""The disk that a run will want, by what earlier ones wrote."""

import pytest

from hrcneuro.cache.record import Record
from hrcneuro.config import settings as config
from hrcneuro.pipeline.disk_forecast import DiskForecast, expected
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.workdir import Workdir


@pytest.fixture
def workdir(tmp_path):
    return Workdir(tmp_path)


@pytest.fixture
def settings(tmp_path):
    return config.load(None, [], folder=tmp_path)


def written(workdir, stage, unit, size, *, key="0" * 16, pointed=True):
    with workdir.cache.workspace(stage, unit, key) as work:
        (work / "a.txt").write_bytes(bytes(size))
        record = workdir.cache.publish(Record(stage, unit, key, {}, {}), work)
    if pointed:
        workdir.point(record)


def would_run(*places):
    return [Item(stage, unit, state=State.WOULD_RUN) for stage, unit in places]


def test_a_task_is_expected_to_write_what_it_wrote_last_and_others_what_their_kind_did(workdir, settings):
    for unit, size in (("s01", 10), ("s02", 20), ("s03", 60)):
        written(workdir, "scale", unit, size)
    written(workdir, "scale", "group", 7)
    assert expected(workdir, would_run(("scale", "s01")), settings).size == 10
    assert expected(workdir, would_run(("scale", "s09")), settings).size == 20
    assert expected(workdir, would_run(("scale", "s01"), ("scale", "s09"), ("scale", "group")), settings).size == 37


def test_what_is_there_wants_nothing_and_what_never_ran_is_named(workdir, settings):
    written(workdir, "scale", "s01", 10)
    fresh = [Item("scale", "s01", state=State.HIT)]
    found = expected(workdir, [*fresh, *would_run(("total", "group"))], settings)
    assert (found.tasks, found.size, found.unknown) == (1, 0, ("total",))
    assert "not known before something has run" in str(found)


def test_another_study_s_results_in_the_same_cache_tell_as_well(workdir, settings):
    written(workdir, "scale", "s01", 10, key="1" * 16, pointed=False)
    assert expected(workdir, would_run(("scale", "s02")), settings).size == 10


def test_before_the_first_run_a_subject_of_the_paper_s_size_is_estimated(workdir, settings):
    """About 0.65 GB from raw to decoded, and 40 MB of the arm."""
    chain = ("acquire", "preprocess", "epoch", "erp", "ersp", "decode")
    found = expected(workdir, would_run(*((stage, "s01") for stage in chain)), settings)
    assert 0.55e9 < found.size < 0.75e9
    assert (found.estimated, found.unknown, found.enough) == (found.size, (), found.size <= found.free)
    assert "an estimate by the length of a session" in str(found)


def test_pictures_count_by_what_was_drawn_else_by_their_stage(workdir, settings):
    def drawn(stage, unit):
        return Item(f"{stage}.figures", unit, draws=True, state=State.WOULD_RUN)

    for stage, unit, least in (
        ("erp", "s01", 2e6),
        ("erp", "group", 6e6),
        ("cases", "group", 2e6),
        ("new", "s01", 1e5),
    ):
        found = expected(workdir, [drawn(stage, unit)], settings)
        assert least < found.size == found.estimated < 1e7
        assert found.unknown == ()
    written(workdir, "erp.figures", "s02", 30)
    found = expected(workdir, [drawn("erp", "s01")], settings)
    assert (found.size, found.estimated) == (30, 0)


def test_a_shorter_session_and_a_lower_rate_want_less(workdir, settings, tmp_path):
    short = config.load(None, ["acquire.session.blocks=2", "acquire.sfreq=250"], folder=tmp_path)
    for stage in ("acquire", "preprocess", "epoch"):
        whole, part = (expected(workdir, would_run((stage, "s01")), one).size for one in (settings, short))
        assert part < whole / 4


def test_what_has_run_counts_before_what_is_estimated(workdir, settings):
    written(workdir, "acquire", "s01", 10)
    found = expected(workdir, would_run(("acquire", "s01"), ("epoch", "s01")), settings)
    assert found.size - found.estimated == 10
    assert "by what earlier runs wrote; " in str(found)
    assert "of it are an estimate" in str(found)


def test_whether_it_is_enough_is_not_known_while_a_stage_is_unknown():
    room = DiskForecast(tasks=3, size=10, estimated=0, unknown=("erp",), free=10**9)
    assert room.enough is None
    assert "nothing has run yet of erp: whether that is enough is not known" in str(room)
    assert DiskForecast(tasks=3, size=10, estimated=0, unknown=(), free=10**9).enough is True


def test_a_disk_that_is_too_small_is_told_of_with_what_makes_room():
    room = DiskForecast(tasks=3, size=5 * 10**9, estimated=0, unknown=("erp",), free=10**9)
    assert room.enough is False
    assert "5.0 GB will be written" in str(room)
    assert "1.0 GB are free; that is not enough: 'hrcneuro cache gc' and 'hrcneuro cache slim' make room" in str(room)
