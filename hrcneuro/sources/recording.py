"""A recording in memory, whatever it came from: volts, named and typed channels, markers, breaks."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from hrcneuro.eeg.breaks import event_mark
from hrcneuro.errors import DataError
from hrcneuro.sources.origin import UNKNOWN, Origins, mark_of
from hrcneuro.sources.parameters import HIGHEST_HZ, LOWEST_HZ

if TYPE_CHECKING:
    import mne

# Types that later stages know; other channels of a recording are left out.
CHANNEL_TYPES = ("eeg", "eog", "ecg", "emg", "misc", "stim")
_SIGNALS = ("eeg", "eog")
_REFERENCE = "reference of the recording: "


@dataclass
class Recording:
    """A continuous recording.

    Attributes:
        data: ndarray, shape (n_channels, n_times), V (stim channels: codes).
        ch_names, ch_types: The channels, in the order of the rows.
        sfreq: Sampling rate, in Hz.
        markers: Columns onset_s (from the first sample, not rounded to one) and event, in order of time; further ones
            are of the trial table, as text.
        breaks_s: Where a new segment begins, the first one left out.
        named_breaks: Those breaks that only a marker's name tells, as (break_s, onset_s, text).
        spans: Stretches marked bad, as (onset_s, duration_s, text).
        montage: EEG positions, where known.
        units: Unit that each channel's numbers were taken for.
        bads: Channels marked bad beforehand.
        file_names: Name here -> name in the file, where they differ.
        shortened: Those names here that are the site in a longer label, and no name of the study's own.
        reference: What the channels were recorded against, where a data set states it.
        notes: What a person may want to know of the reading, a sentence each.
        origins: Where it comes from, as far as that is known.
        warnings: What a person should be told at once, a sentence each.
        absent: Markers that the study maps and that do not occur -> the nearest spelling, or an empty string.
    """

    data: np.ndarray
    ch_names: list[str]
    ch_types: list[str]
    sfreq: float
    markers: pd.DataFrame
    breaks_s: list[float] = field(default_factory=list)
    named_breaks: list[tuple[float, float, str]] = field(default_factory=list)
    spans: list[tuple[float, float, str]] = field(default_factory=list)
    montage: mne.channels.DigMontage | None = None
    units: list[str] = field(default_factory=list)
    bads: list[str] = field(default_factory=list)
    file_names: dict[str, str] = field(default_factory=dict)
    shortened: frozenset[str] = frozenset()
    reference: str = ""
    notes: list[str] = field(default_factory=list)
    origins: Origins = UNKNOWN
    warnings: list[str] = field(default_factory=list)
    absent: dict[str, str] = field(default_factory=dict)

    @property
    def duration_s(self) -> float:
        """Length of the recording in seconds."""
        return self.data.shape[1] / self.sfreq

    def picks(self, *types: str) -> list[int]:
        """Return the indices of the channels of these types."""
        return [i for i, one in enumerate(self.ch_types) if one in types]

    def keep(self, picks: list[int]) -> None:
        """Leave only the channels at ``picks``, in that order."""
        if picks == list(range(len(self.ch_names))):
            return
        self.data = self.data[picks]
        self.ch_names = [self.ch_names[i] for i in picks]
        self.ch_types = [self.ch_types[i] for i in picks]
        self.units = [self.units[i] for i in picks] if self.units else []
        self.bads = [name for name in self.bads if name in self.ch_names]


def markers_of(onsets_s: np.ndarray | list[float], events: list[str]) -> pd.DataFrame:
    """Return a marker table (onset_s, event) in order of time; simultaneous markers keep their order."""
    table = pd.DataFrame({"onset_s": np.asarray(onsets_s, float), "event": pd.Series(events, dtype=object)})
    return table.sort_values("onset_s", kind="stable", ignore_index=True)


def check_signals(recording: Recording) -> None:
    """Refuse EEG and EOG that no later stage could use; a channel marked bad only has its gaps filled with zeros.

    A flat EEG channel is noted: preprocess makes it from the others.

    Raises:
        DataError: There is no EEG channel, the sampling rate is one that no EEG has, a channel has samples that are no
            numbers, or the numbers cannot be the unit they are taken for.
    """
    if not LOWEST_HZ <= recording.sfreq <= HIGHEST_HZ:
        raise DataError(
            f"the recording's sampling rate is {recording.sfreq:.4g} Hz, which no EEG has; "
            f"allowed: {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz",
            cure="correct the rate that its header states; one that is measured needs times in s",
        )
    if not recording.picks("eeg"):
        raise DataError(
            f"the recording has no EEG channel; its channels are {some(recording.ch_names)}",
            cure="give their types in acquire.channel_types",
        )
    for i in recording.picks(*_SIGNALS):
        _check_numbers(i, recording)
        name, row = recording.ch_names[i], recording.data[i]
        if np.ptp(row) == 0:
            recording.notes.append(f"channel {name} is flat: {row[0] * 1e6:g} µV from the first sample to the last")
    _check_unit(recording)


def _check_numbers(i: int, recording: Recording) -> None:
    name, row = recording.ch_names[i], recording.data[i]
    bad = ~np.isfinite(row)
    if not bad.any():
        return
    count = f"{int(bad.sum())} of {bad.size} samples that are no numbers"
    first = f"the first at {int(np.argmax(bad)) / recording.sfreq:.3f} s"
    if name in recording.bads:
        row[bad] = 0
        recording.notes.append(f"channel {name}, marked bad: {count} are 0 now, {first}")
        return
    # Nothing makes an EOG channel from the others.
    mark = f"have it interpolated (acquire.bads = ['{name}']) or " if recording.ch_types[i] == "eeg" else ""
    drop = f"acquire.drop = ['{recording.file_names.get(name, name)}']"
    if name in recording.file_names and name not in recording.shortened:
        drop += ", without its name in acquire.channel_map"
    raise DataError(f"channel {name} has {count}, {first}", cure=f"{mark}leave it out ({drop})")


def _check_unit(recording: Recording) -> None:
    from hrcneuro.io.fif import RECORDED_V, check_volts

    check_volts(
        recording.data[recording.picks("eeg"), : int(60 * recording.sfreq) + 1], "the recording", low=RECORDED_V
    )


def reference_of(raw: mne.io.BaseRaw) -> str:
    """Return what a recording that :func:`to_raw` made was recorded against; empty where that is not stated."""
    first = str(raw.info["description"] or "").partition("\n")[0]
    return first.removeprefix(_REFERENCE) if first.startswith(_REFERENCE) else ""


def to_raw(recording: Recording, onsets: pd.DataFrame, *, reference: str = "") -> mne.io.BaseRaw:
    """Return the recording as MNE's type, with nothing in it but signals, positions, events and breaks.

    A break becomes ``BAD boundary`` and ``EDGE boundary`` at the first sample of the new segment, as MNE itself marks
    joins. An event whose name reads as such a mark gets ``event/`` before it: nobody who reads the file may take
    ``bad_choice`` for a bad stretch. Date, device, names and comments stay behind; what is simulated says so.

    Args:
        recording: As read or simulated.
        onsets: Columns onset_sample and event: they become annotations.
        reference: What the channels were recorded against, where known.
    """
    import mne

    info = mne.create_info(recording.ch_names, recording.sfreq, recording.ch_types, verbose="error")
    info["description"] = "\n".join(
        text for text in (reference and f"{_REFERENCE}{reference}", mark_of(recording.origins)) if text
    )
    info["bads"] = list(recording.bads)
    raw = mne.io.RawArray(recording.data, info, verbose="error")
    if recording.montage is not None:
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            raw.set_montage(recording.montage, on_missing="ignore", verbose="error")
    # FIF keeps onsets in single precision: whole samples survive that, fractions would not.
    events = [event_mark(str(event)) for event in onsets["event"]]
    marks = [(s / recording.sfreq, 0.0, event) for s, event in zip(onsets["onset_sample"], events, strict=True)]
    marks += [(at, 0.0, text) for at in recording.breaks_s for text in ("BAD boundary", "EDGE boundary")]
    marks += recording.spans
    if marks:
        onset, duration, text = zip(*marks, strict=True)
        raw.set_annotations(mne.Annotations(onset, duration, text), verbose="error")
    return raw


def some(names: list[str]) -> str:
    """Return names for a person: the first eight, and how many there are where there are more."""
    return ", ".join(names[:8]) + (f" … ({len(names)})" if len(names) > 8 else "")
