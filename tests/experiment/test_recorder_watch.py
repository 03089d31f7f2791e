"""Whether the recorder of a subject is seen, and what it has lost."""

import contextlib
import fcntl
import json

import pytest

from hrcneuro.experiment.recorder_watch import RecorderWatch
from hrcneuro.live import journal
from hrcneuro.live.part import LOCK


def told(folder, *events):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / journal.FILE).write_text(json.dumps({"parts": [{"events": list(events)}]}))


@pytest.fixture
def recorder(tmp_path):
    """Return the folder of a recording that is under way, and what ends it."""
    with contextlib.ExitStack() as stack:
        folder = tmp_path / "20300102T100000"
        told(folder)
        fcntl.flock(stack.enter_context((folder / LOCK).open("w")), fcntl.LOCK_EX)
        yield folder, stack.close


@pytest.mark.parametrize("arm", [False, True])
def test_what_the_recorder_loses_is_told_also_beside_a_younger_recording_of_the_arm(tmp_path, recorder, arm):
    folder, ends = recorder
    if arm:
        told(tmp_path / "20300102T110000")
    watch = RecorderWatch(tmp_path, ["eeg"])
    assert watch.look() == ""
    assert watch.seen
    told(folder, {"kind": "lost", "stream": "eeg"}, {"kind": "lost", "stream": "another"})
    assert watch.look() == "the recorder has lost eeg"
    told(folder, {"kind": "lost", "stream": "eeg"}, {"kind": "back", "stream": "eeg"})
    assert watch.look() == ""
    told(folder, {"kind": "changed", "stream": "eeg"}, {"kind": "lost", "stream": "eeg#2"})
    assert watch.look() == "the recorder has lost eeg"
    ends()
    assert watch.look() == "nobody records any more"


def test_an_older_recording_that_is_resumed_is_the_one_that_is_looked_at(tmp_path, recorder):
    folder, _ = recorder
    younger = tmp_path / "20300102T110000"
    told(younger, {"kind": "lost", "stream": "eeg"})
    (younger / LOCK).touch()
    watch = RecorderWatch(tmp_path, ["eeg"])
    assert watch.look() == ""
    told(folder, {"kind": "lost", "stream": "eeg"})
    assert watch.look() == "the recorder has lost eeg"


def test_where_nobody_has_recorded_nothing_is_wrong(tmp_path, recorder):
    _, ends = recorder
    ends()
    watch = RecorderWatch(tmp_path, ["eeg"])
    assert watch.look() == ""
    assert not watch.seen
