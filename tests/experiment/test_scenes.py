"""What the person reads in a pause."""

import pytest

from hrcneuro.experiment import scenes


@pytest.mark.parametrize(
    ("why", "first"),
    [
        ("the recorder has lost eeg", "The recording is being looked after."),
        ("nobody records any more", "The recording is being looked after."),
        (scenes.KEYBOARD_LOST, scenes.KEYBOARD_LOST),
        ("the experiment's log cannot be written in /data/s01: No space left on device", "The session pauses."),
    ],
)
def test_the_person_reads_a_reason_in_words_and_no_path(why, first):
    shown = scenes.pause(why)
    assert shown.lines[0] == first
    assert not any("/" in line for line in shown.lines)
    assert shown.alarm
    assert len(shown.lines) == 2


def test_a_pause_that_was_asked_for_is_no_alarm():
    shown = scenes.pause("")
    assert not shown.alarm
    assert len(shown.lines) == 1
