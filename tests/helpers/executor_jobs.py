"""What the tests of the worker pool have done; worker processes import it."""

import os
import signal
import time


def add(a, b):
    return a + b


def pid():
    return os.getpid()


def kill_itself(after_s=0.0):
    time.sleep(after_s)
    os.kill(os.getpid(), signal.SIGKILL)


def wait_for_a_file(path):
    deadline = time.monotonic() + 60.0
    while not path.exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    return os.getpid()


def work_in_a_folder(folder, unwinding_s=0.0):
    """Make a folder, work for a minute, and remove the folder however that ends."""
    mine = folder / f"work-{os.getpid()}"
    try:
        mine.mkdir()  # within: the test interrupts as soon as it sees the folder
        time.sleep(60)
    finally:
        (folder / f"unwinding-{os.getpid()}").touch()
        time.sleep(unwinding_s)
        mine.rmdir()


def work_deaf_to_sigterm(folder):
    """Do not hear that it should end, as in a long call into a numeric library."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    work_in_a_folder(folder)


def end_inside_a_class_body():
    class Ending:
        def __set_name__(self, owner, name):
            os.kill(os.getpid(), signal.SIGTERM)
            sum(range(100))  # the handler runs before this has ended

    class Owner:
        # Python 3.11 makes a RuntimeError of whatever is raised while it names this attribute.
        ending = Ending()


def return_a_lambda():
    return lambda: None


class NotUnpicklable(Exception):
    """It is pickled, but whoever unpickles it is asked for an argument that is gone."""

    def __init__(self, quantity, value):
        super().__init__(f"{quantity} is {value}")


def raise_what_cannot_be_unpickled():
    raise NotUnpicklable("temperature", 451.0)


class WhenUnpickled:
    """Something that calls a function while it is unpickled, as modules are imported then."""

    def __init__(self, call, *args):
        self.call, self.args = call, args

    def __reduce__(self):
        return self.call, self.args
