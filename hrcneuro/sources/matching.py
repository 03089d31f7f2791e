"""Which marker is a movement onset: codes counted and matched to the rows of the log.

The authors' code for a movement onset is not documented, so the counts decide: a code that occurs as often as the log
has rows, with the practice blocks or without. Anything else is refused, with both sides shown.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources.expected import Expected, expected_markers
from hrcneuro.sources.experiments import Onset

# A move starts when the one before is over: a marker closer than this share of the shortest usual gap is none.
_TOO_CLOSE = 0.75
# How far from an episode's start its pause is looked for, in moves.
_NEAR = 2
# Of the episodes' starts: where more lack their pause than this, it is not a marker that is lost but another log.
_ANOTHER_LOG = 0.25


@dataclass(frozen=True)
class Match:
    """A log matched to markers: ``onsets_s`` has one value a row of the log, NaN for rows without a marker."""

    event: str
    onsets_s: np.ndarray
    notes: list[str]


def match_onsets(
    markers: pd.DataFrame, trials: pd.DataFrame, *, event: str = "", subject: str = "", begun: Sequence[Onset] = ()
) -> Match:
    """Return the onset of every row of a log.

    Args:
        markers: Columns onset_s and event, in order of time.
        trials: The log's rows in order, with practice, block and episode.
        event: The onset's code where known; codes joined by ``+`` count together. Empty: found by counting.
        subject: Named in messages.
        begun: Whose motion has begun, in order, where that is known: a marker each.

    Raises:
        DataError: The recording has no markers, or no code fits the log; the message shows the first disagreement
            and how often each code and each block occurs.
        ConfigError: ``event`` names a code that does not occur, or several codes fit.
    """
    if markers.empty:
        raise DataError(
            f"the recording of {subject} has no markers; its log has {len(trials)} moves",
            cure="check that the recording was saved with its events",
        )
    wanted = expected_markers(trials, begun)
    names = _named(event, markers) if event else _by_count(markers, wanted, subject)
    onsets = _onsets(markers, names)
    if (found := next((one[len(onsets)] for one in wanted if len(onsets) in one), None)) is None:
        raise DataError(
            disagreement(markers, trials, names, subject=subject, begun=begun),
            cure="check that recording and log are of the same subject and complete; if another code marks the "
            "onsets, name it (acquire.onset_event); hrcneuro acquire SUBJECT --inspect shows both sides",
        )
    notes = [f"movement onsets: code {'+'.join(names)}, {len(onsets)} markers for {len(trials)} rows of the log"]
    notes += found.notes
    known = found.rows >= 0
    onsets, rows = onsets[known], found.rows[known]
    filled = np.full(len(trials), np.nan)
    filled[rows] = onsets
    if where := first_misplaced(onsets, trials.iloc[rows]):
        raise DataError(
            f"{subject} has as many markers {'+'.join(names)} as {found.what} ({len(found.rows)}), but not of the same "
            f"moves: {where}",
            cure="check that recording and log are of the same subject; where one marker is lost and one too many, "
            "mend the recording's events, or leave the subject out (study.exclude)",
        )
    share = separation(onsets, trials.iloc[rows])
    notes.append(f"pauses between markers fall between the log's episodes: {share:.3f} (1 always, 0.5 by chance)")
    return Match("+".join(names), filled, notes)


def histogram(markers: pd.DataFrame) -> dict[str, int]:
    """Return how often each marker occurs, the most frequent first."""
    counts = markers["event"].value_counts(sort=False)
    return {str(name): int(counts[name]) for name in sorted(counts.index, key=lambda n: (-counts[n], str(n)))}


def block_rows(trials: pd.DataFrame) -> dict[str, int]:
    """Return the log's number of rows a block, practice blocks as ``Test 1``, main blocks as ``BLOCK 1``."""
    return {str(name): int(n) for name, n in _labels(trials).value_counts(sort=False).items()}


def listed(counts: Mapping[str, int]) -> str:
    """Return counts as one line of text."""
    return ", ".join(f"{name} × {n}" for name, n in counts.items()) or "none"


def separation(onsets: np.ndarray, trials: pd.DataFrame) -> float:
    """Return how well the pauses between onsets tell the log's episodes apart.

    It is the probability that the time before an episode's first move is longer than that before another move (the
    area under the ROC curve), 1.0 where there is nothing to tell apart.
    """
    from scipy.stats import rankdata

    first = ~trials.duplicated(["practice", "block", "episode"]).to_numpy()[1:]
    n, m = int(first.sum()), int((~first).sum())
    if not n or not m:
        return 1.0
    ranks = rankdata(np.diff(onsets))
    return float((ranks[first].sum() - n * (n + 1) / 2) / (n * m))


def first_misplaced(onsets: np.ndarray, trials: pd.DataFrame) -> str:
    """Return where markers and rows of equal number part, in words; an empty string where they agree.

    Two things tell: before the first move of each of the log's episodes lies a pause, and no marker follows another
    faster than moves do. Within an episode a lost marker and one too many leave no other trace.

    Args:
        onsets: ndarray, shape (n,), of the markers, s, ascending.
        trials: As many rows of the log, with practice, block and episode.
    """
    gaps = np.diff(onsets)
    starts = np.flatnonzero(~trials.duplicated(["practice", "block", "episode"]).to_numpy()[1:])
    inside = np.setdiff1d(np.arange(len(gaps)), starts)
    if not len(starts) or not len(inside):
        return ""
    # A break between blocks is longer than the pause between episodes, by which all are judged where there is one.
    between = np.setdiff1d(starts, np.flatnonzero(~trials.duplicated(["practice", "block"]).to_numpy()[1:]))
    usual, long = float(np.median(gaps[inside])), float(np.median(gaps[between if len(between) else starts]))
    # Half-way between the two, in proportion.
    pause = float(np.sqrt(usual * long))
    short = gaps[starts] < pause
    if short.mean() > _ANOTHER_LOG or long < 1.2 * usual:
        return (
            f"{int(short.sum())} of the log's {len(starts)} episodes begin without a pause before their marker: the "
            "log seems to be another subject's"
        )
    near = np.array([np.any(gaps[_beside(int(at), starts, len(gaps))] >= pause) for at in starts])
    moved = starts[short & near]
    least = _TOO_CLOSE * float(np.quantile(gaps, 0.02))
    close = np.flatnonzero(gaps < least)
    if not len(moved) and not len(close):
        return ""
    first = int(min([*moved[:1], *close[:1]]))
    row = trials.iloc[first + 1]
    place = f"{_labels(trials).iloc[first + 1]}, episode {row.episode}"
    if first in moved:
        return (
            f"{place} begins with the marker at {onsets[first + 1]:.3f} s, {gaps[first]:.2f} s after the one before; "
            f"the pause between episodes ({pause:.2f} s or more) lies beside it: before it a marker is lost or one too "
            "many"
        )
    return (
        f"in {place} the marker at {onsets[first + 1]:.3f} s follows {gaps[first]:.3f} s after the one before; moves "
        f"do not follow faster than {least:.2f} s: it is one too many, and another is lost"
    )


def _beside(at: int, starts: np.ndarray, n: int) -> np.ndarray:
    """Return the gaps within an episode that lie next to an episode's start."""
    return np.setdiff1d(np.arange(max(at - _NEAR, 0), min(at + _NEAR + 1, n)), starts)


def disagreement(
    markers: pd.DataFrame, trials: pd.DataFrame, names: list[str], *, subject: str = "", begun: Sequence[Onset] = ()
) -> str:
    """Return what differs between markers and log: totals, the first block and episode, and both histograms."""
    counts = histogram(markers)
    wanted = {count: one for expected in reversed(expected_markers(trials, begun)) for count, one in expected.items()}
    names = names or [min(counts, key=lambda c: min(abs(counts[c] - n) for n in wanted))]
    onsets = _onsets(markers, names)
    nearest = min(wanted, key=lambda n: abs(n - len(onsets)))
    rows = wanted[nearest].rows
    text = [
        f"the markers of {subject or 'the recording'} do not match its log: "
        f"{len(trials)} rows ({len(trials) - int(trials['practice'].sum())} without practice), "
        f"{f'{len(begun)} motions that began, ' if begun else ''}"
        f"code {'+'.join(names)} occurs {len(onsets)} times ({len(onsets) - nearest:+d})",
        f"  first disagreement: {_first_difference(onsets, trials.iloc[rows[rows >= 0]])}",
        f"  markers: {listed(counts)}",
        f"  log rows: {listed(block_rows(trials))}",
    ]
    pairs = [f"{a}+{b}" for a, b in itertools.combinations(counts, 2) if counts[a] + counts[b] in wanted]
    if pairs:
        text.append(f"  together these occur as often as the log has rows: {', '.join(pairs[:3])}")
    return "\n".join(text)


def _onsets(markers: pd.DataFrame, names: list[str]) -> np.ndarray:
    return markers.loc[markers["event"].isin(names), "onset_s"].to_numpy(float)


def _named(event: str, markers: pd.DataFrame) -> list[str]:
    have = histogram(markers)
    # A code of that whole name comes before a sum of two.
    names = [event] if event in have else list(dict.fromkeys(name.strip() for name in event.split("+")))
    for name in names:
        if name not in have:
            raise ConfigError(
                f"acquire.onset_event = {event!r}: the recording has no marker {name!r}{did_you_mean(name, have)}; "
                f"its markers: {listed(have)}",
                cure="name a marker that occurs, or leave acquire.onset_event empty to count",
            )
    return names


def _by_count(markers: pd.DataFrame, wanted: list[dict[int, Expected]], subject: str) -> list[str]:
    """Return the only code whose count fits, by the likeliest kind of which one does; or none."""
    counts = histogram(markers)
    fits = next((fits for one in wanted if (fits := [name for name, count in counts.items() if count in one])), [])
    if len(fits) > 1:
        first = {name: float(_onsets(markers, [name])[0]) for name in fits}
        raise ConfigError(
            f"several codes of {subject} occur as often as the log has rows: "
            + ", ".join(f"{name} (first at {first[name]:.3f} s)" for name in sorted(fits, key=first.__getitem__)),
            cure=f"say which marks the onset: acquire.onset_event = '{min(fits, key=first.__getitem__)}'",
        )
    return fits


def _first_difference(onsets: np.ndarray, trials: pd.DataFrame) -> str:
    """Return the first block, and in it the first episode, whose number of rows and markers differ.

    Blocks and episodes are told apart in the recording by the longest pauses between markers.
    """
    labels = _labels(trials)
    blocks = list(dict.fromkeys(labels))
    runs = _cut(onsets, len(blocks))
    for block, run in zip(blocks, runs, strict=False):
        rows = trials[(labels == block).to_numpy()]
        if len(run) == len(rows):
            continue
        sizes = rows.groupby("episode", sort=False).size()
        parts = _cut(run, len(sizes))
        where = f"{block} has {len(rows)} rows and {len(run)} markers"
        for (episode, size), part in zip(sizes.items(), parts, strict=False):
            if size != len(part):
                return f"{where}; its episode {episode} {size} rows and {len(part)} markers, from {part[0]:.3f} s"
        return where
    return f"row {min(len(onsets), len(trials)) + 1} of the log"


def _cut(onsets: np.ndarray, pieces: int) -> list[np.ndarray]:
    """Return the onsets in ``pieces`` runs, cut at the longest pauses."""
    if pieces < 2 or len(onsets) < pieces:
        return [onsets] if len(onsets) else []
    longest = np.argsort(-np.diff(onsets), kind="stable")[: pieces - 1]
    return np.split(onsets, np.sort(longest) + 1)


def _labels(trials: pd.DataFrame) -> pd.Series:
    kind = trials["practice"].map({True: "Test", False: "BLOCK"})
    return kind.astype(str) + " " + trials["block"].astype(str)
