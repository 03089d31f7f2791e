"""One session an arm."""

import os
import tempfile

import pytest

from hrcneuro.arms.lock import exclusive
from hrcneuro.errors import HardwareError


@pytest.fixture
def own_locks(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


@pytest.mark.usefixtures("own_locks")
def test_one_session_an_arm():
    """The second is refused with the first's name, whether it calls the arm by name or number; then it may."""
    with exclusive("ur", "127.0.0.1", "s01"):
        for host in ("127.0.0.1", "localhost"):
            with pytest.raises(HardwareError, match=rf"process {os.getpid()}, the session of s01") as caught:
                exclusive("ur", host, "s02").__enter__()
            assert caught.value.cure
        with exclusive("ur", "127.0.0.3", "s02"), exclusive("ros", "", "s02"):
            pass
    with exclusive("ur", "127.0.0.1", "s02"):
        pass


def test_a_lock_that_cannot_be_opened_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    with pytest.raises(HardwareError, match=r"the lock of the arm \(ros\), .*missing.*No such file"):
        exclusive("ros", "", "s01").__enter__()
