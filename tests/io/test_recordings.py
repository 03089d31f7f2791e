"""Recordings that grow: what was written survives whatever ends the process."""

import errno
import os
import signal
import subprocess
import sys
import time
from array import array

import numpy as np
import pytest

from hrcneuro.errors import ConfigError, DataError, StageError
from hrcneuro.io import recordings
from hrcneuro.io.places import check_room
from hrcneuro.io.recordings import SessionRecording, read_stream

COLUMNS = ("time_s", "x", "y")


class Source:
    """Rows that become more."""

    def __init__(self):
        self.numbers = array("d")

    def add(self, rows):
        self.numbers.extend(np.asarray(rows, float).ravel())

    def rows(self, first):
        return self.numbers[first * len(COLUMNS) :]


def test_what_comes_is_written_in_its_order(tmp_path, monkeypatch):
    monkeypatch.setattr(recordings, "_EVERY", 0.001)
    rng, source = np.random.default_rng(1), Source()
    wanted = rng.normal(size=(500, 3))
    recording = SessionRecording(tmp_path / "s01", {"subject": "s01"}, reserve=10_000)
    recording.follow(COLUMNS, source.rows)
    for part in np.array_split(wanted, 40):
        source.add(part)
        time.sleep(0.0005)
    recording.end()
    assert recording.fault == ""
    table = read_stream(recording.place / "telemetry.arrows")
    assert list(table) == list(COLUMNS)
    assert np.array_equal(table.to_numpy(), wanted)
    assert {p.name for p in recording.place.iterdir()} == {"session.json", "telemetry.arrows"}


def test_a_killed_process_leaves_what_it_has_written(tmp_path):
    program = f"""
from array import array
from pathlib import Path
from hrcneuro.io.recordings import SessionRecording
numbers = array("d", range(3000))
recording = SessionRecording(Path({str(tmp_path)!r}), {{}})
recording.follow({COLUMNS!r}, lambda first: numbers[first * 3:])
while not recording.place.joinpath("telemetry.arrows").stat().st_size:
    pass
print(recording.place, flush=True)
input()
"""
    pipe = subprocess.PIPE
    process = subprocess.Popen([sys.executable, "-c", program], stdin=pipe, stdout=pipe, text=True)
    place = process.stdout.readline().strip()
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    from pathlib import Path

    table = read_stream(Path(place) / "telemetry.arrows")
    assert table.to_numpy().ravel().tolist() == list(range(3000))


@pytest.mark.parametrize("lost", [1, 100, 2000])
def test_a_stream_that_was_cut_short_gives_what_is_whole(tmp_path, lost):
    source = Source()
    recording = SessionRecording(tmp_path, {})
    stream = recordings._Stream(tmp_path / "stream", COLUMNS, source.rows)
    for k in range(10):
        source.add(np.full((10, 3), k))
        stream.add()
    stream.close()
    whole = (tmp_path / "stream").read_bytes()
    (tmp_path / "stream").write_bytes(whole[:-lost])
    table = read_stream(tmp_path / "stream")
    assert 0 < len(table) <= 100
    assert table["x"].tolist() == np.repeat(np.arange(len(table) // 10), 10).tolist()
    recording.discard()


def test_what_is_set_aside_is_free_again_however_the_process_ends(tmp_path):
    """It has no name, so that nothing of it is left in a folder that nothing deletes."""
    recording = SessionRecording(tmp_path, {}, reserve=100_000)
    assert recording._reserve is not None
    aside = os.fstat(recording._reserve)
    assert (aside.st_size, aside.st_nlink) == (100_000, 0)
    assert [p.name for p in recording.place.iterdir()] == ["session.json"]
    recording.end()
    assert recording._reserve is None


def test_what_is_no_stream_is_named(tmp_path):
    (tmp_path / "text").write_text("no stream")
    with pytest.raises(DataError, match="text is no stream of a recording"):
        read_stream(tmp_path / "text")


def test_a_full_disk_is_told_and_what_waits_is_written_once_there_is_room(tmp_path, monkeypatch):
    """The reserve is given up before the last rows are written."""
    monkeypatch.setattr(recordings, "_EVERY", 0.001)
    source, write, full = Source(), os.write, [False]

    def scarce(file, data):
        if full[0] and len(data) > 100:
            # As a disk does whose last block is used up: some of it fits.
            full[0] = None
            return write(file, data[:100])
        if full[0] is None:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data)

    monkeypatch.setattr(recordings.os, "write", scarce)
    recording = SessionRecording(tmp_path, {}, reserve=1000)
    source.add(np.zeros((10, 3)))
    recording.follow(COLUMNS, source.rows)
    full[0] = True
    source.add(np.ones((10, 3)))
    deadline = time.monotonic() + 10.0
    while not recording.fault and time.monotonic() < deadline:
        time.sleep(0.001)
    assert "No space left" in recording.fault
    full[0] = False
    source.add(np.full((10, 3), 2.0))
    recording.end()
    assert recording.fault == ""
    assert read_stream(recording.place / "telemetry.arrows")["x"].tolist() == [0.0] * 10 + [1.0] * 10 + [2.0] * 10


def test_attempts_of_one_second_have_folders_of_their_own(tmp_path):
    places = {SessionRecording(tmp_path, {}).place for _ in range(5)}
    assert len(places) == 5


def test_where_nothing_can_be_written_is_named(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="nothing has moved") as error:
        SessionRecording(tmp_path / "file" / "s01", {})
    assert "robot.rescue_folder" in error.value.cure


def test_room_is_asked_for_where_it_will_be_needed(tmp_path):
    check_room(tmp_path / "not" / "yet", 1000, what="it", cure="c")
    with pytest.raises(StageError, match=r"it may take \d+ MB in .*yet, where \d+ MB are free; nothing has moved"):
        check_room(tmp_path / "not" / "yet", 10**18, what="it", cure="c")
    assert not (tmp_path / "not").exists()
