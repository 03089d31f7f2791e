"""What is said of a machine's other work."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hrcneuro.arms.machine import Machine

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="this system tells of no process")
# A name that no other program has; it counts for nobody's child once its parent has ended.
BUSY = "import ctypes\nctypes.CDLL(None).prctl(15, b'busy (1) bee', 0, 0, 0)\nprint(flush=True)\nwhile True: pass"


def test_a_busy_program_is_named_and_this_sessions_own_are_not():
    begin = f"subprocess.Popen([sys.executable, '-c', {BUSY!r}], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)"
    detached = [sys.executable, "-c", f"import subprocess, sys; print({begin}.pid)"]
    machine = Machine()
    mine = subprocess.Popen([sys.executable, "-c", BUSY.replace("bee", "ant")], stdout=subprocess.PIPE)
    other = int(subprocess.run(detached, capture_output=True, check=True).stdout)
    try:
        mine.stdout.readline()
        said = machine.words()
        end = time.monotonic() + 60.0
        while "busy (1) bee" not in said and time.monotonic() < end:
            said = machine.words()
    finally:
        os.kill(other, 9)
        mine.kill()
        mine.wait()
        mine.stdout.close()
    assert "busy (1) bee (" in said
    assert f"% of a core, process {other})" in said
    assert "ant" not in said
    assert f"on {os.cpu_count()} cores" in said
