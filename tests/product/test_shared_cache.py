"""One cache for several studies: nobody loses what they point at; file systems without locks; odd places."""

import errno
import json
import os
import random
import shutil

import pytest
from shared_cache import Sharers, simulate

LOCKLESS = """
import fcntl, os
def refuse(*_):
    raise OSError({number}, os.strerror({number}))
fcntl.flock = refuse
"""


@pytest.fixture
def shared(hrcneuro, tmp_path):
    """Call a command in ``one`` or ``two`` (simulate with a seed, or words), with one cache for both."""
    (tmp_path / "cache").mkdir()

    def run(name, *words, code=0):
        folder = tmp_path / name
        folder.mkdir(exist_ok=True)
        if not (folder / "cache").is_symlink():
            (folder / "cache").symlink_to(tmp_path / "cache")
        words = simulate(*words, folder) if isinstance(words[0], int) else [*words, "--workdir", folder]
        done = hrcneuro(*words)
        assert done.code == code, done.err
        assert "Traceback" not in done.err
        return done

    return run


def keys(shared, name):
    return {e["key"]: e["used"] for e in shared(name, "cache", "ls", "--json").json["entries"]}


def test_gc_keeps_what_another_study_points_at_and_says_so(shared, tmp_path):
    shared("one", 1)
    shared("two", 2)
    shared("one", 3)
    done = shared("one", "cache", "gc", "--now")
    assert "dropped 1 entries" in done.out
    assert f"kept for the study in {tmp_path / 'two'}: 1 entries" in done.out
    assert sorted(keys(shared, "one").values()) == sorted(keys(shared, "two").values()) == [False, True]
    for name in ("one", "two"):
        shared(name, "path", "simulate", "group", "--last")


def test_gc_refuses_where_somebody_is_missing_from_the_list(shared, tmp_path):
    shared("one", 1)
    shared("two", 2)
    shutil.rmtree(tmp_path / "cache" / ".studies")
    for words in (("cache", "gc", "--dry-run"), ("cache", "gc")):
        done = shared("one", *words, code=2)
        assert "1 of the entries" in done.err
        assert "--unlisted" in done.err
    assert len(keys(shared, "one")) == 2
    # What the message says to do: it enters two in the list.
    shared("two", "cache", "gc")
    shared("one", "cache", "gc")
    assert len(keys(shared, "one")) == 2
    shutil.rmtree(tmp_path / "cache" / ".studies")
    assert len(shared("one", "cache", "gc", "--unlisted", "--json").json["dropped"]) == 1
    assert list(keys(shared, "one").values()) == [True]


def test_a_study_that_is_gone_is_said_kept_for_and_forgotten_on_demand(shared, tmp_path):
    shared("one", 1)
    shared("two", 2)
    (tmp_path / "two").rename(tmp_path / "elsewhere")
    done = shared("one", "cache", "gc")
    assert f"is not seen at {tmp_path / 'two'}" in done.err
    assert f"--forget {tmp_path / 'two'}" in done.err
    shared("elsewhere", 2)
    shared("one", "cache", "gc", "--forget", tmp_path / "two")
    shared("elsewhere", "path", "simulate", "group", "--last")
    assert "--forget" not in shared("one", "cache", "gc").err
    done = shared("one", "cache", "gc", "--forget", tmp_path / "elsewhere", code=2)
    assert "is there" in done.err
    done = shared("one", "cache", "gc", "--forget", tmp_path / "nowhere", code=2)
    assert "no study of" in done.err
    shutil.rmtree(tmp_path / "elsewhere")
    assert len(shared("one", "cache", "gc", "--forget", tmp_path / "elsewhere", "--json").json["dropped"]) == 1


def test_a_copy_keeps_what_it_points_at_when_the_original_moves_on(shared, tmp_path):
    shared("one", 1)
    shutil.copytree(tmp_path / "one", tmp_path / "copy", symlinks=True)
    shared("copy", 1)
    shared("one", 2)
    shared("one", "cache", "gc")
    shared("copy", "path", "simulate", "group", "--last")
    assert len(keys(shared, "copy")) == 2


def test_a_copy_that_has_not_run_yet_has_a_day(shared, tmp_path):
    shared("one", 1)
    shutil.copytree(tmp_path / "one", tmp_path / "copy", symlinks=True)
    shared("one", 2)
    done = shared("one", "cache", "gc")
    assert "dropped 0 entries" in done.out
    assert "kept for a day: 1 entries" in done.out
    shared("copy", "path", "simulate", "group", "--last")
    recent = shared("one", "cache", "gc", "--json").json["recent"]
    (listing,) = (tmp_path / "cache" / ".studies").glob("*.jsonl")
    head, pointed, left = (json.loads(line) for line in listing.read_text().splitlines())
    assert ["/".join(left[:3])] == recent
    # A day later.
    listing.write_text("".join(json.dumps(row) + "\n" for row in (head, pointed, [*left[:3], left[3] - 86401])))
    assert shared("one", "cache", "gc", "--json").json["dropped"] == recent


def test_a_cache_that_a_study_has_for_itself_is_cleaned_at_once(hrcneuro, tmp_path):
    for seed in (1, 2):
        assert hrcneuro(*simulate(seed, tmp_path)).code == 0
    done = hrcneuro("cache", "gc", "--json", "--workdir", tmp_path).json
    assert (len(done["dropped"]), done["recent"]) == (1, [])


@pytest.mark.parametrize("lost", ["removed", "nowhere", "loop", "file"])
def test_gc_drops_nothing_of_a_copy_where_the_list_was_lost(shared, tmp_path, lost):
    """A copy has its original's id: who wrote an entry does not tell who points at it."""
    shared("one", 1)
    shutil.copytree(tmp_path / "one", tmp_path / "copy", symlinks=True)
    shared("copy", 2)
    studies = tmp_path / "cache" / ".studies"
    shutil.rmtree(studies)
    if lost == "file":
        studies.touch()
    elif lost != "removed":
        studies.symlink_to(tmp_path / "nowhere" if lost == "nowhere" else ".studies")
    done = shared("one", "cache", "gc", code=2 if lost == "removed" else 3)
    assert ("before there was a list" if lost == "removed" else "cache/.studies, the list") in done.err
    if lost != "removed":
        studies.unlink()
    assert "before there was a list" in shared("one", "cache", "gc", code=2).err
    shared("copy", "cache", "gc")
    assert shared("one", "cache", "gc", "--json").json["dropped"] == []
    assert list(keys(shared, "copy").values()).count(True) == 1
    assert "before there was a list" not in shared("one", "cache", "gc").err


@pytest.mark.parametrize("kind", ["dangling", "loop", "folder"])
def test_what_is_no_file_in_the_list_is_named_and_waited_for_by_nobody(shared, tmp_path, kind):
    shared("one", 1)
    odd = tmp_path / "cache" / ".studies" / "odd.jsonl"
    if kind == "folder":
        odd.mkdir()
    else:
        odd.symlink_to(odd.name if kind == "loop" else tmp_path / "nowhere")
    assert "cache/.studies/odd.jsonl" in shared("one", "cache", "gc", code=3).err
    shared("one", 2)


def test_a_study_is_the_same_by_whichever_link_it_is_reached(shared, tmp_path):
    shared("one", 1)
    (tmp_path / "link").symlink_to("one")
    shared("link", 2)
    shared("one", 3)
    done = shared("one", "cache", "gc", "--now", "--json").json
    assert (len(done["dropped"]), done["kept"]) == (2, [])


@pytest.mark.parametrize("leads_to", ["results", "nowhere"])
def test_gc_refuses_while_results_cannot_be_read(shared, tmp_path, leads_to):
    """What they point at is not known then: here a link that leads back to itself, or to a disk that is not there."""
    shared("one", 1)
    results = tmp_path / "one" / "results"
    results.rename(tmp_path / "aside")
    results.symlink_to(leads_to)
    shared("one", 1, code=2)
    done = shared("one", "cache", "gc", code=3)
    assert str(results) in done.err
    results.unlink()
    (tmp_path / "aside").rename(results)
    shared("one", "cache", "gc")
    shared("one", "path", "simulate", "group", "--last")


@pytest.mark.parametrize("seed", [11])
def test_in_any_order_of_runs_gc_kill_and_copies_nobody_loses_an_entry(tmp_path, seed):
    """A few of the schedules of ``tests/chaos/shared.py``."""
    sharers = Sharers(tmp_path, random.Random(seed))
    for _ in range(4):
        sharers.step()
        assert sharers.lost() == [], sharers.log


@pytest.mark.parametrize("number", [errno.ENOLCK])
def test_where_file_locks_fail_the_run_goes_on_with_one_warning(hrcneuro, tmp_path, number):
    (tmp_path / "sitecustomize.py").write_text(LOCKLESS.format(number=number))
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    words = [word for word in simulate(1, tmp_path / "work") if word != "-q"]
    done = hrcneuro(*words, env={"PYTHONPATH": path})
    assert done.code == 0, done.err
    assert done.err.count("file locks do not work") == 1
    assert os.strerror(number) in done.err
    assert "file locks" not in hrcneuro(*words, env={"PYTHONPATH": path}).err
    (lock,) = (f"simulate-group-{p.name}.lock" for p in tmp_path.glob("work/cache/simulate/group/*"))
    (tmp_path / "work" / "cache" / ".locks" / lock).write_text("4711\nnode17\n")
    done = hrcneuro(*words, "--force", env={"PYTHONPATH": path, "HRCNEURO_LOCK_WAIT": "2.5"})
    assert done.code == 0, done.err
    assert "process 4711 on node17" in done.err
    assert lock in done.err
    assert list(tmp_path.glob("work/cache/.locks/*")) == []


@pytest.mark.parametrize("given", ["soon", "-1", "inf", "nan"])
def test_a_wait_that_is_no_time_is_refused(hrcneuro, tmp_path, given):
    done = hrcneuro(*simulate(1, tmp_path), env={"HRCNEURO_LOCK_WAIT": given})
    assert done.code == 2
    assert given in done.err


def test_a_tilde_in_the_place_of_the_cache_is_the_home_folder(hrcneuro, tmp_path):
    environment = {"HRCNEURO_CACHE": "~/shared", "HOME": str(tmp_path / "home")}
    done = hrcneuro(*simulate(1, tmp_path / "work"), env=environment)
    assert done.code == 0, done.err
    assert len(list(tmp_path.glob("home/shared/simulate/group/*"))) == 1
