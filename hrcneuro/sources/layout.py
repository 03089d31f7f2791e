"""Where a subject's files lie, and whether they are what their names say. No numeric library: every plan asks this."""

from __future__ import annotations

import re
from pathlib import Path

from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources.formats import READABLE
from hrcneuro.sources.formats.companions import companions
from hrcneuro.sources.formats.named import is_there
from hrcneuro.sources.formats.statements import describing_files
from hrcneuro.sources.pointers import refuse_broken_link

SUBJECT = "{subject}"


def dataset_files(folder: str, subject: str, *, eeg: bool = True) -> dict[str, Path]:
    """Return label -> file of one subject in the authors' layout: ``sNN/sNN.set``, ``.fdt``, ``subjectNN.csv``,
    ``metadataNN.csv``.

    Labels are ``set``, ``fdt``, ``log`` and ``metadata``. Without ``eeg`` only the logs are asked for. The ``.fdt``
    and the metadata are left out where they are absent: a ``.set`` may hold its own data.

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
    number = subject.lstrip("s")
    files = {"log": home / f"subject{number}.csv"}
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
    metadata = home / f"metadata{number}.csv"
    optional = {"metadata": metadata} if is_there(metadata) else {}
    return _whole(files | optional | (companions(files["set"]) if eeg else {}))


def recording_files(pattern: str, subject: str) -> dict[str, Path]:
    """Return label -> file of a recording and its companions (BrainVision's data and markers, EEGLAB's ``.fdt``,
    the parts of a split FIF); ``{subject}`` in the pattern stands for the subject.

    The recording itself has the label ``recording``.

    Raises:
        ConfigError: No path is configured, or its format is not among those that can be read.
        DataError: The file is missing; the message names the subjects that are there.
    """
    path = _root(pattern.replace(SUBJECT, subject))
    if not path.name.lower().endswith(READABLE):
        what = "is a folder" if path.is_dir() else f"has the ending {path.suffix or '(none)'!r}"
        raise ConfigError(
            f"acquire.path: {path.name} {what}; recordings that can be read: {', '.join(READABLE)}",
            cure="name the recording's header file, with {subject} where the subjects' paths differ",
        )
    refuse_broken_link(path)
    if not path.is_file():
        have = _subjects(pattern)
        here = f"subjects found: {_span(have)}" if SUBJECT in pattern else f"{path.parent} holds {_siblings(path)}"
        raise DataError(
            f"the recording {path} of {subject} does not exist{did_you_mean(subject, have)}; {here}",
            cure="correct acquire.path, or name a subject that is there",
        )
    return _whole({"recording": path} | companions(path) | describing_files(path))


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
    return Path(path).expanduser()


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
    path = Path(pattern).expanduser()
    first = next(i for i, part in enumerate(path.parts) if SUBJECT in part)
    base = Path(*path.parts[:first])
    glob = "/".join(part.replace(SUBJECT, "*") for part in path.parts[first:])
    # The same subject may stand in the path several times: a backreference asks that they agree.
    before, *rest = (re.escape(piece) for piece in str(path).split(SUBJECT))
    shape = re.compile(before + "(?P<subject>[^/]+)" + "(?P=subject)".join(rest))
    hits = (shape.fullmatch(str(p)) for p in base.glob(glob))
    return sorted({hit["subject"] for hit in hits if hit})


def _siblings(path: Path) -> str:
    if not path.parent.is_dir():
        return "nothing (the folder does not exist)"
    return _span(sorted(p.name for p in path.parent.iterdir() if p.name.lower().endswith(READABLE)))


def _span(names: list[str], most: int = 12) -> str:
    if len(names) > most:
        return f"{', '.join(names[: most - 1])} … {names[-1]}"
    return ", ".join(names) or "none"
