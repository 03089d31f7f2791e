"""A recording as a study's options have it: read, its channels shaped, its events chosen."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from hrcneuro.sources import bids, channels, layout, triggers
from hrcneuro.sources.events import select_events
from hrcneuro.sources.formats import OPTIONS
from hrcneuro.sources.joining import read_joined
from hrcneuro.sources.parameters import Source
from hrcneuro.sources.recording import Recording
from hrcneuro.sources.sidecars import refuse_events_elsewhere


def read(files: dict[str, Path], options: Source) -> Recording:
    """Return the recording in a subject's files, as :func:`hrcneuro.sources.layout.foreign_files` gives them.

    Raises:
        DataError, ConfigError: It cannot be read, or runs cannot be joined.
    """
    if options.source == "bids":
        return bids.read(files, options)
    return read_joined(layout.recordings(files), **{name: getattr(options, name) for name in OPTIONS})


def shape(recording: Recording, options: Source) -> None:
    """Give channels their names, types, units and places, and the recording its markers, in place.

    Raises:
        ConfigError, DataError: As :func:`shape_channels` and :func:`choose_markers`.
    """
    shape_channels(recording, options)
    choose_markers(recording, options)


def shape_channels(recording: Recording, options: Source) -> None:
    """Give channels their names, types, units and places, in place.

    Raises:
        ConfigError, DataError: As :func:`hrcneuro.sources.channels.shape`.
    """
    channels.shape(
        recording,
        rename=options.channel_map,
        types=options.channel_types,
        drop=options.drop,
        bads=options.bads,
        montage=options.montage,
        unit=options.unit,
    )


def choose_markers(recording: Recording, options: Source) -> None:
    """Give a recording whose channels are shaped its markers, in place, where annotations are not its only ones.

    Raises:
        ConfigError: As :func:`hrcneuro.sources.triggers.choose_markers`.
    """
    if options.source == "file":
        triggers.choose_markers(recording, options.markers, mask=options.trigger_mask)


def events(recording: Recording, files: dict[str, Path], options: Source) -> pd.DataFrame:
    """Return the study's events, columns onset_s and event.

    Raises:
        DataError, ConfigError: As :func:`hrcneuro.sources.events.select_events`; or the events stand in a table beside
            the recording.
    """
    if options.source == "file" and recording.markers.empty and not recording.spans:
        refuse_events_elsewhere(files["recording"])
    return select_events(recording, options.event_map, least_gap_s=options.least_gap_s, twins=options.twins)
