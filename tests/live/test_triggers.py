"""Triggers on a real serial line, whose other end the test holds; ports that are not there."""

import os
import queue
import sys
import threading
import time
import tty

import pytest

from hrcneuro.errors import HardwareError
from hrcneuro.live.triggers import TriggerOptions, TriggerPort, mistakes

pytest.importorskip("byte_triggers", reason="byte-triggers is not installed: pip install 'hrcneuro[triggers]'")


@pytest.fixture
def line():
    """A serial line: the end that the test reads, and the name of the other."""
    here, there = os.openpty()
    for end in (here, there):
        tty.setraw(end)
    yield here, os.ttyname(there)
    os.close(here)
    os.close(there)


def read(end, n):
    got = b""
    while len(got) < n:
        got += os.read(end, n - len(got))
    return got


def test_codes_come_out_in_order_and_return_to_zero(line):
    end, name = line
    with TriggerPort(TriggerOptions(port="serial", address=name, pulse_ms=2.0), time.perf_counter) as port:
        begun = time.perf_counter()
        for code in (1, 7, 255):
            port.signal(code)
        # A cycle of the robot's loop lasts 8 ms; three pulses of 2 ms would not fit.
        assert time.perf_counter() - begun < 0.004
        assert read(end, 7) == bytes([0, 1, 0, 7, 0, 255, 0])
    assert len(port.delays_s) == 3
    assert port.delays_s[0] < port.delays_s[2]


def test_what_was_asked_before_the_end_still_goes_out(line):
    end, name = line
    with TriggerPort(TriggerOptions(port="serial", address=name, pulse_ms=1.0), time.perf_counter) as port:
        port.signal(9)
    assert read(end, 3) == bytes([0, 9, 0])
    assert all(one.name != "triggers" for one in threading.enumerate())


def test_a_port_that_goes_away_is_told_once_and_hinders_nobody():
    here, there = os.openpty()
    tty.setraw(there)
    told, name = queue.SimpleQueue(), os.ttyname(there)
    options = TriggerOptions(port="serial", address=name, pulse_ms=1.0)
    with TriggerPort(options, time.perf_counter, failed=told.put) as port:
        port.signal(3)
        assert read(here, 3) == bytes([0, 3, 0])
        os.close(here)
        os.close(there)
        for code in (4, 5, 6):
            port.signal(code)
        error = told.get(timeout=10.0)
        assert f"the serial trigger port '{name}' did not take code" in error.problem
        assert "plugged in" in error.cure
    # All codes were tried before the port's end.
    assert len(port.delays_s) == 4
    assert told.empty()


@pytest.mark.parametrize(("port", "address"), [("serial", "/dev/no-such-box"), ("parallel", "/dev/no-such-port")])
def test_a_port_that_is_not_there_is_named_with_a_cure(port, address):
    with pytest.raises(HardwareError, match=f"the {port} trigger port '{address}' cannot be opened") as refused:
        TriggerPort(TriggerOptions(port=port, address=address), time.perf_counter)
    assert "dialout" in refused.value.cure


def test_without_the_library_the_cure_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "byte_triggers", None)
    with pytest.raises(HardwareError, match="not installed") as refused:
        TriggerPort(TriggerOptions(port="mock"), time.perf_counter)
    assert "hrcneuro[triggers]" in refused.value.cure


def test_a_port_needs_an_address():
    assert mistakes(TriggerOptions(port="serial"), "robot.trigger")[0].startswith("robot.trigger.port = 'serial' needs")
    assert mistakes(TriggerOptions(port="mock"), "robot.trigger") == []
