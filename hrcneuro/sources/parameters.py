"""What can be set of where a subject's data come from, and of how a recording is read. Light to import."""

from __future__ import annotations

from dataclasses import dataclass, fields

from hrcneuro.contract import option

LOWEST_HZ, HIGHEST_HZ = 32.0, 100_000.0
"""Between these lies the sampling rate of any EEG; one outside was stated or measured in another unit."""
_READ = ("dataset", "file", "bids", "recording")
_SOURCES = {
    "path": (*_READ, "semisynthetic"),
    "recorded": (*_READ, "semisynthetic"),
    "onset_event": ("dataset", "recording"),
    "event_map": ("file", "bids"),
    "least_gap_s": ("file", "bids"),
    "twins": ("file", "bids"),
    "tasks": ("bids",),
    "sessions": ("bids",),
    "runs": ("bids",),
    "event_column": ("bids",),
    "columns": ("file",),
    "table_rate": ("file",),
    "time_column": ("file",),
    "marker_column": ("file",),
    "stream": ("file", "recording"),
    "stream_rate": ("file", "recording"),
    "rate_tolerance": ("file", "recording"),
    "markers": ("file", "recording"),
    "trigger_mask": ("file", "recording"),
    "snap_s": ("recording",),
    "amp_delay_ms": ("recording",),
}


@dataclass(frozen=True)
class Source:
    """Where a subject's data come from, and how a foreign recording is to be read."""

    source: str = option(
        "synthetic",
        "dataset: the authors' repository; recording: a session of the study, XDF and log; file: any recording; bids: "
        "a BIDS data set; semisynthetic: real log, synthetic EEG; synthetic",
        choices=("dataset", "recording", "file", "bids", "semisynthetic", "synthetic"),
    )
    path: str = option(
        "",
        "data folder (dataset, semisynthetic), root (bids), or recording with {subject} in it (recording: its folder); "
        "several that fit * are joined",
        path=True,
        keyed=False,
    )
    onset_event: str = option(
        "", "dataset, recording: code of a movement onset (A+B: either); empty: by its text, else found by counting"
    )
    tasks: tuple[str, ...] = option((), "bids: labels of the tasks to read; none: the only one there is")
    sessions: tuple[str, ...] = option((), "bids: labels of the sessions to read, joined; none: all")
    runs: tuple[str, ...] = option((), "bids: labels of the runs to read, joined; none: all")
    event_column: str = option("", "bids: column of events.tsv that names the events; empty: trial_type, else value")
    event_map: dict[str, str] = option({}, "file, bids: marker -> event name; empty: every marker is an event")
    markers: str = option(
        "auto",
        "where markers come from: auto, annotations, channel (a trigger channel), or a channel's name; recording: "
        "which channel times them (annotations: none)",
    )
    trigger_mask: int = option(
        0, "file: bits of a trigger channel's value that count (255: the lowest 8); 0: all", low=0, high=2**31 - 1
    )
    least_gap_s: float = option(
        0.02,
        "file, bids: markers of one name that follow closer are twins, one event twice",
        unit="s",
        low=0,
        high=1,
    )
    twins: str = option(
        "refuse", "file, bids: what becomes of twins; merge: the first counts", choices=("refuse", "merge", "keep")
    )
    snap_s: float = option(
        0.1,
        "recording: so far a trigger's edge may be from its marker and the delay that most have in common",
        unit="s",
        low=0,
        high=0.5,
    )
    amp_delay_ms: float = option(
        0.0, "recording: how much later the amplifier's stamps show what happens", unit="ms", low=-500, high=500
    )
    channel_map: dict[str, str] = option({}, "channel in the file -> name to use")
    channel_types: dict[str, str] = option({}, "channel -> eeg, eog, ecg, emg, misc or stim; else by label and unit")
    drop: tuple[str, ...] = option((), "channels of the file to leave out")
    bads: tuple[str, ...] = option(
        (), "channels known to be bad: preprocess makes EEG from the others, and regresses on no such EOG"
    )
    montage: str = option("auto", "auto: the file's positions, else 10-05 by name; none; or a montage of MNE")
    unit: str = option(
        "", "unit of the file's numbers, where it states a wrong one", choices=("", "V", "mV", "uV", "nV")
    )
    recorded: bool = option(
        False, "you vouch that people were recorded; else what carries no mark of a simulation is of unknown origin"
    )
    reference: str = option("", "reference of the recording, for the record")
    columns: tuple[str, ...] = option((), "table (CSV): the columns that are channels; acquire.unit is their unit")
    table_rate: float = option(0.0, "table: sampling rate; 0: by time_column", unit="Hz", low=0, high=HIGHEST_HZ)
    time_column: str = option("", "table: column of times in s; gaps in it, and where it starts again, are breaks")
    marker_column: str = option("", "table: column of markers; numbers are a trigger channel, each text is a marker")
    stream: str = option("", "XDF: name of the EEG stream, name#2 where several share it, or its source id")
    stream_rate: str = option(
        "nominal",
        "XDF: the sampling rate that the stream states, or the one by the clock",
        choices=("nominal", "measured"),
    )
    rate_tolerance: float = option(
        0.01,
        "XDF, table: share by which the measured rate may differ before the nominal one is refused",
        low=0,
        high=1,
        share=True,
    )

    @property
    def moves(self) -> bool:
        """Whether the trials are moves on the grid; those of any other recording are its events."""
        return self.source not in ("file", "bids")

    @classmethod
    def reading(cls) -> tuple[str, ...]:
        """Return the options of recordings that are read."""
        return tuple(f.name for f in fields(Source) if f.name != "source")


def users(name: str) -> tuple[str, ...]:
    """Return the sources that have a use for an option of recordings that are read."""
    return _SOURCES.get(name, _READ)
