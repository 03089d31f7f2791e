"""The list of the studies that use a cache."""

import json
import os
import shutil
import socket
import subprocess
import sys
from dataclasses import replace

import pytest

from hrcneuro.cache.placed import ID, PlacedStudy, read_id
from hrcneuro.cache.studies import Studies
from hrcneuro.errors import DataError

A, B, C = (("erp", "s01", letter * 16) for letter in "abc")
HERE = PlacedStudy("1d", "/data/study", 7, "lab1")


@pytest.fixture
def studies(tmp_path):
    return Studies(tmp_path / "cache")


@pytest.fixture
def study(tmp_path):
    return PlacedStudy.at(tmp_path, tmp_path / "results")


def listed(studies):
    """Return (entries, whether its run is over) of each file of the list."""
    return sorted((sorted(one.entries), one.over) for one in studies.read())


@pytest.mark.parametrize(
    ("changes", "same"),
    [
        ({}, True),
        ({"host": "lab2"}, True),  # a container whose name is another each time
        ({"inode": 8}, True),  # back from a backup
        ({"id": "2d"}, True),  # its results were deleted
        ({"id": "2d", "former": ("1d",), "inode": 8}, True),
        ({"host": "lab2", "inode": 8}, False),  # a copy at the same path of another machine
        ({"id": "2d", "host": "lab2"}, False),
        ({"id": "2d", "inode": 8}, False),
        ({"folder": "/data/copy"}, False),
        ({"folder": "/data/copy", "inode": 8}, False),
    ],
)
def test_which_study_is_the_same(changes, same):
    other = replace(HERE, **changes)
    assert HERE.same(other) is same
    assert other.same(HERE) is same


def test_a_study_keeps_its_id_and_a_copy_has_it_too(tmp_path, study):
    assert PlacedStudy.at(tmp_path, tmp_path / "results") == study
    assert study.there()
    shutil.copytree(tmp_path / "results", tmp_path / "copy" / "results")
    copy = PlacedStudy.at(tmp_path / "copy", tmp_path / "copy" / "results")
    assert copy.id == study.id
    assert not copy.same(study)
    shutil.rmtree(tmp_path / "results")
    assert not study.there()


def test_what_may_not_be_seen_does_not_pass_for_gone(tmp_path, study):
    if os.geteuid():
        pytest.skip("only root can act as another account")
    tmp_path.chmod(0o700)
    os.seteuid(65534)
    try:
        assert study.there()
    finally:
        os.seteuid(0)


@pytest.mark.parametrize("content", [b"", b"../..\n", b"\xff\xfe"])
def test_an_id_that_is_garbage_is_given_anew(tmp_path, content):
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / ID).write_bytes(content)
    study = PlacedStudy.at(tmp_path, tmp_path / "results")
    assert study.id == read_id(tmp_path / "results") != ""
    assert [p.name for p in (tmp_path / "results").iterdir()] == [ID]


def test_a_run_names_what_it_is_about_to_look_for_until_its_end(studies, study):
    run = studies.open(study, [A])
    studies.claim(run, B)
    assert listed(studies) == [([A, B], False)]
    studies.settle(study, lambda: [B], run)
    assert listed(studies) == [([B], True)]


def test_what_a_run_under_way_claims_survives_the_end_of_another(studies, study):
    first, second = studies.open(study, [A]), studies.open(study, [A])
    studies.claim(second, C)
    studies.settle(study, lambda: [B], first)
    assert listed(studies) == [([A, C], False), ([B], True)]


def test_a_killed_run_counts_as_ended(studies, study, tmp_path):
    """Also one that was killed in the middle of a line."""
    program = (
        "import os, pathlib, sys; from hrcneuro.cache.studies import *; at = pathlib.Path(sys.argv[1])\n"
        "study, studies = PlacedStudy.at(at, at / 'results'), Studies(at / 'cache')\n"
        "run = studies.open(study, [('erp', 's01', 'a' * 16)])\n"
        "run.open('a').write('[\"erp\", \"s0'); os.kill(os.getpid(), 9)\n"
    )
    assert subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=False).returncode == -9
    assert listed(studies) == [([A], True)]
    studies.settle(study, lambda: [B])
    assert listed(studies) == [([B], True)]


def test_a_run_on_another_machine_is_not_over_but_after_long_silence(studies, study):
    run = studies.open(study, [A])
    head, *rows = run.read_text().splitlines()
    run.write_text("\n".join([json.dumps({**json.loads(head), "host": "node17"}), *rows, ""]))
    assert listed(studies) == [([A], False)]
    os.utime(run, (1, 1))
    assert listed(studies) == [([A], True)]


def test_results_that_were_deleted_leave_their_id_known(studies, study, tmp_path):
    studies.settle(study, lambda: [A])
    shutil.rmtree(tmp_path / "results")
    new = PlacedStudy.at(tmp_path, tmp_path / "results")
    studies.settle(new, list)
    (one,) = studies.read()
    assert one.entries == set()
    assert one.study.ids == {study.id, new.id}


def test_a_forgotten_study_points_at_nothing_and_its_id_stays_known(studies, study):
    studies.settle(study, lambda: [A])
    studies.forget(study)
    (one,) = studies.read()
    assert (one.entries, one.forgotten, one.study.id) == (set(), True, study.id)
    studies.settle(study, lambda: [B])
    assert [(one.entries, one.forgotten) for one in studies.read()] == [({B}, False)]


BOMB = "[" * 200_000 + "\n"


@pytest.mark.parametrize("text", ["", "{}\n", "[1]\n", "no json\n", "\xff\n", BOMB])
def test_a_file_that_cannot_be_understood_is_named(studies, study, text):
    run = studies.open(study, [A])
    run.write_text(text, encoding="latin-1")
    with pytest.raises(DataError, match=str(run)) as caught:
        studies.read()
    assert "remove that file" in caught.value.cure


@pytest.mark.parametrize(
    "change",
    [
        {"id": "../../x"}, {"id": 7}, {"former": "ab"}, {"former": ["/x"]}, {"folder": None}, {"folder": "a\0b"},
        {"folder": "\ud800"}, {"process": ["1", ""]}, {"process": 7}, {"over": "no"}, {"inode": []}, {"cache": {}},
    ],
)  # fmt: skip
def test_a_first_line_of_another_shape_is_named(studies, study, change):
    run = studies.open(study, [A])
    run.write_text(json.dumps({**json.loads(run.read_text().splitlines()[0]), **change}) + "\n")
    with pytest.raises(DataError, match="cannot be understood"):
        studies.read()


@pytest.mark.parametrize("at", ["null", '"now"', "1e400", "NaN", "1" * 400])
def test_a_time_that_is_none_is_named(studies, study, at):
    run = studies.open(study, [A])
    with run.open("a") as file:
        file.write(f'["erp", "s01", "{"a" * 16}", {at}]\n')
    with pytest.raises(DataError, match="cannot be understood"):
        studies.read()


def test_a_list_as_large_as_a_disk_is_not_read(studies, study):
    run = studies.open(study, [A])
    os.truncate(run, 2**40)  # of holes
    with pytest.raises(DataError, match="more than"):
        studies.read()


@pytest.mark.parametrize("text", [BOMB, "7\n", '["a"]\n', "\xff\n"])
def test_what_was_there_before_the_list_is_named_where_it_cannot_be_understood(studies, text):
    studies.root.mkdir()
    (studies.root / ".before-the-list").write_text(text, encoding="latin-1")
    with pytest.raises(DataError, match="before-the-list"):
        studies.before()


def test_a_line_that_names_no_entry_is_no_silence(studies, study):
    run = studies.open(study, [A])
    with run.open("a") as file:
        file.write('["erp", 7, "a"]\n')
    with pytest.raises(DataError, match="no entry"):
        studies.read()


def test_a_folder_whose_name_is_no_text_is_kept_as_it_is(studies, tmp_path):
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    study = PlacedStudy.at(folder, folder / "results")
    studies.settle(study, lambda: [A])
    (one,) = studies.read()
    assert one.study == study
    assert one.study.there()
    assert study.host == socket.gethostname()
