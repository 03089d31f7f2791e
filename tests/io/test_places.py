"""Files that one process keeps, and others look at."""

import os
import threading

import pytest

from hrcneuro.io.places import is_locked, lock


def test_a_file_is_seen_to_be_kept_as_long_as_it_is(tmp_path):
    path = tmp_path / "kept"
    assert not is_locked(path)
    file = lock(path)
    assert is_locked(path)
    with pytest.raises(BlockingIOError):
        lock(path)
    os.close(file)
    assert not is_locked(path)


def test_whoever_looks_neither_keeps_a_file_from_its_keeper_nor_is_taken_for_one(tmp_path):
    path, over, seen = tmp_path / "kept", threading.Event(), []
    os.close(lock(path))

    def look():
        while not over.is_set():
            seen.append(is_locked(path))

    lookers = [threading.Thread(target=look) for _ in range(2)]
    for one in lookers:
        one.start()
    try:
        while len(seen) < 2000:
            pass
        assert not any(seen)
        for _ in range(200):
            os.close(lock(path))
    finally:
        over.set()
        for one in lookers:
            one.join()
