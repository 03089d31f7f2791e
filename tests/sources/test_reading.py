"""What MNE's readers warn of, whenever and however, becomes a note."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path

import mne
import numpy as np
import pytest

from hrcneuro.sources.formats.reading import read_raw

PATH = Path("somewhere") / "rec.fif"


class Talking(mne.io.RawArray):
    """A recording that complains when its samples are fetched."""

    def get_data(self, *args, **options):
        mne.utils.warn("zeroes in the data")
        logging.getLogger("mne").warning("said by the log only")
        return super().get_data(*args, **options)


def opened() -> mne.io.BaseRaw:
    info = mne.create_info(["Cz"], 100.0, "eeg", verbose="error")
    raw = Talking(np.zeros((1, 1000)), info, verbose="error")
    warnings.warn("UTF-8 it is not", UnicodeWarning, stacklevel=2)
    warnings.warn("of old ways", DeprecationWarning, stacklevel=2)
    return raw.set_annotations(mne.Annotations([1.0, 99.0, 9.5], [0, 0, 3.0], ["a", "b", "BAD_x"]))


@pytest.mark.parametrize("level", ["error", "warning", "info"])
def test_every_warning_becomes_a_note_at_any_level_of_the_log_and_each_time(level, capfd):
    expected = [
        "rec.fif: UTF-8 it is not",
        "rec.fif: Omitted 1 annotation(s) that were outside data range.",
        "rec.fif: Limited 1 annotation(s) that were expanding outside the data range.",
        "rec.fif: zeroes in the data",
        "rec.fif: said by the log only",
    ]
    handlers = list(logging.getLogger("mne").handlers)
    for _ in range(2):
        with mne.utils.use_log_level(level):
            assert read_raw(PATH, opened).notes == expected
    assert logging.getLogger("mne").handlers == handlers
    # Answers for machines go to the same terminal.
    assert capfd.readouterr().out == ""


def test_a_reader_that_deals_with_a_warning_may_leave_it_out():
    assert not any("Omitted" in note for note in read_raw(PATH, opened, dealt_with=("Omitted",)).notes)
