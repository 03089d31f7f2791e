"""Markers from a trigger channel."""

from __future__ import annotations

import numpy as np

from hrcneuro.sources.recording import Recording, markers_of

_TRIGGER_NAMES = ("STI101", "STI 014", "STI014", "STATUS", "TRIGGER")


def use_trigger_channel(recording: Recording) -> None:
    """Take the markers from a trigger channel: every change to another code that is not zero."""
    stim = recording.picks("stim")
    if not stim:
        return
    known = [i for i in stim if recording.ch_names[i].upper() in _TRIGGER_NAMES]
    pick = (known or stim)[0]
    codes = np.rint(recording.data[pick]).astype(np.int64)
    at = np.flatnonzero((codes[1:] != codes[:-1]) & (codes[1:] != 0)) + 1
    recording.markers = markers_of(at / recording.sfreq, [str(code) for code in codes[at]])
    recording.notes.append(f"markers taken from the trigger channel {recording.ch_names[pick]}")
