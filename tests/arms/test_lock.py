"""One session an arm."""

import os
import subprocess
import sys
import tempfile

import pytest

from hrcneuro.arms import lock
from hrcneuro.arms.lock import exclusive
from hrcneuro.errors import HardwareError

# Names hold for the whole machine: each process that tests has an address of its own.
HOST = f"127.1.{os.getpid() // 256 % 256}.{os.getpid() % 256}"
SESSION = f"""
import sys
from hrcneuro.arms.lock import exclusive
with exclusive("ur", "{HOST}"):
    print("drives", flush=True)
    sys.stdin.read()
"""


def test_one_session_an_arm():
    """The second is refused with the first's process, whether it calls the arm by name or number; then it may."""
    with exclusive("ur", "127.0.0.1"):
        for host in ("127.0.0.1", "localhost"):
            with pytest.raises(HardwareError, match=rf"process {os.getpid()} \(.*python.*nothing has moved") as caught:
                exclusive("ur", host).__enter__()
            assert caught.value.cure
        with exclusive("ur", HOST), exclusive("ros", HOST):
            pass
    with exclusive("ur", "127.0.0.1"):
        pass


@pytest.fixture
def session(tmp_path):
    """A session in a process that has a folder for temporary files of its own."""
    with subprocess.Popen(
        [sys.executable, "-c", SESSION],
        env={**os.environ, "TMPDIR": str(tmp_path)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout.readline() == "drives\n"
        yield process
        process.kill()


def test_a_session_with_temporary_files_elsewhere_is_in_the_way_too(session, tmp_path):
    assert tempfile.gettempdir() != str(tmp_path)
    with pytest.raises(HardwareError, match=rf"process {session.pid} \("):
        exclusive("ur", HOST).__enter__()


def test_a_killed_session_is_in_nobodys_way(session):
    session.kill()
    session.wait()
    with exclusive("ur", HOST):
        pass


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can try as another account")
def test_another_account_is_refused_too(session):
    os.seteuid(65534)
    try:
        with pytest.raises(HardwareError, match=f"process {session.pid}"):
            exclusive("ur", HOST).__enter__()
    finally:
        os.seteuid(0)


def test_a_holder_that_does_not_tell_is_another_session(monkeypatch):
    monkeypatch.setattr(lock.socket, "SO_PEERCRED", 10_000)
    with (
        exclusive("ur", HOST),
        pytest.raises(HardwareError, match=f"the arm \\(ur at {HOST}\\) is driven by another session"),
    ):
        exclusive("ur", HOST).__enter__()


def test_who_is_refused_often_is_still_told_by_whom(session):
    for _ in range(200):
        with pytest.raises(HardwareError) as caught:
            exclusive("ur", HOST).__enter__()
    assert "is driven by" in str(caught.value)
