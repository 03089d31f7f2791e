"""The end of a process is seen as soon as it is told to end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from hrcneuro.experiment import end_of_process
from hrcneuro.experiment.end_of_process import at_its_end

pytestmark = pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="this system has no /proc")


@pytest.fixture
def process():
    process = subprocess.Popen([sys.executable, "-c", "import time; print(flush=True); time.sleep(600)"], stdout=-1)
    process.stdout.readline()
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def test_one_that_runs_or_is_stopped_is_not(process):
    assert not at_its_end(process.pid)
    process.send_signal(signal.SIGSTOP)
    os.waitid(os.P_PID, process.pid, os.WSTOPPED)
    assert not at_its_end(process.pid)
    assert not at_its_end(os.getpid())


def test_one_that_was_killed_is_before_and_after_it_is_taken_leave_of(process):
    process.kill()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    assert at_its_end(process.pid)
    process.wait()
    assert at_its_end(process.pid)


@pytest.mark.parametrize(
    ("line", "ends"),
    [("SigPnd:\t0000000000000100", True), ("ShdPnd:\t0000000000000100", True), ("ShdPnd:\t0000000000004000", False),
     ("CoreDumping:\t1", True), ("CoreDumping:\t0", False)],
)  # fmt: skip
def test_one_that_is_told_to_end_but_waits_for_the_disk_is(monkeypatch, tmp_path, line, ends):
    """Its status as the kernel writes it (proc(5)); such a wait cannot be had at will."""
    (tmp_path / "7").mkdir()
    (tmp_path / "7" / "status").write_text(f"Name:\tpython: D\nState:\tD (disk sleep)\n{line}\n")
    monkeypatch.setattr(end_of_process, "_PROC", tmp_path)
    assert at_its_end(7) is ends


def test_where_the_system_does_not_tell_nobody_has_ended(monkeypatch, tmp_path):
    monkeypatch.setattr(end_of_process, "_PROC", tmp_path)
    assert not at_its_end(7)
