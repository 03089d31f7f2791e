import concurrent.futures as futures
import errno
import json
import os
import threading

import pytest
from filelock import FileLock

from hrcneuro.cache.disk import explain_os_error
from hrcneuro.cache.holder import Holder
from hrcneuro.cache.locks import PATIENCE_S
from hrcneuro.cache.record import RECORD, Record
from hrcneuro.cache.store import Store
from hrcneuro.errors import ConfigError, DataError, StageError

NAME = ("preprocess", "s01", "0123456789abcdef")


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "cache")


def publish(store, content=b"signal", name=NAME):
    with store.lock(*name), store.workspace(*name) as work:
        (work / "data.bin").write_bytes(content)
        (work / "deep").mkdir()
        (work / "deep" / "more.txt").write_text("more")
        return store.publish(Record(*name, parts={"params": {"a": 1}}, outputs={}, summary={"n": 3}), work)


def test_a_published_entry_is_found_with_its_summary_and_files(store):
    publish(store)
    record = store.lookup(*NAME, verify=True)
    assert record.summary == {"n": 3}
    assert sorted(record.outputs) == ["data.bin", "deep/more.txt"]
    assert store.entries() == [store.folder(*NAME)]


def test_what_has_no_key_for_a_name_is_no_entry(store):
    """A recording that somebody had put into the cache, say: gc drops entries alone."""
    publish(store)
    (store.root / "recordings" / "s01" / "2026-11-29T142501").mkdir(parents=True)
    assert store.entries() == [store.folder(*NAME)]


def test_nothing_is_visible_before_publish_and_nothing_stays_after_a_failure(store):
    with pytest.raises(RuntimeError, match="stopped"), store.workspace(*NAME) as work:
        (work / "half").write_text("half")
        assert store.entries() == []
        raise RuntimeError("stopped")
    assert store.leftovers() == []


@pytest.mark.parametrize(
    ("damage", "word"),
    [
        (lambda f: (f / RECORD).unlink(), "record.json"),
        (lambda f: (f / RECORD).write_text("{"), "record.json"),
        (lambda f: (f / RECORD).write_text("[]"), "record.json"),
        (lambda f: (f / RECORD).write_text("null"), "record.json"),
        (lambda f: (f / RECORD).write_bytes(b"\xff\x00"), "record.json"),
        (lambda f: (f / RECORD).write_text((f / RECORD).read_text().replace('"n": 3', '"n": 4')), "altered"),
        (lambda f: (f / "data.bin").unlink(), "data.bin is missing"),
        (lambda f: (f / "data.bin").write_bytes(b"sig"), "3 bytes instead of 6"),
    ],
)
def test_a_damaged_entry_is_no_hit_and_is_named(store, damage, word):
    publish(store)
    damage(store.folder(*NAME))
    assert store.lookup(*NAME) is None
    assert word in store.diagnose(*NAME)


def test_a_changed_byte_of_the_same_length_is_seen_by_verify_only(store):
    publish(store)
    (store.folder(*NAME) / "data.bin").write_bytes(b"Signal")
    assert store.lookup(*NAME) is not None
    assert store.lookup(*NAME, verify=True) is None
    assert "content of data.bin" in store.diagnose(*NAME, verify=True)


def test_quarantine_moves_the_entry_away_and_keeps_it(store):
    publish(store)
    bad = store.quarantine(*NAME)
    assert store.entries() == []
    assert (bad / "data.bin").read_bytes() == b"signal"


def test_publishing_over_an_entry_replaces_it(store):
    publish(store)
    publish(store, b"other!")
    assert (store.folder(*NAME) / "data.bin").read_bytes() == b"other!"
    assert store.lookup(*NAME, verify=True) is not None


def test_sweep_removes_what_a_dead_process_left_and_spares_what_is_locked(store):
    for key in ("aaaaaaaaaaaaaaaa", "bbbbbbbbbbbbbbbb"):
        (store.root / "erp" / "s01" / f".tmp-{key}-1").mkdir(parents=True)
    with store.lock("erp", "s01", "bbbbbbbbbbbbbbbb"):
        Store(store.root).sweep()
    left = [p.name for p in store.leftovers()]
    assert left == [".tmp-bbbbbbbbbbbbbbbb-1"]


def test_sweep_spares_the_work_of_a_machine_whose_locks_this_one_does_not_see(store):
    """Until that machine has given no sign of life for long, by the disk's clock."""
    work = store.root / "erp" / "s01" / f".tmp-{'a' * 16}-0a1b-7"
    work.mkdir(parents=True)
    lock = store.root / ".locks" / f"erp-s01-{'a' * 16}.lock"
    lock.parent.mkdir()
    lock.write_text(Holder(7, "another-machine", "5").text())
    store.sweep()
    assert work.is_dir()
    old = lock.stat().st_mtime - PATIENCE_S - 1
    os.utime(lock, (old, old))
    store.sweep()
    assert store.leftovers() == []


def test_the_lock_lets_one_in_at_a_time(store):
    order = []

    def second():
        with store.lock(*NAME):
            order.append("second")

    with store.lock(*NAME):
        thread = threading.Thread(target=second)
        thread.start()
        order.append("first")
    thread.join()
    assert order == ["first", "second"]
    assert not FileLock(store.root / ".locks" / "none.lock").is_locked


def test_an_entry_that_was_being_replaced_when_its_process_was_killed_comes_back(store):
    publish(store)
    entry = store.folder(*NAME)
    entry.rename(entry.with_name(f".tmp-{NAME[2]}-0a1b-1-old"))
    store.sweep()
    assert store.lookup(*NAME, verify=True) is not None
    assert store.leftovers() == []


def test_without_locks_many_publish_the_same_and_all_succeed(store):
    def one(_):
        with store.workspace(*NAME) as work:
            (work / "data.bin").write_bytes(b"signal")
            store.publish(Record(*NAME, parts={}, outputs={}), work)

    with futures.ThreadPoolExecutor(4) as pool:
        list(pool.map(one, range(40)))
    assert store.lookup(*NAME, verify=True) is not None
    assert store.leftovers() == []


def test_gc_takes_entries_that_nobody_claims_and_gives_back_those_that_were_claimed_meanwhile(store):
    other = (*NAME[:2], "f" * 16)
    publish(store)
    publish(store, name=other)
    folders, asked = store.entries(), []

    def used():
        asked.append(store.entries())
        return {NAME}

    assert store.drop(folders, used) == [store.folder(*other)]
    # Once for all, and when they are out of sight.
    assert asked == [[]]
    assert store.lookup(*NAME, verify=True) is not None
    assert store.entries() == [store.folder(*NAME)]
    assert store.drop(folders, set) == [store.folder(*NAME)]
    assert store.drop(folders, set) == store.entries() == []
    assert list(store.root.glob(".dropped/*")) == []


@pytest.mark.parametrize("claimed", [True, False])
def test_what_a_killed_gc_began_is_brought_to_an_end(store, claimed):
    class Killed(BaseException):
        pass

    def die():
        raise Killed

    publish(store)
    with pytest.raises(Killed):
        store.drop(store.entries(), die)
    assert store.lookup(*NAME) is None
    store.settle(lambda: {NAME} if claimed else set())
    assert (store.lookup(*NAME, verify=True) is not None) is claimed
    assert list(store.root.glob(".dropped/*")) == []


def test_nothing_goes_while_it_is_not_known_what_is_used(store):
    def unknown():
        raise DataError("the list is broken")

    publish(store)
    with pytest.raises(DataError, match="the list is broken"):
        store.drop(store.entries(), unknown)
    assert store.lookup(*NAME, verify=True) is not None


def test_what_was_made_anew_meanwhile_is_left_as_it_is(store):
    publish(store)

    def made_anew():
        publish(store, b"other!")
        return {NAME}

    assert store.drop(store.entries(), made_anew) == []
    assert (store.folder(*NAME) / "data.bin").read_bytes() == b"other!"


def test_where_locks_cannot_even_be_made_the_work_goes_on_and_says_so(store):
    store.root.mkdir()
    (store.root / ".locks").write_text("")
    said = []
    with store.lock(*NAME, tell=said.append):
        pass
    assert len(said) == 1
    assert str(store.root / ".locks") in said[0]


def test_the_record_names_no_path(store, tmp_path):
    publish(store)
    text = (store.folder(*NAME) / RECORD).read_text()
    assert str(tmp_path) not in text
    assert json.loads(text)["outputs"]["data.bin"]["size"] == 6


@pytest.mark.parametrize(
    ("number", "kind", "word"),
    [(errno.ENOSPC, StageError, "full"), (errno.EROFS, ConfigError, "written"), (errno.EIO, StageError, "failed")],
)
def test_disk_trouble_has_a_cure(tmp_path, number, kind, word):
    error = explain_os_error(OSError(number, os.strerror(number)), tmp_path)
    assert type(error) is kind
    assert word in error.problem
    assert error.cure


def test_a_cache_that_cannot_be_made_is_a_configuration_error(tmp_path):
    (tmp_path / "cache").write_text("a file, no folder")
    store = Store(tmp_path / "cache")
    with pytest.raises(ConfigError, match="cannot be written"), store.lock(*NAME):
        pass


def test_an_entry_in_another_entry_s_place_is_no_hit(store):
    publish(store)
    other = (*NAME[:2], "fedcba9876543210")
    store.folder(*NAME).rename(store.folder(*other))
    assert store.lookup(*other) is None
    assert "record.json is of preprocess/s01/0123456789abcdef" in store.diagnose(*other)


def test_publishing_over_a_sound_entry_quarantines_nothing(store):
    publish(store)
    publish(store, b"other!")
    assert store.leftovers() == []
