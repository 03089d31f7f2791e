"""A BIDS data set as it lies on disk: its subjects, and each one's recordings with the tables that go with them.

No numeric library: every plan asks this, so that whatever a data set lacks is known before anything runs.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources.bids_channels import announced_rows, channel_rows, refuse_unequal
from hrcneuro.sources.bids_events import naming_column
from hrcneuro.sources.bids_tables import Row, read_rows
from hrcneuro.sources.formats.companions import companions
from hrcneuro.sources.formats.named import find_path
from hrcneuro.sources.formats.statements import describing_files
from hrcneuro.sources.pointers import refuse_broken_link

FORMATS = (".vhdr", ".edf", ".bdf", ".set")
"""What BIDS allows of EEG."""
_ORDER = ("ses", "task", "run", "split")
"""What of a recording's name tells it from the subject's others, and in which order they are joined."""


def root_of(path: str) -> Path:
    """Return the root of a data set.

    Raises:
        ConfigError: No path is configured.
        DataError: There is no such folder, or no subject in it.
    """
    if not path:
        raise ConfigError(
            "acquire.path is empty; source = 'bids' needs the root of a BIDS data set",
            cure='--set acquire.path=FOLDER, or path = "…" under [acquire]',
        )
    root = find_path(Path(path).expanduser())
    if not root.is_dir():
        raise DataError(
            f"the BIDS data set {root} {'is a file' if root.exists() else 'does not exist'}",
            cure="name its root, the folder that holds sub-…: acquire.path = 'FOLDER'",
        )
    if not _has_subjects(root):
        near = next((one for one in (*root.absolute().parents, *_inside(root)) if _has_subjects(one)), None)
        raise DataError(
            f"{root} holds no subject (sub-…): it is not the root of a BIDS data set",
            cure=f"name its root: acquire.path = '{near or 'FOLDER'}'",
        )
    return root


def _homes(root: Path) -> Iterator[Path]:
    """Yield the subjects' folders; a recording whose name begins with sub-… is none."""
    return (one for one in root.glob("sub-*") if one.is_dir())


def _has_subjects(root: Path) -> bool:
    return any(True for _ in _homes(root))


def _inside(root: Path) -> list[Path]:
    return sorted(one for one in root.iterdir() if one.is_dir() and not one.name.startswith("."))


def subjects(root: Path) -> tuple[str, ...]:
    """Return the subjects of a data set that have EEG, in the order of participants.tsv, else of their names.

    Raises:
        DataError: There is none; the message says what was looked for.
    """
    homes = list(_homes(root))
    have = {one.name.removeprefix("sub-") for one in homes if any(_candidates(one))}
    if not have:
        raise DataError(
            f"{root} holds {len(homes)} subjects, none with EEG (sub-…/eeg/…_eeg{'|'.join(FORMATS)}, with or without "
            "ses-… between)",
            cure="name the root of a data set that has EEG: acquire.path = 'FOLDER'; recordings of another kind are "
            "read by acquire.source = 'file'",
        )
    listed = [name for name in participants(root) if name in have]
    return (*listed, *sorted(have - set(listed), key=_by_number))


def without_eeg(root: Path, have: Collection[str]) -> list[str]:
    """Return the subjects that participants.tsv lists and that are not among those with EEG, in its order."""
    return [name for name in dict.fromkeys(participants(root)) if name and name not in have]


def participants(root: Path) -> list[str]:
    """Return the subjects that participants.tsv lists, in its order; none where there is no such table."""
    table = root / "participants.tsv"
    rows = read_rows(table) if table.is_file() else []
    return [(row.get("participant_id") or "").removeprefix("sub-") for row in rows]


def name_of(root: Path) -> str:
    """Return the data set's own name; empty where it states none."""
    return str(_json(root / "dataset_description.json").get("Name") or "").strip()


def is_ours(root: Path) -> bool:
    """Return whether hrcneuro wrote the data set: then its tables of events hold the trial table."""
    made = _json(root / "dataset_description.json").get("GeneratedBy")
    return isinstance(made, list) and any(isinstance(one, dict) and one.get("Name") == "hrcneuro" for one in made)


def files(
    path: str,
    subject: str,
    *,
    tasks: Sequence[str] = (),
    sessions: Sequence[str] = (),
    runs: Sequence[str] = (),
    event_column: str = "",
) -> dict[str, Path]:
    """Return label -> file of a subject: recordings in the order of sessions and runs, their companions and tables.

    Labels are ``recording``, ``events``, ``channels``, ``electrodes`` and ``coordsystem``; of further recordings with a
    number behind them, ``events 2``.

    Args:
        path: Root of the data set.
        subject: Its label, without ``sub-``.
        tasks, sessions, runs: Labels of those to take; none named: all, but several tasks are refused.
        event_column: Column of the events that names them; empty: trial_type, else value.

    Raises:
        ConfigError: A task, session or run is not there, or it is not said which of several tasks is meant, or which
            column names all events.
        DataError: There is no such subject, recordings have no events, or do not go together.
    """
    root = root_of(path)
    found = _chosen(root, subject, {"task": tasks, "ses": sessions, "run": runs})
    out: dict[str, Path] = {}
    tables: list[tuple[Path, list[Row]]] = []
    bare: list[Path] = []
    for number, recording in enumerate(found, start=1):
        mark = "" if number == 1 else f" {number}"
        mine = {"recording": recording, **companions(recording), **describing_files(recording)}
        mine |= {
            kind: table for kind in ("events", "channels", "electrodes") if (table := beside(recording, kind, root))
        }
        if place := beside(recording, "coordsystem", root, ".json"):
            mine["coordsystem"] = place
        if "events" not in mine:
            raise DataError(
                f"{recording.relative_to(root)} has no table of events (…_events.tsv)",
                cure="write one with the columns onset, duration and trial_type; where the recording holds its own "
                "events, read it by acquire.source = 'file'",
            )
        if "channels" in mine:
            tables.append((mine["channels"], channel_rows(mine["channels"])))
        else:
            bare.append(recording)
        out |= {f"{label}{mark}": file for label, file in mine.items()}
    # Each among its own kind: a table may name channels otherwise than the recording.
    refuse_unequal(tables)
    if len(bare) > 1:
        refuse_unequal([(one, rows) for one in bare if (rows := announced_rows(one))])
    for file in out.values():
        refuse_broken_link(file)
    naming_column(events_of(out), event_column)
    return out


def events_of(files: Mapping[str, Path]) -> list[Path]:
    """Return the tables of events among a subject's files, one for each recording."""
    return [path for label, path in files.items() if re.fullmatch(r"events( \d+)?", label)]


def beside(recording: Path, kind: str, root: Path, ending: str = ".tsv") -> Path | None:
    """Return the table of a recording: beside it, else in the nearest folder above; None where there is none.

    A table whose name has another session, task or run than the recording's is not its. ``space-…`` in the name of a
    table does not matter.
    """
    parts = {*recording.name.partition(".")[0].split("_")}
    for home in (one for one in recording.parents if one == root or root in one.parents):
        fits = [one for one in sorted(home.glob(f"*{kind}{ending}")) if _entities(one, kind) <= parts]
        if fits:
            # The most specific one counts.
            return max(fits, key=lambda one: len(_entities(one, kind)))
    return None


def _entities(table: Path, kind: str) -> set[str]:
    parts = table.name.partition(".")[0].removesuffix(kind).split("_")
    return {one for one in parts if one and not one.startswith("space-")}


def _json(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _candidates(home: Path) -> Iterator[Path]:
    """Yield the recordings of a subject, of every session."""
    for folder in (home / "eeg", *sorted(home.glob("ses-*/eeg"))):
        for path in sorted(folder.iterdir()) if folder.is_dir() else ():
            stem, ending = path.name.partition(".")[0], path.suffix.lower()
            if stem.endswith("_eeg") and ending in FORMATS:
                yield path


def _chosen(root: Path, subject: str, wanted: dict[str, Sequence[str]]) -> list[Path]:
    home = root / f"sub-{subject}"
    found = list(_candidates(home))
    if not found:
        have = subjects(root)
        raise DataError(
            f"{root} has no EEG of {subject!r} (sub-{subject}/…/eeg/…_eeg{'|'.join(FORMATS)})"
            f"{did_you_mean(subject, have)}; subjects with EEG: {', '.join(have[:12]) or 'none'}",
            cure="name a subject that is there (study.subjects, labels without sub-)",
        )
    for key, labels in wanted.items():
        option = {"task": "tasks", "ses": "sessions", "run": "runs"}[key]
        here = sorted({_entity(path, key) for path in found}, key=_by_number)
        if lacking := [one for one in labels if one not in here]:
            raise ConfigError(
                f"acquire.{option} names {lacking[0]!r}{did_you_mean(lacking[0], [one for one in here if one])}; "
                f"{subject} has {', '.join(one or '(none named)' for one in here)}",
                cure=f"correct acquire.{option}",
            )
        if key == "task" and not labels and len(here) > 1:
            raise ConfigError(
                f"{subject} has recordings of several tasks: {', '.join(here)}",
                cure=f"say which: acquire.tasks = ['{here[0]}']",
            )
        found = [path for path in found if not labels or _entity(path, key) in labels]
    if not found:
        raise ConfigError(
            f"{subject} has no recording of all that acquire.tasks, acquire.sessions and acquire.runs name",
            cure="leave one of them out",
        )
    found = sorted(found, key=lambda path: [_by_number(_entity(path, key)) for key in _ORDER])
    for one, two in pairwise(found):
        if all(_entity(one, key) == _entity(two, key) for key in _ORDER):
            raise DataError(
                f"{one.name} and {two.name} are of the same session, task and run: joined, trials would count twice",
                cure="leave one of them out of a copy of the data set, or read it by acquire.source = 'file'",
            )
    return found


def _entity(path: Path, key: str) -> str:
    found = re.search(rf"(?:^|_){key}-([^_]+)", path.name)
    return found[1] if found else ""


def _by_number(label: str) -> list[tuple[int, str]]:
    """Sort run 10 behind run 9."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", label) if part]
