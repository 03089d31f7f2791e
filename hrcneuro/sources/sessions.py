"""A recorded session: one or more XDF parts and the experiment's log, brought together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from hrcneuro.eeg.latency import nearest
from hrcneuro.errors import DataError
from hrcneuro.live.part import began, number_of
from hrcneuro.paradigm.markers import move_in
from hrcneuro.sources import dataset, experiments, joining, triggers
from hrcneuro.sources.formats.packed import unpacked
from hrcneuro.sources.logs import read_log_files
from hrcneuro.sources.origin import with_log
from hrcneuro.sources.parameters import Source
from hrcneuro.sources.recording import Recording

_WIDE_S = 0.3  # the next move's edge is farther away than that
_FEW, _MOST = 5, 0.8  # of so many edges, so large a share agrees where a delay is common to all
_KEYS = ("practice", "block", "episode", "trial")


@dataclass(frozen=True)
class Onsets:
    """When the moves of a log began, in the recording; a value a row of the log.

    Attributes:
        marker_s: By the markers, s from the first sample; NaN where there is none.
        trigger_s: By the edges of the trigger channel; NaN where there is none near the marker.
        onset_s: The trigger's, else the marker's and the amplifier's delay.
    """

    marker_s: np.ndarray
    trigger_s: np.ndarray
    onset_s: np.ndarray


def read(files: dict[str, Path], options: Source) -> Recording:
    """Return the recording in a session's files, as :func:`hrcneuro.sources.layout.session_files` gives them.

    Raises:
        DataError, ConfigError: A part cannot be read, or parts cannot be joined.
    """
    xdf = {name: getattr(options, name) for name in ("stream", "stream_rate", "rate_tolerance")}
    parts = [path for label, path in files.items() if label.startswith("part ")]
    recording = joining.read_joined(in_order(parts), **xdf)
    recording.origins = with_log(recording.origins, files)
    recording.notes += experiments.notes_of(files["log"])
    return recording


def read_moves(files: dict[str, Path]) -> pd.DataFrame:
    """Return the annotated moves of a session's log.

    Raises:
        DataError: The log is truncated or contradicts its metadata.
    """
    return read_log_files(files["log"], files["metadata"])


def match(
    recording: Recording,
    log: pd.DataFrame,
    subject: str,
    options: Source,
    *,
    begun: Sequence[experiments.Onset] = (),
) -> Onsets:
    """Return when each move of the log began; notes and warnings go to the recording, whose channels are shaped.

    By the markers that name their moves; where there are none, by counting the triggers, else the markers.

    Args:
        recording: Of all parts.
        log: Its moves.
        subject: Whose session.
        options: How markers and triggers are read.
        begun: As :func:`hrcneuro.sources.experiments.onsets_of` gives it.

    Raises:
        DataError, ConfigError: Markers and log cannot be used together; the message says where they differ.
    """
    markers = None if options.onset_event else _named(recording, log, subject)
    if markers is None:
        by_trigger = _counts_triggers(recording, options)
        if by_trigger:
            # They stand in the EEG itself: nothing needs to be found near them.
            channel = "channel" if options.markers == "auto" else options.markers
            triggers.choose_markers(recording, channel, mask=options.trigger_mask)
        onsets_s = dataset.match(recording, log, subject, onset_event=options.onset_event, begun=begun).onsets_s
        if by_trigger:
            return Onsets(np.full(len(log), np.nan), onsets_s, onsets_s)
        markers = onsets_s
    edges = _edges(recording, options)
    onsets = snapped(markers, edges, window_s=options.snap_s, delay_s=options.amp_delay_ms / 1000)
    _tell(recording, onsets, options)
    return onsets


def in_order(parts: list[Path]) -> list[Path]:
    """Return the parts of a session by the time of day at which they were begun: LSL's clock may have begun anew.

    ``part1.xdf``, ``part2.xdf`` … of one folder are in the order of their numbers, whatever was set of the clock.
    """
    folders: dict[Path, list[Path]] = {}
    for path in parts:
        folders.setdefault(path.parent, []).append(path)
    ordered = [sorted(inside, key=_place(inside)) for inside in folders.values()]
    return [path for inside in sorted(ordered, key=lambda one: (_begun(one[0]), str(one[0]))) for path in inside]


def _place(inside: list[Path]) -> Callable[[Path], tuple[float, str]]:
    """Return by what the parts of a folder are sorted: their numbers, where all have one, else their time of day."""
    if all(number_of(path) for path in inside):
        return lambda path: (float(number_of(path)), "")
    return lambda path: (_begun(path), str(path))


def _begun(path: Path) -> float:
    """Return when a file says that it was begun, s since 1970; 0 where it does not say."""
    with unpacked(path) as file:
        return began(file.read(1024))


def _counts_triggers(recording: Recording, options: Source) -> bool:
    """Return whether triggers are counted, and not markers: the amplifier has seen some, and no marker is asked for."""
    if options.onset_event and options.onset_event in set(recording.markers["event"]):
        return False
    return bool(len(_edges(recording, options)))


def _named(recording: Recording, log: pd.DataFrame, subject: str) -> np.ndarray | None:
    """Return the time of each row's marker, by the move that it names; None where no marker names one."""
    named = by_name(recording.markers, log, subject)
    if named is None:
        return None
    onsets, twice, strange = named
    known = int(np.isfinite(onsets).sum())
    recording.notes.append(f"movement onsets: markers that name their move, {known} for {len(log)} rows of the log")
    if twice:
        recording.notes.append(f"{twice} moves have more than one marker: the last one counts")
    if strange:
        recording.warnings.append(f"{strange} markers name moves that are not in the log of {subject}")
    if known < len(log):
        recording.warnings.append(f"{len(log) - known} moves of the log have no marker and are left out")
    return onsets


def by_name(markers: pd.DataFrame, log: pd.DataFrame, subject: str) -> tuple[np.ndarray, int, int] | None:
    """Return (time of each row's marker, rows with several, markers of no row); None where no marker names a move.

    Raises:
        DataError: The markers name another subject, or no row of the log.
    """
    moves = [
        (at, move)
        for at, text in zip(markers["onset_s"], markers["event"], strict=True)
        # In closed blocks, which have a log of their own, the robot draws who acts: they are no part of the study.
        if (move := move_in(text)) and not move["closed"]
    ]
    if not moves:
        return None
    whose = sorted({str(move["subject"]) for _, move in moves} - {subject})
    if whose:
        raise DataError(
            f"the markers are of {', '.join(whose)}, and the log is of {subject}",
            cure="point acquire.path to the recordings of this subject",
        )
    rows = {tuple(row): number for number, row in enumerate(log[list(_KEYS)].itertuples(index=False))}
    onsets = np.full(len(log), np.nan)
    twice = strange = 0
    for at, move in moves:
        row = rows.get(tuple(move[name] for name in _KEYS))
        if row is None:
            strange += 1
            continue
        twice += bool(np.isfinite(onsets[row]))
        onsets[row] = at
    if strange == len(moves):
        raise DataError(
            f"none of the {len(moves)} markers of moves names a row of the log of {subject}",
            cure="check that log and recording are of the same session",
        )
    return onsets, twice, strange


def _edges(recording: Recording, options: Source) -> np.ndarray:
    """Return when the trigger channel shows something, s; none where there is no such channel, or it is not wanted."""
    if options.markers == "annotations" or not recording.picks("stim"):
        return np.zeros(0)
    found = triggers.of_channel(recording, options.markers, mask=options.trigger_mask)
    recording.notes += found.notes
    return found.samples / recording.sfreq


def snapped(marker_s: np.ndarray, edges_s: np.ndarray, *, window_s: float, delay_s: float = 0.0) -> Onsets:
    """Return each onset at the trigger's edge nearest to its marker, within a window; else at the marker.

    The window lies about the delay that the markers have in common, where they have one: edges that come about as late
    as the window is wide would else time some of the moves, and markers the others. A move without an edge is timed by
    that same delay.

    Args:
        marker_s: ndarray, shape (n_rows,), s from the first sample; NaN where there is none.
        edges_s: ndarray, shape (n_edges,), s, ascending.
        window_s: How far an edge may be from its marker.
        delay_s: How much later than it happened the amplifier's stamps show something; where edges say otherwise, what
            they say counts.
    """
    delay_s = _common_delay(marker_s, edges_s, window_s=window_s, delay_s=delay_s)
    at = nearest(marker_s, edges_s, window=window_s, expected=delay_s)
    trigger = np.where(at >= 0, edges_s[at], np.nan) if len(edges_s) else np.full(len(marker_s), np.nan)
    expected = marker_s + delay_s
    return Onsets(marker_s, trigger, np.where(np.isfinite(trigger), trigger, expected))


def _common_delay(marker_s: np.ndarray, edges_s: np.ndarray, *, window_s: float, delay_s: float) -> float:
    """Return by how much most edges lie behind their markers, s; ``delay_s`` where few have one, or they disagree."""
    at = nearest(marker_s, edges_s, window=_WIDE_S, expected=delay_s)
    late = edges_s[at[at >= 0]] - marker_s[at >= 0]
    if len(late) < _FEW:
        return delay_s
    middle = float(np.median(late))
    agree = np.abs(late - middle) <= window_s
    return middle if agree.mean() >= _MOST else delay_s


def _tell(recording: Recording, onsets: Onsets, options: Source) -> None:
    both = np.isfinite(onsets.trigger_s)
    known = int(np.isfinite(onsets.marker_s).sum())
    if not len(recording.picks("stim")) or options.markers == "annotations":
        why = "no trigger channel is there" if not len(recording.picks("stim")) else "no trigger channel is asked for"
        recording.notes.append(f"{why}: onsets are the markers' and {options.amp_delay_ms:g} ms")
        return
    if not both.any():
        recording.warnings.append(f"no edge of the trigger channel lies within {options.snap_s:g} s of a marker")
        return
    difference = 1000 * (onsets.trigger_s - onsets.marker_s)[both]
    recording.notes.append(
        f"onsets are the trigger channel's edges: {int(both.sum())} of {known}, "
        f"{np.median(difference):.1f} ms after their markers (SD {difference.std():.1f} ms)"
    )


def table(log: pd.DataFrame, onsets: Onsets, subject: str) -> pd.DataFrame:
    """Return a row a move of the log: which it is, and when it began by its marker and by its trigger."""
    times = {"marker_s": onsets.marker_s, "trigger_s": onsets.trigger_s, "onset_s": onsets.onset_s}
    difference_ms = 1000 * (onsets.trigger_s - onsets.marker_s)
    return log[list(_KEYS)].assign(subject=subject, **times, difference_ms=difference_ms)
