"""A bucket behind SSH: on a server that is known, and on one that is not."""

import os
import socket
import threading

import pytest

from hrcneuro.cache import filesystems, fingerprint, transfer
from hrcneuro.cache.bucket import Bucket
from hrcneuro.cache.record import Record
from hrcneuro.cache.store import Store
from hrcneuro.cache.transfer import Fate
from hrcneuro.errors import ConfigError, HrcError

pytest.importorskip("fsspec", reason="needs the extra remote")
pytest.importorskip("paramiko", reason="needs the extra remote")


@pytest.fixture
def lab(tmp_path, monkeypatch):
    from sftp_lab import SftpLab

    (tmp_path / "home" / ".ssh").mkdir(parents=True)
    (tmp_path / "served").mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.delenv("SSH_AUTH_SOCK", raising=False)
    server = SftpLab(tmp_path / "served")
    yield server
    server.close()


def publish(store, number):
    parts = {"params": {"number": number}}
    entry = ("scale", f"s{number:02d}", fingerprint.key(parts))
    with store.workspace(*entry) as work:
        (work / "a.txt").write_bytes(bytes([number]) * 100_000)
        store.publish(Record(*entry, parts, {}), work)
    return entry


def known(tmp_path, line):
    (tmp_path / "home" / ".ssh" / "known_hosts").write_text(line)


def test_what_was_pushed_over_ssh_is_pulled_whole(lab, tmp_path):
    known(tmp_path, lab.line)
    one, two, bucket = Store(tmp_path / "one"), Store(tmp_path / "two"), Bucket(f"{lab.url}/lab/study")
    entries = [publish(one, number) for number in range(4)]
    pushed = list(transfer.push(one, bucket, entries, workers=3))
    assert [(m.fate, m.error) for m in pushed] == [(Fate.MOVED, None)] * 4
    pulled = list(transfer.pull(two, bucket, bucket.records()[0], formats={".txt": (b"", b"")}, workers=3))
    assert [(m.fate, m.error) for m in pulled] == [(Fate.MOVED, None)] * 4
    assert all(two.lookup(*entry, verify=True) for entry in entries)
    assert {m.fate for m in transfer.push(one, bucket, entries, force=True)} == {Fate.MOVED}
    assert not list((tmp_path / "served" / "lab" / "study" / ".part").iterdir())


def test_a_machine_that_does_not_answer_is_given_up(lab, tmp_path, monkeypatch):
    """Neither at its door nor, later, at a question; once it answers again it is asked again."""
    known(tmp_path, lab.line)
    monkeypatch.setattr(filesystems, "_SILENCE_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as silent, pytest.raises(HrcError, match="failed"):
        Bucket(f"ssh://jane:x@127.0.0.1:{silent.getsockname()[1]}/lab").records()
    bucket, go_on = Bucket(f"{lab.url}/lab"), threading.Event()
    assert bucket.records() == ({}, [])
    with monkeypatch.context() as hanging:
        hanging.setattr(lab._folder, "stat", lambda self, path: go_on.wait(20))
        try:
            with pytest.raises(HrcError, match="failed"):
                bucket.records()
        finally:
            go_on.set()
    assert bucket.records() == ({}, [])


def test_a_link_and_a_pipe_behind_ssh_are_no_files(lab, tmp_path):
    known(tmp_path, lab.line)
    one, two, bucket = Store(tmp_path / "one"), Store(tmp_path / "two"), Bucket(f"{lab.url}/lab")
    entries = [publish(one, number) for number in range(2)]
    list(transfer.push(one, bucket, entries))
    for number, make in enumerate((lambda path: path.symlink_to(tmp_path / "elsewhere"), os.mkfifo)):
        sha256 = fingerprint.file_digest(one.folder(*entries[number]) / "a.txt")
        path = tmp_path / "served" / "lab" / "files" / sha256[:2] / sha256
        path.replace(tmp_path / "elsewhere")
        make(path)
        assert not bucket.has(sha256, 100_000)
    pulled = list(transfer.pull(two, bucket, entries, formats={".txt": (b"", b"")}))
    assert [m.fate for m in pulled] == [Fate.REFUSED] * 2
    assert all("is no file but a link" in m.error.problem for m in pulled)


def test_a_machine_that_is_not_known_is_told_nothing(lab, tmp_path):
    from paramiko import RSAKey

    other = f"[127.0.0.1]:{lab.port} ssh-rsa {RSAKey.generate(2048).get_base64()}\n"
    for line in ("", other):
        known(tmp_path, line)
        with pytest.raises(ConfigError, match=r"known_hosts does not have the ssh-rsa key that \[127.0.0.1\]"):
            Bucket(f"{lab.url}/{len(line)}").records()
    assert not list((tmp_path / "served").iterdir())


def test_a_wrong_password_is_an_error_without_it(lab, tmp_path):
    known(tmp_path, lab.line)
    with pytest.raises(HrcError, match="Authentication") as raised:
        Bucket(lab.url.replace("hunter2", "wrong-one")).records()
    assert "wrong-one" not in str(raised.value)
