"""Entries that travel: push and pull over the protocols that need no network, and what a hostile bucket may hold."""

import hashlib
import json
import os
import pickle
import threading

import pytest

from hrcneuro.cache import bucket as buckets
from hrcneuro.cache import fingerprint, transfer
from hrcneuro.cache.address import without_login
from hrcneuro.cache.bucket import Bucket
from hrcneuro.cache.record import PULLED, RECORD, Record
from hrcneuro.cache.store import Store
from hrcneuro.cache.transfer import Fate
from hrcneuro.errors import ConfigError, DataError, StageError

fsspec = pytest.importorskip("fsspec", reason="needs the extra remote")
FORMATS = {".txt": (b"", b""), ".json": (b"", b""), ".parquet": (b"PAR1", b"PAR1")}


def parts_of(number):
    return {"params": {"number": number}, "stage": "scale"}


def publish(store, number=1, files=None):
    """Publish an entry, and return its name."""
    parts = parts_of(number)
    entry = ("scale", f"s{number:02d}", fingerprint.key(parts))
    with store.workspace(*entry) as work:
        (work / "deep").mkdir()
        for name, content in (files or {"a.txt": f"a{number}".encode(), "deep/b.txt": b"shared"}).items():
            (work / name).write_bytes(content)
        store.publish(Record(*entry, parts, {}, {"n": number}), work)
    return entry


def tree(store):
    """Return the bytes of all files of all entries."""
    files = (p for folder in store.entries() for p in folder.rglob("*") if p.is_file() and p.name != PULLED)
    return {p.relative_to(store.root).as_posix(): p.read_bytes() for p in files}


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "cache")


@pytest.fixture
def other(tmp_path):
    return Store(tmp_path / "other" / "cache")


@pytest.fixture(params=["file", "folder", "memory"])
def bucket(request, tmp_path):
    url = {
        "file": f"file://{tmp_path}/bucket",
        "folder": str(tmp_path / "with blanks, 100 %, and #" / "bucket"),
        "memory": f"memory://{tmp_path.name}-{os.getpid()}/bucket",
    }
    return Bucket(url[request.param])


@pytest.fixture
def folder(tmp_path):
    """A bucket in a folder, into which a test may put things."""
    place = tmp_path / "a bucket"
    return place, Bucket(str(place))


def pull(store, bucket, entries=None, **how):
    wanted = bucket.records()[0] if entries is None else entries
    return {one.entry: one for one in transfer.pull(store, bucket, wanted, formats=FORMATS, **how)}


def push(store, bucket, entries, **how):
    return {one.entry: one for one in transfer.push(store, bucket, entries, **how)}


def test_what_was_pushed_is_pulled_byte_for_byte(store, other, bucket):
    entries = [publish(store, number) for number in range(6)]
    pushed = push(store, bucket, entries)
    assert {one.fate for one in pushed.values()} == {Fate.MOVED}
    assert list(bucket.records()[0]) == sorted(entries)
    assert {one.fate for one in pull(other, bucket).values()} == {Fate.MOVED}
    assert tree(other) == tree(store)
    assert all(other.lookup(*entry, verify=True) for entry in entries)


def test_a_second_push_and_a_second_pull_move_nothing(store, other, bucket):
    entries = [publish(store, number) for number in range(3)]
    push(store, bucket, entries)
    pull(other, bucket)
    for again in (push(store, bucket, entries), pull(other, bucket)):
        assert {(one.fate, one.size) for one in again.values()} == {(Fate.THERE, 0)}


def test_a_file_that_is_there_is_not_sent_again_and_the_record_comes_last(store, bucket, monkeypatch):
    """A push that was broken off before its record goes on behind the files that went."""
    entry = publish(store)
    monkeypatch.setattr(Bucket, "put_record", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        push(store, bucket, [entry], workers=1)
    assert bucket.records() == ({}, [])
    monkeypatch.undo()
    done = push(store, bucket, [entry])[entry]
    assert (done.fate, done.size) == (Fate.MOVED, 0)
    assert list(bucket.records()[0]) == [entry]


def test_two_pushes_of_one_key_with_other_bytes_at_once_leave_an_entry_that_is_one_of_theirs(
    store, other, bucket, tmp_path
):
    entry = publish(store, 1, {"a.txt": b"on one processor", "b.txt": b"same"})
    publish(other, 1, {"a.txt": b"on another one..", "b.txt": b"same"})
    gate = threading.Barrier(2)

    def go(source):
        gate.wait()
        for _ in range(5):
            push(source, bucket, [entry], force=True)

    threads = [threading.Thread(target=go, args=(one,)) for one in (store, other)]
    [one.start() for one in threads]
    [one.join() for one in threads]
    third = Store(tmp_path / "third" / "cache")
    assert pull(third, bucket)[entry].fate is Fate.MOVED
    assert tree(third) in (tree(store), tree(other))


def test_an_entry_that_is_damaged_here_is_not_pushed(store, bucket):
    entry = publish(store)
    (store.folder(*entry) / "a.txt").write_bytes(b"a?")
    done = push(store, bucket, [entry])[entry]
    assert done.fate is Fate.REFUSED
    assert "content of a.txt has changed" in done.error.problem
    assert bucket.records() == ({}, [])


def test_a_flipped_byte_in_the_bucket_is_caught_and_force_mends_it(store, other, folder):
    base, bucket = folder
    entry, sound = publish(store, 1), publish(store, 2)
    push(store, bucket, [entry, sound])
    path = base / "files" / (sha := fingerprint.file_digest(store.folder(*entry) / "a.txt"))[:2] / sha
    path.write_bytes(b"b1")
    done = pull(other, bucket)
    assert done[entry].fate is Fate.REFUSED
    assert f"content of a.txt in {bucket} has changed (files/{sha[:2]}/{sha})" in done[entry].error.problem
    assert done[sound].fate is Fate.MOVED
    assert other.entries() == [other.folder(*sound)]
    assert other.leftovers() == []
    push(store, bucket, [entry], force=True)
    assert pull(other, bucket)[entry].fate is Fate.MOVED


def test_a_file_that_is_gone_from_the_bucket_is_named(store, other, folder):
    base, bucket = folder
    entry = publish(store)
    push(store, bucket, [entry])
    sha = fingerprint.file_digest(store.folder(*entry) / "a.txt")
    (base / "files" / sha[:2] / sha).unlink()
    done = pull(other, bucket)[entry]
    assert done.fate is Fate.REFUSED
    assert "is missing" in done.error.problem


def forged(base, number=1, *, entry=None, seal=True, text=None, **changes):
    """Put a record into a bucket that nobody's push would have written; return its entry."""
    parts = parts_of(number)
    own = ("scale", f"s{number:02d}", fingerprint.key(parts))
    content = {**dict(zip(("stage", "unit", "key"), own, strict=True)), "parts": parts, "outputs": {}, "summary": {}}
    content = {**content, "provenance": {}, **changes}
    entry = entry or own
    path = base / "records" / entry[0] / entry[1] / f"{entry[2]}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text or json.dumps({**content, "seal": fingerprint.digest(content) if seal else "0" * 64}))
    return entry


def file_of(base, content):
    """Put a file into a bucket; return what a record says of it."""
    sha = hashlib.sha256(content).hexdigest()
    (base / "files" / sha[:2]).mkdir(parents=True, exist_ok=True)
    (base / "files" / sha[:2] / sha).write_bytes(content)
    return {"sha256": sha, "size": len(content)}


@pytest.mark.parametrize(
    "name",
    ["record.json/x.json", "deep/record.json", "a\ud800.json", "ä" * 130 + ".txt",
     "../../../escaped.txt", "/tmp/escaped.txt", "a/../../b.txt", "a\\b.txt", ".hidden.txt", "a/.txt", "", "a//b.txt",
     "record.json", "line\nbreak.txt", "nul\0.txt", "x" * 5000 + ".txt"],
)  # fmt: skip
def test_a_name_that_leads_out_of_the_entry_is_refused(other, folder, tmp_path, name):
    base, bucket = folder
    entry = forged(base, outputs={name: file_of(base, b"evil")})
    before = sorted(p for p in tmp_path.rglob("*") if other.root not in p.parents and p != other.root)
    done = pull(other, bucket)[entry]
    assert done.fate is Fate.REFUSED
    assert repr(name)[:80] in done.error.problem
    assert other.entries() == []
    after = sorted(p for p in tmp_path.rglob("*") if other.root not in p.parents and p != other.root)
    assert [p for p in after if p not in before and p != other.root.parent] == []


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"seal": False}, "seal is broken"),
        ({"stage": "other"}, "record is of other/s01"),
        ({"parts": {"params": {"number": 7}}}, "key is not that"),
        ({"outputs": {"a.txt": 3}}, "size of a.txt"),
        ({"outputs": {"a.txt": {"size": -1, "sha256": "0" * 64}}}, "size of a.txt"),
        ({"outputs": {"a.txt": {"size": True, "sha256": "0" * 64}}}, "size of a.txt"),
        ({"outputs": {"a.txt": {"size": 1, "sha256": "../../../../etc/passwd"}}}, "hash of a.txt"),
        ({"outputs": {n: {"size": 1, "sha256": "0" * 64} for n in ("a", "a/b.txt")}}, "a file and a folder"),
        ({"outputs": {"a.txt": {"size": 10**18, "sha256": "0" * 64}}}, "1000000000.0 GB"),
        ({"outputs": {"run.pkl": {"size": 1, "sha256": "0" * 64}}}, "run.pkl is refused"),
        ({"outputs": []}, "no record"),
        ({"text": "[" * 200_000}, "nested too deeply"),
        ({"text": '{"a":' * 100_000}, "nested too deeply"),
        ({"text": "9" * 100_000}, "its record is refused"),
        ({"text": "null"}, "no record"),
        ({"text": "\ufffe{"}, "its record is refused"),
    ],
)
def test_a_record_that_no_push_has_written_is_refused(other, folder, changes, word):
    base, bucket = folder
    entry = forged(base, **changes)
    done = pull(other, bucket)[entry]
    assert done.fate is Fate.REFUSED, done.error
    assert word in done.error.problem
    assert other.entries() == []


def test_a_record_as_large_as_a_disk_is_not_read(other, folder):
    base, bucket = folder
    entry = forged(base)
    with (base / "records" / entry[0] / entry[1] / f"{entry[2]}.json").open("r+b") as file:
        file.truncate(2**40)  # of holes
    done = pull(other, bucket)[entry]
    assert done.fate is Fate.REFUSED
    assert f"has {2**40} bytes" in done.error.problem


def test_a_file_of_another_size_than_its_record_says_is_not_read(other, folder):
    base, bucket = folder
    about = file_of(base, b"evil")
    entry = forged(base, outputs={"a.txt": about})
    with (base / "files" / about["sha256"][:2] / about["sha256"]).open("r+b") as file:
        file.truncate(2**40)
    done = pull(other, bucket)[entry]
    assert done.fate is Fate.REFUSED
    assert f"has {2**40} bytes instead of 4" in done.error.problem


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("t.parquet", pickle.dumps({"os": "system"})),
        ("t.parquet", b"PAR1 cut short"),
        ("t.json", b"[" * 200_000),
        ("t.json", b"{"),
    ],
)
def test_a_file_that_is_not_of_its_format_is_refused_such_as_a_pickle(other, folder, name, content):
    base, bucket = folder
    entry = forged(base, outputs={name: file_of(base, content)})
    done = pull(other, bucket)[entry]
    assert done.fate is Fate.REFUSED
    assert f"{name} is refused" in done.error.problem
    assert other.entries() == []


def test_a_link_or_a_device_in_the_bucket_is_refused(other, folder, tmp_path):
    base, bucket = folder
    (tmp_path / "secret").write_bytes(b"evil")
    done = []
    for number, make in enumerate((lambda p: p.symlink_to(tmp_path / "secret"), os.mkfifo, os.mkdir), start=1):
        about = file_of(base, b"evil" * number)
        path = base / "files" / about["sha256"][:2] / about["sha256"]
        path.unlink()
        make(path)
        done.append(pull(other, bucket, [forged(base, number, outputs={"a.txt": about})]))
    for one in done:
        (moved,) = one.values()
        assert moved.fate is Fate.REFUSED
        assert "is no file but" in moved.error.problem


def test_names_in_the_bucket_that_can_be_of_no_record_are_told_and_not_followed(store, folder, tmp_path):
    base, bucket = folder
    entry = publish(store)
    push(store, bucket, [entry])
    records = base / "records"
    (records / "scale" / "s01" / "notes.txt").write_text("?")
    (records / "scale" / "s01" / ("0" * 15 + ".json")).write_text("?")
    (records / ".hidden" / "s01").mkdir(parents=True)
    (records / ".hidden" / "s01" / ("0" * 16 + ".json")).write_text("?")
    (records / "circle").symlink_to(records)
    (records / "scale" / "s01" / ("1" * 16 + ".json")).symlink_to(tmp_path)
    found, odd = bucket.records()
    assert list(found) == [entry]
    assert {"scale/s01/notes.txt", f"scale/s01/{'0' * 15}.json", f".hidden/s01/{'0' * 16}.json"} <= set(odd)


def test_a_link_in_the_place_of_an_entry_s_file_is_a_flaw_of_the_cache(store, tmp_path):
    entry = publish(store)
    path = store.folder(*entry) / "a.txt"
    (tmp_path / "elsewhere").write_bytes(path.read_bytes())
    path.unlink()
    path.symlink_to(tmp_path / "elsewhere")
    assert store.lookup(*entry) is None
    assert store.diagnose(*entry) == "a.txt is no file but a link"


def test_a_record_in_the_cache_that_names_files_elsewhere_is_a_flaw(store, tmp_path):
    entry = publish(store)
    content = json.loads((store.folder(*entry) / RECORD).read_text())
    del content["seal"]
    content["outputs"]["../../../../x"] = {"sha256": "0" * 64, "size": 0}
    (store.folder(*entry) / RECORD).write_text(json.dumps({**content, "seal": fingerprint.digest(content)}))
    (tmp_path / "x").touch()
    assert store.lookup(*entry) is None
    assert "record.json" in store.diagnose(*entry)
    (store.folder(*entry) / RECORD).write_text("[" * 200_000)
    assert store.lookup(*entry) is None


def test_what_looks_like_a_record_is_told_from_what_lies_beside_them():
    key = "0" * 16
    assert buckets.is_like_record(f"scale/s01/{key}.json")
    assert buckets.is_like_record(f".hidden/s01/{key}.json")
    strays = ("scale/s01/notes.txt", "scale/s01/notes.json", f"scale/{key}.json", f"a/b/c/{key}.json", "circle")
    assert not any(map(buckets.is_like_record, strays))


def test_a_folder_that_cannot_be_listed_is_an_error_and_not_empty(store, folder, monkeypatch):
    _, bucket = folder
    assert bucket.records() == ({}, [])
    push(store, bucket, [publish(store)])
    listed = os.scandir

    def refuse(path):
        if os.fspath(path).endswith("records/scale"):
            raise PermissionError(13, "Permission denied", path)
        return listed(path)

    monkeypatch.setattr(os, "scandir", refuse)
    with pytest.raises(StageError, match="Permission denied"):
        bucket.records()


def test_a_folder_as_a_bucket_is_shared_with_those_who_may_write_it(store, folder):
    base, bucket = folder
    base.mkdir()
    base.chmod(0o2775)
    before = os.umask(0o077)
    try:
        push(store, bucket, [publish(store)])
    finally:
        os.umask(before)
    for path in base.rglob("*"):
        wanted = 0o070 if path.is_dir() else 0o040
        assert path.stat().st_mode & wanted == wanted, path


def test_what_is_sent_is_what_is_hashed(store, folder, monkeypatch):
    """A file that is replaced while it goes: nothing appears under the other one's hash."""
    base, bucket = folder
    entry = publish(store, 1, {"a.txt": b"sound" * 10})
    path = store.folder(*entry) / "a.txt"
    has = Bucket.has

    def replaced(self, sha256, size):
        path.write_bytes(b"other" * 10)
        return has(self, sha256, size)

    monkeypatch.setattr(Bucket, "has", replaced)
    done = push(store, bucket, [entry])[entry]
    assert done.fate is Fate.REFUSED
    assert "content of a.txt has changed" in done.error.problem
    assert [p for p in base.rglob("*") if p.is_file()] == []


@pytest.mark.parametrize("way", ["push", "pull"])
def test_ctrl_c_waits_for_a_chunk_and_not_for_an_entry(store, other, folder, monkeypatch, way):
    """Nothing half-written stays, and the same again goes on."""
    base, bucket = folder
    large, small = publish(store, 1, {"a.txt": b"x" * 5000}), publish(store, 2)
    if way == "pull":
        push(store, bucket, [large, small])
    monkeypatch.setattr(transfer, "CHUNK", 100)
    monkeypatch.setattr(buckets, "CHUNK", 100)
    reached, go_on, read = threading.Event(), threading.Event(), []
    shaped = hashlib.sha256

    class Slow:
        def __init__(self, data=b""):
            self.digest, self.size = shaped(data), 0

        def update(self, data):
            self.digest.update(data)
            read.append(len(data))
            self.size += len(data)
            if self.size >= 500:
                reached.set()
                go_on.wait(20)

        def hexdigest(self):
            return self.digest.hexdigest()

    monkeypatch.setattr(transfer.hashlib, "sha256", Slow)
    wanted = [small, large]
    moved = transfer.push(store, bucket, wanted, workers=2) if way == "push" else None
    moved = moved or transfer.pull(other, bucket, wanted, formats=FORMATS, workers=2)
    next(moved)
    assert reached.wait(20)
    closing = threading.Thread(target=moved.close)
    closing.start()
    go_on.set()
    closing.join(20)
    assert sum(read) < 1000
    monkeypatch.undo()
    assert other.leftovers() == []
    assert not list(base.glob(".part/*"))
    again = push(store, bucket, wanted) if way == "push" else pull(other, bucket, wanted)
    assert again[large].fate is Fate.MOVED


def test_a_pull_leaves_what_was_dropped_here_dropped_unless_it_is_forced(store, other, folder):
    _, bucket = folder
    entry = publish(store)
    push(store, bucket, [entry])
    pull(other, bucket)
    (other.folder(*entry) / ".slim").write_text(json.dumps(["a.txt"]))
    (other.folder(*entry) / "a.txt").unlink()
    assert pull(other, bucket)[entry].fate is Fate.SLIM
    assert not (other.folder(*entry) / "a.txt").exists()
    assert pull(other, bucket, force=True)[entry].fate is Fate.MOVED
    assert other.lookup(*entry, verify=True) is not None
    assert pull(other, bucket, force=True)[entry].fate is Fate.THERE


@pytest.mark.parametrize("url", ["http://x/y", "github://a:b@/", "simplecache::file:///x", "s4://bucket"])
def test_a_url_of_no_kind_that_can_be_used_is_refused(url):
    with pytest.raises(ConfigError, match="allowed: file://, s3://, sftp://, ssh:// and a folder"):
        Bucket(url)


def test_a_library_that_is_absent_is_named_with_the_extra(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ConfigError, match="s3:// needs fsspec and s3fs") as raised:
        Bucket("s3://bucket/study")
    assert raised.value.cure == "pip install 'hrcneuro[remote]'"


def test_a_password_in_a_url_is_shown_to_nobody(tmp_path, monkeypatch):
    assert without_login("ssh://me:secret@host/data") == "ssh://host/data"
    assert without_login("s3://key:se@cret@bucket") == "s3://bucket"
    bucket = Bucket(f"file://{tmp_path}/bucket")
    bucket.url = "ssh://me:secret@host/data"

    def fail(self):
        raise OSError("no route to me:secret@host")

    monkeypatch.setattr(buckets.Bucket, "_fs", fail)
    with pytest.raises(Exception, match="no route") as raised:
        bucket.records()
    assert "secret" not in str(raised.value)
    assert "me:" not in str(raised.value)


def test_an_entry_whose_files_were_dropped_is_not_pushed(store, bucket):
    entry = publish(store)
    (store.folder(*entry) / ".slim").write_text(json.dumps(["a.txt"]))
    (store.folder(*entry) / "a.txt").unlink()
    assert push(store, bucket, [entry])[entry].fate is Fate.SLIM


def test_a_record_that_is_not_there_is_refused(store, bucket):
    entry = ("scale", "s01", "0" * 16)
    done = pull(store, bucket, [entry])[entry]
    assert isinstance(done.error, DataError)
    assert "has no record" in done.error.problem
