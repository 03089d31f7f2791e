"""What gc takes for unused of what was pulled, in a cache of one study and in a shared one."""

import os

import pytest

from hrcneuro.cache.record import PULLED, Record
from hrcneuro.cache.studies import KEPT_S
from hrcneuro.pipeline import cleaning
from hrcneuro.pipeline.workdir import Workdir

ENTRY = ("scale", "s01", "a" * 16)


def pull(workdir, *, days_ago=0.0):
    """Put an entry into the cache as a pull leaves it."""
    with workdir.cache.workspace(*ENTRY) as work:
        workdir.cache.publish(Record(*ENTRY, {}, {}, {}, {"study": "elsewhere"}), work)
    folder = workdir.cache.folder(*ENTRY)
    (folder / PULLED).touch()
    when = (folder / PULLED).stat().st_mtime - days_ago * KEPT_S
    os.utime(folder / PULLED, (when, when))
    return folder


@pytest.fixture(params=["own", "shared"])
def workdir(request, tmp_path):
    """A study with a cache of its own, or one that others may use as well."""
    folder = tmp_path / "study"
    folder.mkdir()
    return Workdir(folder, tmp_path / "cache" if request.param == "shared" else None)


def is_shared(workdir):
    return workdir.cache.root.parent != workdir.folder


def test_what_was_just_pulled_waits_for_a_run_for_a_day_where_others_share_the_cache(workdir):
    workdir.studies.begin()
    folder = pull(workdir)
    found = cleaning.survey(workdir)
    assert found.unlisted == []
    assert (found.recent, found.doomed) == (([folder], []) if is_shared(workdir) else ([], [folder]))


def test_what_was_pulled_long_ago_may_go(workdir):
    workdir.studies.begin()
    folder = pull(workdir, days_ago=1.1)
    found = cleaning.survey(workdir)
    assert (found.unlisted, found.recent, found.doomed) == ([], [], [folder])


def test_what_was_pulled_before_there_was_a_list_may_be_any_study_s_where_others_share_the_cache(workdir):
    folder = pull(workdir, days_ago=1.1)
    workdir.studies.begin()
    found = cleaning.survey(workdir)
    assert (found.unlisted, found.doomed) == (([folder], []) if is_shared(workdir) else ([], [folder]))
