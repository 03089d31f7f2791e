"""What a file system refuses, and folders for all who share a cache."""

import contextlib
import os
import re
import stat
import tempfile
from pathlib import Path

import pytest

from hrcneuro.cache import fingerprint
from hrcneuro.cache.disk import LARGEST, guarded, make_folder, remove, share, size
from hrcneuro.cache.placed import ID, read_id
from hrcneuro.cache.record import RECORD, SLIM, Record
from hrcneuro.cache.store import Store
from hrcneuro.errors import ConfigError, HrcError
from hrcneuro.pipeline.workdir import Workdir

NAME = ("erp", "s01", "0123456789abcdef")
NOBODY = 65534


def dangling(path):
    path.symlink_to(path.parent / "nowhere")


def circular(path):
    path.symlink_to(path.name)


def plain_file(path):
    path.write_text("")


ODD = {
    "dangling": (dangling, "is a link to .*nowhere, which is not there"),
    "circular": (circular, "is a link that leads back to itself"),
    "file": (plain_file, "is a file, not a folder"),
    "pipe": (os.mkfifo, "is a device or pipe, not a folder"),
}


@pytest.mark.parametrize("part", ["", "erp", "erp/s01"])
@pytest.mark.parametrize("kind", ODD)
def test_an_odd_place_is_named_with_what_is_odd(tmp_path, part, kind):
    make, words = ODD[kind]
    odd = tmp_path / "cache" / part
    odd.parent.mkdir(parents=True, exist_ok=True)
    make(odd)
    store = Store(tmp_path / "cache")
    with pytest.raises(ConfigError, match=re.escape(str(odd)) + " " + words) as caught:
        store.diagnose(*NAME)
        with store.lock(*NAME), store.workspace(*NAME):
            pass
    assert "HRCNEURO_CACHE" in caught.value.cure


@pytest.mark.parametrize("kind", ["pipe", "endless", "large", "folder"])
def test_what_is_no_file_or_too_large_is_neither_waited_for_nor_read(tmp_path, kind):
    """Where the cache keeps files of its own, somebody may have put a pipe, or a link to a device."""
    store, results = Store(tmp_path / "cache"), tmp_path / "results"
    parts = {"params": {}}
    name = ("scale", "s01", fingerprint.key(parts))
    with store.workspace(*name) as work:
        (work / "a.txt").write_text("a")
        store.publish(Record(*name, parts, {}), work)
    pointer = results / "s01" / "scale.json"
    pointer.parent.mkdir(parents=True)
    for path in (store.folder(*name) / RECORD, store.folder(*name) / SLIM, pointer, results / ID, store.root / "memo"):
        path.unlink(missing_ok=True)
        {"pipe": os.mkfifo, "endless": lambda p: p.symlink_to("/dev/zero"), "folder": Path.mkdir, "large": too_large}[
            kind
        ](path)
    assert store.lookup(*name, slim=True) is None
    assert "record.json" in store.diagnose(*name)
    assert Workdir(tmp_path).pointer("scale", "s01") == ""
    assert read_id(results) == ""
    if kind != "large":
        assert fingerprint.Memo(store.root / "memo").known == {}


def too_large(path):
    path.touch()
    os.truncate(path, LARGEST + 1)


def test_a_folder_in_a_file_s_place_is_named_with_what_to_do(tmp_path):
    new, taken = tmp_path / "new", tmp_path / "pointer.json"
    new.write_text("")
    taken.mkdir()
    for write in (lambda: new.replace(taken), lambda: taken.write_text("")):
        words = re.escape(f"{taken} cannot be written: it is a folder")
        with pytest.raises(ConfigError, match=words) as caught, guarded(tmp_path):
            write()
        assert "move that folder away" in caught.value.cure


@contextlib.contextmanager
def as_nobody():
    """Act with the rights of an account that owns nothing here."""
    if os.geteuid():
        pytest.skip("only root can act as another account")
    os.setegid(NOBODY)
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)
        os.setegid(0)


@pytest.fixture
def reachable():
    """A folder that another account can reach, unlike ``tmp_path``, whose parents are the owner's alone."""
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        yield Path(folder)


@pytest.fixture
def cache(reachable):
    """A cache that another account can reach, but not write, with one entry."""
    publish(Store(reachable / "cache"))
    return reachable / "cache"


def publish(store):
    with store.lock(*NAME), store.workspace(*NAME) as work:
        (work / "deep").mkdir()
        (work / "deep" / "data").write_bytes(b"data")
        store.publish(Record(*NAME, parts={}, outputs={}), work)


def test_another_account_has_hits_and_is_told_the_path_and_its_owner_where_it_cannot_write(cache):
    with as_nobody():
        store = Store(cache)
        assert store.lookup(*NAME, verify=True) is not None
        with pytest.raises(
            ConfigError, match=r"cache/erp/s01/\.tmp-.* cannot be written: .*drwxr-xr-x, of root"
        ) as caught:
            publish(store)
        assert "g+rwXs" in caught.value.cure
        assert "umask 002" in caught.value.cure


def test_a_folder_that_may_not_be_read_is_a_configuration_error(cache):
    (cache / "erp").chmod(0o700)
    with as_nobody(), pytest.raises(ConfigError, match="Permission denied"):
        Store(cache).diagnose(*NAME)


def test_where_the_group_may_write_the_cache_it_may_replace_what_is_in_it(reachable):
    root = reachable / "cache"
    root.mkdir()
    root.chmod(0o2775)
    with contextlib.ExitStack() as stack:
        stack.callback(os.umask, os.umask(0o077))
        publish(Store(root))
        if not os.geteuid():
            os.chown(root, 0, NOBODY)
            for folder, folders, files in os.walk(root):
                for name in folders + files:
                    os.chown(os.path.join(folder, name), 0, NOBODY)
            root.chmod(0o2775)
            with as_nobody():
                publish(Store(root))
                assert Store(root).lookup(*NAME, verify=True) is not None
    for path in root.rglob("*"):
        mode = path.stat().st_mode
        if path.is_dir():
            assert mode & 0o070 == 0o070, path
        else:
            assert mode & stat.S_IRGRP, path


@pytest.mark.parametrize(
    ("given", "folder", "file"),
    [(0o755, 0o700, 0o600), (0o775, 0o770, 0o640), (0o777, 0o777, 0o644), (0o1777, 0o770, 0o640)],
)
def test_rights_follow_those_of_the_cache(tmp_path, given, folder, file):
    root = tmp_path / "cache"
    root.mkdir()
    root.chmod(given)
    (root / "folder").mkdir(mode=0o700)
    (root / "file").touch(mode=0o600)
    for name in ("folder", "file"):
        share(root / name, root)
    assert stat.S_IMODE((root / "folder").stat().st_mode) == folder
    assert stat.S_IMODE((root / "file").stat().st_mode) == file


def test_folders_are_made_up_to_the_cache_and_above(tmp_path):
    root = tmp_path / "a" / "cache"
    make_folder(root / "erp" / "s01", root)
    make_folder(root / "erp" / "s01", root)
    assert (root / "erp" / "s01").is_dir()


def test_remove_takes_folders_files_and_links_and_what_is_gone(tmp_path):
    (tmp_path / "folder" / "deep").mkdir(parents=True)
    (tmp_path / "folder" / "deep" / "file").write_bytes(b"1234")
    (tmp_path / "link").symlink_to("folder")
    assert size(tmp_path / "folder") == 4
    remove(tmp_path / "link")
    assert (tmp_path / "folder").is_dir()
    for name in ("folder", "folder", "nothing"):
        remove(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_an_error_without_a_path_names_the_place(tmp_path):
    with pytest.raises(HrcError, match=str(tmp_path)), guarded(tmp_path):
        raise PermissionError(13, "Permission denied")
