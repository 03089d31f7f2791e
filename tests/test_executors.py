"""Worker processes: what becomes of one that is told to end where an exit comes out as another exception."""

import os
import signal

import pytest

from hrcneuro.pipeline.executors import Processes


def add(a, b):
    return a + b


def end_inside_a_class_body():
    class Told:
        def __set_name__(self, owner, name):
            os.kill(os.getpid(), signal.SIGTERM)
            sum(range(100))  # the handler runs before this has ended

    class Owner:
        # Python 3.11 makes a RuntimeError of whatever is raised while it names this attribute.
        told = Told()


def test_a_worker_that_is_told_to_end_does_so_quietly_wherever_it_is(capfd):
    with Processes(1) as workers:
        lost = workers.submit(end_inside_a_class_body)
        with pytest.raises(Exception, match="exit code 1"):
            lost.result(timeout=60)
        assert workers.submit(add, 1, 2).result(timeout=60) == 3
    assert capfd.readouterr().err == ""
