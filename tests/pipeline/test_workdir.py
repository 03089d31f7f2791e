"""What a study's results point at, also where a pointer is garbage."""

import pytest

from hrcneuro.cache.record import Record
from hrcneuro.pipeline.workdir import Workdir

ENTRY, OTHER, STRANGER = (("erp", unit, letter * 16) for unit, letter in (("s01", "a"), ("s01", "b"), ("s02", "c")))
GARBAGE = [
    "",
    "{",
    "[]",
    "7",
    "\xff",
    "[" * 100_000,
    '{"key": 5}',
    '{"key": "../.."}',
    '{"key": "12"}',
    f'{{"key": "{"a" * 15}"}}',
]


@pytest.fixture
def workdir(tmp_path):
    """A study that points at ENTRY, with a cache that has all three."""
    workdir = Workdir(tmp_path)
    for entry in (ENTRY, OTHER, STRANGER):
        workdir.cache.folder(*entry).mkdir(parents=True)
    workdir.point(Record(*ENTRY, parts={}, outputs={}))
    return workdir


def test_a_pointer_points_at_its_entry_alone(workdir):
    assert workdir.keys() == {ENTRY}
    assert workdir.unclear() == {}


@pytest.mark.parametrize("text", GARBAGE, ids=lambda text: text[:20])
def test_a_garbage_pointer_may_point_at_all_that_it_could(workdir, text):
    pointer = workdir.results / "s01" / "erp.json"
    pointer.write_text(text, encoding="latin-1")
    assert workdir.pointer("erp", "s01") == ""
    assert workdir.keys() == {ENTRY, OTHER}
    assert workdir.unclear() == {pointer: {ENTRY, OTHER}}
    workdir.point(Record(*ENTRY, parts={}, outputs={}))
    assert workdir.keys() == {ENTRY}


def test_a_file_of_somebody_else_beside_the_pointers_points_at_nothing(workdir):
    (workdir.results / "s01" / "notes.json").write_text("[]")
    assert workdir.keys() == {ENTRY}
    assert workdir.unclear() == {}
