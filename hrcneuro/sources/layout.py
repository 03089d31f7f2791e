"""Where a subject's files lie, and whether they are what their names say. No numeric library: every plan asks this."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources import bids_layout, experiments
from hrcneuro.sources.formats import READABLE, is_recording
from hrcneuro.sources.formats.companions import companions
from hrcneuro.sources.formats.named import find_path, is_there
from hrcneuro.sources.formats.statements import describing_files
from hrcneuro.sources.parameters import Source
from hrcneuro.sources.pointers import refuse_broken_link

SUBJECT = "{subject}"


def dataset_files(folder: str, subject: str, *, eeg: bool = True) -> dict[str, Path]:
    """Return label -> file of one subject in the authors' layout: ``sNN/sNN.set``, ``.fdt``, ``subjectNN.csv``,
    ``metadataNN.csv``.

    Labels are ``set``, ``fdt``, ``log`` and ``metadata``, and ``kept`` where an experiment wrote the log. Without
    ``eeg`` only the logs are asked for. The ``.fdt`` and the metadata are left out where they are absent: a ``.set``
    may hold its own data.

    Raises:
        ConfigError: No path is configured.
        DataError: The folder, the subject, its recording or its log is missing.
    """
    root = _root(folder)
    if not root.is_dir():
        raise DataError(
            f"the data folder {root} {'is a file' if root.exists() else 'does not exist'}",
            cure="name the folder that holds s01, s02 …: --set acquire.path=FOLDER",
        )
    home = root / subject
    if not home.is_dir():
        have = sorted(p.name for p in root.iterdir() if p.is_dir() and re.fullmatch(r"s\d+", p.name))
        raise DataError(
            f"{root} has no subject {subject!r}{did_you_mean(subject, have)}; subjects found: {_span(have)}",
            cure="name one of them, or point acquire.path to the folder that holds the subject",
        )
    names = log_names(subject)
    files = {"log": home / names["log"]}
    if eeg:
        files["set"] = home / f"{subject}.set"
    for label, path in files.items():
        refuse_broken_link(path)
        if not path.is_file():
            raise DataError(
                f"{subject} has no {path.name} ({'recording' if label == 'set' else 'log'}); "
                f"{home} holds {_span(sorted(p.name for p in home.iterdir()))}",
                cure=_missing(label),
            )
    metadata = home / names["metadata"]
    optional = {"metadata": metadata} if is_there(metadata) else {}
    return _whole(files | optional | _kept(files["log"]) | (companions(files["set"]) if eeg else {}))


def log_names(subject: str) -> dict[str, str]:
    """Return label -> name of a subject's ``log`` and ``metadata`` in the authors' layout; s01's are subject01.csv and
    metadata01.csv."""
    number = subject.lstrip("s")
    return {"log": f"subject{number}.csv", "metadata": f"metadata{number}.csv"}


def _kept(log: Path) -> dict[str, Path]:
    """Return what an experiment kept beside its log: it decides how the log is read."""
    path = log.with_name(experiments.FILE)
    return {"kept": path} if path.is_file() else {}


def foreign_files(options: Source, subject: str) -> dict[str, Path]:
    """Return label -> file of a subject's recordings of any study, and of what goes with them.

    Raises:
        ConfigError, DataError: As :func:`recording_files` and :func:`hrcneuro.sources.bids_layout.files`.
    """
    if options.source == "bids":
        chosen = {"tasks": options.tasks, "sessions": options.sessions, "runs": options.runs}
        return bids_layout.files(options.path, subject, **chosen, event_column=options.event_column)
    return recording_files(options.path, subject)


def recording_files(pattern: str, subject: str) -> dict[str, Path]:
    """Return label -> file of a subject's recordings and their companions (BrainVision's data and markers, EEGLAB's
    ``.fdt``, the parts of a split FIF).

    The recordings themselves have the labels ``recording``, ``recording 2`` …, in the order of their names, numbers in
    them by value.

    Args:
        pattern: ``{subject}`` stands for the subject, ``*`` and ``?`` for any characters, but for those that would
            make the subject's name longer.
        subject: Its name.

    Raises:
        ConfigError: No path is configured, or its format is not among those that can be read.
        DataError: There is no such file; the message names the subjects that are there. A link has lost its file.
    """
    path = _root(pattern.replace(SUBJECT, subject))
    if not path.name.lower().endswith(READABLE):
        what = "is a folder" if path.is_dir() else f"has the ending {path.suffix or '(none)'!r}"
        raise ConfigError(
            f"acquire.path: {path.name} {what}; recordings that can be read: {', '.join(READABLE)}",
            cure=_instead(path, subject),
        )
    refuse_broken_link(path)
    found = [path] if path.is_file() else _matches(pattern, subject)
    if not found:
        have = _subjects(pattern)
        here = f"subjects found: {_span(have)}" if SUBJECT in pattern else f"{path.parent} holds {_siblings(path)}"
        raise DataError(
            f"the recording {path} of {subject} does not exist{did_you_mean(subject, have)}; {here}",
            cure="correct acquire.path, or name a subject that is there",
        )
    files: dict[str, Path] = {}
    for number, one in enumerate(found, start=1):
        mark = "" if number == 1 else f" {number}"
        others = companions(one) | describing_files(one)
        files |= {f"recording{mark}": one} | {f"{label}{mark}": file for label, file in others.items()}
    return _whole(files)


def session_files(pattern: str, subject: str) -> dict[str, Path]:
    """Return label -> file of a subject's recorded session: ``part 1`` … (XDF), ``log`` and ``metadata`` (CSV), and
    ``kept`` where an experiment wrote the log.

    Args:
        pattern: Folder of a recording, ``{subject}`` and ``*`` as in :func:`recording_files`; of several folders all
            parts are taken, and the one log that they hold, or that an experiment wrote one folder above.
        subject: Its name.

    Raises:
        ConfigError: No path is configured.
        DataError: There is no such folder, no part in it, no log, or more than one.
    """
    root = _root(pattern.replace(SUBJECT, subject))
    folders = [root] if root.is_dir() else sorted(p for p in _folders(pattern, subject) if p.is_dir())
    inside = [path for folder in folders for path in sorted(folder.iterdir())]
    parts = [path for path in inside if path.name.lower().endswith((".xdf", ".xdfz"))]
    if not parts:
        where = ", ".join(map(str, folders))
        raise DataError(
            f"{subject} has no recording (.xdf) in {where}" if where else f"the folder {root} does not exist",
            cure="name the folder that 'hrcneuro record' or LabRecorder wrote: acquire.path = 'recordings/{subject}/*'",
        )
    files = {f"part {number}": path for number, path in enumerate(parts, start=1)}
    above = sorted({folder.parent for folder in folders} - set(folders))
    for label, start in (("log", "subject"), ("metadata", "metadata")):
        there = [path for path in inside if re.fullmatch(rf"{start}\d*\.csv", path.name)]
        # A subject of any name has one; above, only this subject's.
        there += [path for folder in (*folders, *above) if (path := folder / log_names(subject)[label]).is_file()]
        there = list(dict.fromkeys(there))
        if len(there) != 1:
            raise DataError(
                f"a session has one {start}NN.csv beside its recording; {', '.join(map(str, folders))} of {subject} "
                f"holds {', '.join(map(str, there)) or 'none'}",
                cure="put the experiment's log there; a recording without one is acquire.source = 'file'",
            )
        files[label] = there[0]
    return _whole(files | _kept(files["log"]))


def _folders(pattern: str, subject: str) -> list[Path]:
    shape = re.compile(_shape(pattern, re.escape(subject)))
    return [path for path in _candidates(pattern, subject) if shape.fullmatch(str(path))]


def recordings(files: dict[str, Path]) -> list[Path]:
    """Return the recordings themselves among a subject's files, in their order."""
    return [path for label, path in files.items() if re.fullmatch(r"recording( \d+)?", label)]


def _instead(path: Path, subject: str) -> str:
    """Return what to write for a folder: the recordings of the subject that lie in it."""
    if path.suffix.lower() == ".mff":
        return "export it from Net Station as simple binary (.raw), or save it as FIF with mne.io.read_raw_egi"
    if path.is_dir() and any(path.glob("sub-*")) and (path / "dataset_description.json").is_file():
        return f"it is a BIDS data set: acquire.source = 'bids', acquire.path = {str(path)!r}"
    if path.is_dir():
        inside = (f"sub-{subject}", subject, ".")
        under = (p for name in inside for p in sorted((path / name).rglob("*")) if (path / name).is_dir())
        hit = next((p for p in under if is_recording(p) and is_there(p)), None)
        if hit is not None:
            # In sub-01_run-01 only the first is the subject.
            label = f"sub-{subject}" if f"sub-{subject}" in str(hit) else subject
            named = str(hit).replace(label, label.replace(subject, SUBJECT))
            return f"name a file, such as acquire.path = {named!r} (several runs: * in place of what differs)"
    return "name the recording's header file, with {subject} where the subjects' paths differ"


def _matches(pattern: str, subject: str) -> list[Path]:
    """Return the files that a pattern with ``*`` or ``?`` fits, in the order of their names."""
    if not re.search(r"[*?]", pattern):
        return []
    shape = re.compile(_shape(pattern, re.escape(subject)))
    hits = [path for path in _candidates(pattern, subject) if shape.fullmatch(str(path)) and is_there(path)]
    # A pattern may also fit the later parts of a split file.
    parts = {part for path in hits for part in companions(path).values() if path.is_file()}
    return sorted((path for path in hits if path not in parts), key=_by_numbers)


def _candidates(pattern: str, subject: str) -> Iterator[Path]:
    """Yield the paths that a pattern may fit; every subject where ``subject`` is ``*``."""
    parts = Path(pattern).expanduser().parts
    first = next((i for i, part in enumerate(parts) if re.search(r"[*?]", part) or SUBJECT in part), len(parts) - 1)
    named = (part.replace("[", "[[]").replace(SUBJECT, subject) for part in parts[first:])
    return Path(*parts[:first]).glob("/".join(named))


def _shape(pattern: str, subject: str) -> str:
    """Return the pattern as a regular expression, with that expression for the subject."""
    # After a subject, a * stands for no letter or digit: S1* is not S10.
    ends = re.escape(SUBJECT) + r"\*"
    text = re.escape(str(Path(pattern).expanduser())).replace(ends, re.escape(SUBJECT) + "(?![^\\W_])" + r"\*")
    text = text.replace(r"\*", "[^/]*").replace(r"\?", "[^/]")
    return text.replace(re.escape(SUBJECT), subject)


def _by_numbers(path: Path) -> list[tuple[int, str]]:
    """Sort run 10 behind run 9."""
    return [(int(piece), "") if piece.isdigit() else (-1, piece) for piece in re.split(r"(\d+)", str(path)) if piece]


def _whole(files: dict[str, Path]) -> dict[str, Path]:
    """Return the files; refuse a link among them whose target is not here, since its content decides the result."""
    for path in files.values():
        refuse_broken_link(path)
    return files


def _root(path: str) -> Path:
    if not path:
        raise ConfigError(
            "acquire.path is empty; the source needs to know where its files lie",
            cure='--set acquire.path=PATH, or path = "…" under [acquire]',
        )
    return find_path(Path(path).expanduser())


def _missing(label: str) -> str:
    if label == "log":
        return "the log is part of the authors' repository: check that the checkout is complete (git status)"
    return (
        "the recording is part of the authors' repository (git lfs pull where it uses LFS); to use the logs with "
        "synthetic EEG: --set acquire.source=semisynthetic"
    )


def _subjects(pattern: str) -> list[str]:
    """Return the subjects for which a file of the pattern exists."""
    if SUBJECT not in pattern:
        return []
    # The same subject may stand in the path several times: a backreference asks that they agree.
    text = _shape(pattern, "(?P<subject>[^/]+)")
    first, mark, rest = text.partition("(?P<subject>[^/]+)")
    shape = re.compile(first + mark + rest.replace(mark, "(?P=subject)"))
    hits = (shape.fullmatch(str(p)) for p in _candidates(pattern, "*"))
    return sorted({hit["subject"] for hit in hits if hit})


def _siblings(path: Path) -> str:
    if not path.parent.is_dir():
        return "nothing (the folder does not exist)"
    ending = path.suffix.lower()
    return _span(sorted(p.name for p in path.parent.iterdir() if is_recording(p) or p.suffix.lower() == ending))


def _span(names: list[str], most: int = 12) -> str:
    if len(names) > most:
        return f"{', '.join(names[: most - 1])} … {names[-1]}"
    return ", ".join(names) or "none"
