"""Locks with and without the kernel's help."""

import concurrent.futures as futures
import errno
import fcntl
import os
import socket
import subprocess
import sys
import threading
import time

import pytest

from hrcneuro.cache import locks
from hrcneuro.cache.holder import Holder
from hrcneuro.cache.locks import Lock, ago, wait_for

NO_LOCKS = [errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EIO, errno.EPERM, errno.EACCES]


@pytest.fixture
def place(tmp_path):
    return tmp_path / "work.lock"


@pytest.fixture(params=[0, *NO_LOCKS], ids=lambda n: errno.errorcode.get(n, "kernel"))
def kernel(request, monkeypatch):
    """The error that the kernel answers; 0 where it has locks."""
    if request.param:
        without_kernel_locks(monkeypatch, request.param)
    return request.param


def without_kernel_locks(monkeypatch, number=errno.ENOLCK):
    def refuse(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "flock", refuse)


def dead_pid():
    """Return the number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_one_holds_it_and_is_named_until_it_lets_go(kernel, place):
    first, second = Lock(place, "which sings"), Lock(place)
    assert first.take()
    assert not second.take()
    assert (second.holder.pid, second.holder.host) == (os.getpid(), socket.gethostname())
    assert str(second.holder) == f"process {os.getpid()}, which sings"
    assert bool(second.flaw) == bool(kernel)
    first.release()
    assert second.take()
    second.release()
    assert not place.exists() or place.read_text() == ""


@pytest.mark.usefixtures("kernel")
def test_what_a_dead_process_of_this_machine_left_is_taken_over_at_once(place):
    place.write_text(Holder(dead_pid(), socket.gethostname()).text())
    lock = Lock(place)
    assert lock.take()
    lock.release()


@pytest.mark.usefixtures("kernel")
def test_a_number_that_was_given_again_is_another_process(place):
    place.write_text(Holder(os.getpid(), socket.gethostname(), start="1").text())
    assert Lock(place).take()


def test_without_kernel_locks_a_foreign_holder_is_named_waited_for_and_given_up(monkeypatch, place):
    without_kernel_locks(monkeypatch)
    monkeypatch.setattr(locks, "_WORD_S", 0.0)
    place.write_text("4711\nnode17\n")
    old = time.time() - 3 * 86400
    os.utime(place, (old, old))
    said = []
    lock = Lock(place)
    begin = time.monotonic()
    assert wait_for(lock, said.append, patience_s=0.3)
    assert 0.3 <= time.monotonic() - begin < 5
    assert len(said) == 2
    for word in ("process 4711 on node17", str(place), "3 days ago", "0.3 s"):
        assert word in said[0]
    assert "no sign of life" in said[1]
    assert not Lock(place).take()
    lock.release()
    assert not place.exists()


def test_a_number_that_may_have_been_given_again_is_waited_for_with_an_end(monkeypatch, place):
    """As another program's lock that a killed run left: nothing says when its process started."""
    without_kernel_locks(monkeypatch)
    place.write_text(f"{os.getpid()}\n{socket.gethostname()}\n")
    said = []
    lock = Lock(place)
    assert wait_for(lock, said.append, patience_s=0.2)
    assert f"process {os.getpid()} has given no sign of life for 0.2 s" in said[-1]
    lock.release()


@pytest.mark.usefixtures("kernel")
def test_a_holder_that_is_known_to_live_is_not_taken_to_be_gone(place):
    """A stopped process gives no sign of life, and holds its lock."""
    mine, other = Lock(place), Lock(place)
    assert mine.take()
    assert not other.take()
    assert other.surely_held
    released = threading.Timer(0.3, mine.release)
    released.start()
    said = []
    assert wait_for(other, said.append, patience_s=0.0)
    assert said == []
    other.release()
    released.join()


def test_a_holder_is_not_taken_to_be_gone_while_it_lets_go(monkeypatch, place):
    """Between the emptied file and the end of the kernel's lock, nobody is named."""
    mine, other = Lock(place), Lock(place)
    assert mine.take()
    close = os.close
    emptied = threading.Event()

    def linger(file):
        if not emptied.is_set() and file == mine._file:
            emptied.set()
            threading.Event().wait(3 * locks._POLL_S)
        close(file)

    monkeypatch.setattr(os, "close", linger)
    released = threading.Thread(target=mine.release)
    released.start()
    assert emptied.wait(10)
    said = []
    assert wait_for(other, said.append, patience_s=0.0)
    assert said == []
    other.release()
    released.join()


def test_a_foreign_holder_that_lives_is_waited_for(monkeypatch, place):
    without_kernel_locks(monkeypatch)
    place.write_text("4711\nnode17\n")
    beats, said = 12, []

    def live():
        for beat in range(beats):
            os.utime(place, (beat, beat))
            time.sleep(0.05)
        place.unlink()

    holder = threading.Thread(target=live)
    begin = time.monotonic()
    holder.start()
    assert wait_for(Lock(place), said.append, patience_s=0.4)
    assert time.monotonic() - begin > 0.05 * beats * 0.9
    assert said == []
    holder.join()


def test_a_holder_gives_signs_of_life(monkeypatch, place):
    monkeypatch.setattr(locks, "BEAT_S", 0.01)
    lock = Lock(place)
    lock.take()
    os.utime(place, (0, 0))
    deadline = time.monotonic() + 10
    while lock.sign()[0] == 0.0:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    lock.release()


def test_a_lock_that_the_kernel_keeps_for_a_foreign_holder_is_gone_without(place):
    """A machine that died with a lock on a network's disk: its server may keep it for long."""
    other = Lock(place)
    assert other.take()
    place.write_text("4711\nnode17\n")
    said = []
    lock = Lock(place)
    assert not wait_for(lock, said.append, patience_s=0.2)
    assert "process 4711 on node17" in said[-1]
    other.release()


@pytest.mark.parametrize("seconds", [-1800, 0, 1800])
def test_a_lock_that_only_this_machine_s_kernel_knows_is_not_taken_from_another_one_that_lives(
    monkeypatch, place, seconds
):
    """As with NFS's nolock or Lustre's localflock; whatever this machine's clock says."""
    at_start = time.time
    monkeypatch.setattr(time, "time", lambda: at_start() + seconds)
    theirs = Holder(4711, "node17", "5", "which sings").text()
    place.write_text(theirs)
    lock = Lock(place)
    assert not lock.take()
    assert (lock.holder.pid, lock.holder.host) == (4711, "node17")
    assert place.read_text() == theirs
    assert [p.name for p in place.parent.iterdir()] == [place.name]
    old = at_start() - locks.PATIENCE_S - 1
    os.utime(place, (old, old))
    assert lock.take()
    lock.release()


def test_a_lock_that_nobody_wants_any_more_is_not_waited_for(place):
    other, ended = Lock(place), threading.Event()
    assert other.take()
    ended.set()
    assert not wait_for(Lock(place), print, patience_s=60, ended=ended)
    other.release()


def test_such_a_holder_is_given_up_after_its_silence(place):
    place.write_text("4711\nnode17\n")
    said = []
    lock = Lock(place)
    assert wait_for(lock, said.append, patience_s=0.2)
    assert "process 4711 on node17 has given no sign of life" in said[-1]
    lock.release()


def test_what_is_no_lock_file_is_neither_waited_for_nor_read_whole(place):
    os.mkfifo(place)
    assert Lock(place).sign()[1] == ""
    place.unlink()
    with place.open("wb") as file:
        file.truncate(2**40)  # of holes
    assert len(Lock(place).sign()[1]) <= locks._MOST_BYTES
    assert Lock(place).take()


def test_where_there_are_no_hard_links_either(monkeypatch, place):
    without_kernel_locks(monkeypatch)

    def refuse(*_):
        raise OSError(errno.EPERM, "no links")

    monkeypatch.setattr(os, "link", refuse)
    first, second = Lock(place), Lock(place)
    assert first.take()
    assert not second.take()
    assert second.holder.pid == os.getpid()
    first.release()
    assert list(place.parent.iterdir()) == []


def test_of_many_who_take_over_from_a_dead_one_one_succeeds(monkeypatch, place):
    without_kernel_locks(monkeypatch)
    dead, deadline = dead_pid(), time.monotonic() + 60
    for _ in range(30):
        place.write_text(Holder(dead, socket.gethostname()).text())
        racers = [Lock(place) for _ in range(4)]
        with futures.ThreadPoolExecutor(len(racers)) as pool:
            # Those who are in each other's way try again, as all who wait do.
            while not any(taken := list(pool.map(Lock.take, racers))):
                assert time.monotonic() < deadline
        assert sum(taken) == 1
        racers[taken.index(True)].release()
        assert list(place.parent.iterdir()) == []


def test_what_a_process_left_that_was_killed_while_it_took_over_is_no_end(monkeypatch, place):
    without_kernel_locks(monkeypatch)
    monkeypatch.setattr(locks, "_GUARD_S", 0.0)
    place.write_text(Holder(dead_pid(), socket.gethostname()).text())
    place.with_name("work.lock.guard").touch()
    lock = Lock(place)
    assert wait_for(lock, print, patience_s=60)
    lock.release()


@pytest.mark.parametrize("text", ["", "\n\n", "no number\nnode17", "-5\nnode17", "²\nx", "process 12, old form"])
def test_a_file_in_no_known_form_names_nobody(text):
    holder = Holder.read(text)
    assert (holder.pid, holder.dead, holder.here) == (0, False, False)
    assert str(holder) == "an unknown process"


def test_what_a_lock_file_says_does_nothing_to_a_terminal():
    assert str(Holder.read("4711\nno\x1b[2Jde\n5\na\x07b")) == "process 4711 on no?[2Jde, a?b"


def test_a_holder_is_read_as_it_was_written():
    assert Holder.read(Holder.me("a task").text()) == Holder.me("a task")
    assert not Holder.me().dead
    assert not Holder(4711, "node17").dead
    assert Holder(10**12, socket.gethostname()).dead


@pytest.mark.parametrize(
    ("seconds", "text"), [(-5, "0 s ago"), (59, "59 s ago"), (600, "10 minutes ago"), (7200, "2 hours ago")]
)
def test_time_that_has_passed_in_words(seconds, text):
    assert ago(seconds) == text
