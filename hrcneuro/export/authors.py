"""What acquire made, written in the authors' layout: ``DIR/sNN/`` with ``sNN.set``, ``sNN.fdt`` and both CSV files.

A folder is only ever added to, or brought up to date: a subject's folder that hrcneuro did not write, or that belongs
to a study with other settings, is refused. Each folder appears whole, by one rename.
"""

from __future__ import annotations

import contextlib
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hrcneuro.errors import ConfigError, StageError
from hrcneuro.export.eeglab import Event, require_eeglabio, write_set
from hrcneuro.sources.formats.statements import set_comments
from hrcneuro.sources.origin import Origins, mark_of
from hrcneuro.sources.recording import reference_of

if TYPE_CHECKING:
    import mne
    import pandas as pd

ONSET_CODE = 33025
"""The onset's event type: a number, as in the authors' other recordings. Theirs for the study is not documented."""

_MARK = re.compile(r"hrcneuro acquire (\S+), key ([0-9a-f]+), study ([0-9a-f]+)")
_SUBJECT = re.compile(r"s\d+")


def prepare(folder: Path, subjects: list[str], *, study: str) -> None:
    """Refuse a folder that must not be written to, before anything is computed for it.

    Args:
        folder: Where the subjects' folders are to lie; it need not exist.
        subjects: Who is to be exported.
        study: What tells studies apart: a digest of their settings.

    Raises:
        ConfigError: eeglabio is missing, a subject's name does not fit the layout, or the folder holds another study.
    """
    require_eeglabio()
    strange = [name for name in subjects if not _SUBJECT.fullmatch(name)]
    if strange:
        raise ConfigError(
            f"the authors' layout names subjects s01, s02 …; the study has {', '.join(strange)}",
            cure="rename them (study.subjects), or leave out --export",
        )
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--export {folder} is a file", cure="name a folder")
    for home in sorted(folder.glob("s*")) if folder.is_dir() else ():
        if _SUBJECT.fullmatch(home.name):
            _refuse_foreign(home, study)


def export_subject(
    recording: Path, trials: Path, folder: Path, subject: str, *, key: str, study: str, origins: Origins
) -> dict[str, Any]:
    """Write one subject's four files; return what a person wants to know of them.

    Args:
        recording: ``sNN_raw.fif``.
        trials: ``trials.parquet``.
        folder: Where the subject's folder is to lie.
        subject: ``s01``.
        key: Identifies the artifacts; a folder written from the same ones is left as it is.
        study: As for :func:`prepare`.
        origins: Where the data come from: the files say so where it is a simulation.

    Raises:
        ConfigError: The recording is of another paradigm, or the folder cannot be written.
    """
    from hrcneuro.io.fif import read_raw
    from hrcneuro.io.tables import read_table

    home = folder / subject
    written = f"hrcneuro acquire {subject}, key {key}, study {study}"
    files = [f"{subject}.set", f"{subject}.fdt", f"subject{subject[1:]}.csv", f"metadata{subject[1:]}.csv"]
    account: dict[str, Any] = {"folder": str(home), "files": files, "onset_event": str(ONSET_CODE)}
    if written in _comments(home) and all((home / name).is_file() for name in files):
        return account | {"state": "hit", "notes": []}
    moves = read_table(trials)
    if moves.empty or moves["scenario"].isna().any():
        raise ConfigError(
            f"{subject} is no session of the study: it has no log to export",
            cure="export from acquire.source = synthetic, semisynthetic or dataset; MNE writes other recordings",
        )
    with _written_whole(folder, home) as new:
        raw = read_raw(recording)
        reference = reference_of(raw)
        about = f"reference of the recording: {reference}" if reference else "reference not stated"
        comments = "; ".join(text for text in (mark_of(origins).rstrip("."), about, written) if text)
        events = [*_onsets(moves, raw.info["sfreq"]), *_marks(raw)]
        left_out = write_set(raw, events, new / files[0], comments=comments)
        notes = [f"channels left out: {', '.join(left_out)}"] if left_out else []
        notes += _write_logs(moves, new, subject, mark_of(origins))
        if raw.info["bads"]:
            notes.append(f"the layout has no place for bad channels; name them: acquire.bads = {raw.info['bads']}")
    return account | {"state": "ran", "notes": notes}


def _refuse_foreign(home: Path, study: str) -> None:
    mark = _MARK.search(_comments(home))
    if mark is None:
        raise ConfigError(
            f"{home} was not written by hrcneuro; --export does not touch it", cure="export to another folder"
        )
    if mark[3] != study:
        raise ConfigError(
            f"{home} was exported from a study with other settings of acquire",
            cure="export to another folder, or delete this one",
        )


def _comments(home: Path) -> str:
    return set_comments(home / f"{home.name}.set")


def _onsets(moves: pd.DataFrame, sfreq: float) -> list[Event]:
    at = moves["onset_s"].dropna().to_numpy(float) * sfreq
    # A whole sample stays whole; what lies between two stays there, as in the authors' files.
    whole = np.rint(at)
    return [(ONSET_CODE, float(one), 0.0) for one in np.where(np.abs(at - whole) < 1e-6, whole, at)]


def _marks(raw: mne.io.BaseRaw) -> Iterator[Event]:
    """Yield breaks, as EEGLAB's boundary half a sample before the new segment, and spans marked bad."""
    sfreq = raw.info["sfreq"]
    for mark in raw.annotations:
        at, text = (float(mark["onset"]) - raw.first_time) * sfreq, str(mark["description"])
        if text == "EDGE boundary":
            yield "boundary", float(np.rint(at)) - 0.5, 0.0
        elif text.upper().startswith(("BAD", "EDGE")) and text != "BAD boundary":
            yield text, at, float(mark["duration"]) * sfreq


def _write_logs(moves: pd.DataFrame, home: Path, subject: str, origin: str) -> list[str]:
    """Write both CSV files, read them again, and return what they cannot tell."""
    from hrcneuro.sources import authors_log
    from hrcneuro.sources.logs import read_log

    authors_log.write_log(moves, home / f"subject{subject[1:]}.csv")
    authors_log.write_metadata(moves, home / f"metadata{subject[1:]}.csv", origin=origin)
    lost = authors_log.same_moves(moves, read_log(home.parent, subject))
    return [f"read again, the log differs in {', '.join(lost)}: so few moves do not tell all owners"] if lost else []


@contextlib.contextmanager
def _written_whole(folder: Path, home: Path) -> Iterator[Path]:
    """Give a folder to write into that takes the place of ``home`` at the end, or leaves no trace."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".export-") as scratch:
            new = Path(scratch) / home.name
            new.mkdir()
            yield new
            if home.exists():
                home.rename(Path(scratch) / "old")
            new.rename(home)
    except OSError as error:
        raise _explained(error, folder) from error


def _explained(error: OSError, folder: Path) -> ConfigError | StageError:
    import errno

    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return StageError(f"the disk of {folder} is full", cure="free space, or export to another folder")
    return ConfigError(
        f"{folder} cannot be written: {error.strerror or error}", cure="name a folder that you may write to"
    )
