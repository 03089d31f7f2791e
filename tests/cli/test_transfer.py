"""What a push or pull says of what became of entries, and its exit code."""

import json

import pytest

from hrcneuro.cache.transfer import Fate, Moved
from hrcneuro.cli.options import Options
from hrcneuro.cli.transfer import _report
from hrcneuro.errors import DataError, StageError

ENTRY = ("scale", "s01", "0" * 16)
KEY = "1" * 16


def report(moved=(), odd=(), **options):
    return _report("cache pull", "pulled", Options(**options), moved, odd)


@pytest.mark.parametrize("stray", ["scale/s01/notes.json", "circle", f"a/b/c/{KEY}.json"])
def test_what_somebody_has_laid_beside_the_records_is_a_note_and_no_failure(capsys, stray):
    assert report([Moved(ENTRY, Fate.MOVED, 10)], [stray]) == 0
    assert f"note: {stray!r}" in capsys.readouterr().err


def test_what_looks_like_a_record_and_is_none_is_refused(capsys):
    assert report([], [f".hidden/s01/{KEY}.json", "notes.txt"]) == DataError.exit_code
    assert "refused: '.hidden" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("moved", "code"),
    [
        (Moved(ENTRY, Fate.REFUSED, error=DataError("a", cure="b")), 3),
        (Moved(ENTRY, Fate.FAILED, error=StageError("a", cure="b")), 1),
        (Moved(ENTRY, Fate.THERE), 0),
    ],
)
def test_the_exit_code_is_that_of_the_worst(capsys, moved, code):
    assert report([moved], json=True) == code
    assert json.loads(capsys.readouterr().out)["ok"] is (code == 0)


def test_what_stays_dropped_is_said_with_what_brings_it_back(capsys):
    assert report([Moved(ENTRY, Fate.SLIM)]) == 0
    out = capsys.readouterr().out
    assert "1 without the files that 'cache slim' has dropped here" in out
    assert "--force" in out
