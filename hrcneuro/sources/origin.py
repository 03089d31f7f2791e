"""Where data come from: people, a simulation, or nobody knows; and the mark by which a simulation stays known.

Whatever writes simulated data writes :func:`mark_of` into each file that has room for words, and whatever reads a
recording looks for it. The authors' logs have no such room and need none: they are known by their content.
"""

from __future__ import annotations

import csv
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path

from hrcneuro.sources import spreadsheets, words


class Origin(StrEnum):
    """Where something comes from."""

    REAL = "real"
    SYNTHETIC = "synthetic"
    UNKNOWN = "of unknown origin"


@dataclass(frozen=True)
class Origins:
    """Where a subject's data come from.

    Attributes:
        eeg: The recording.
        behaviour: The moves, or whatever events there are.
        log: The subject of the study (``s03``) whose log it is, under whatever name; empty where it is none of them.
    """

    eeg: Origin
    behaviour: Origin
    log: str = ""

    @classmethod
    def of(cls, summary: Mapping[str, str]) -> Origins:
        """Return the origins in a summary of acquire; what it does not have is of unknown origin."""
        eeg, behaviour = (Origin(summary.get(name, Origin.UNKNOWN)) for name in ("eeg", "behaviour"))
        return cls(eeg, behaviour, summary.get("log", ""))

    @property
    def summary(self) -> dict[str, str]:
        """As they stand in the summary of acquire."""
        return {name: str(value) for name, value in asdict(self).items()}


def vouched(origins: Origins, recorded: bool) -> Origins:
    """Return the origins where a person vouches that people were recorded; a mark of a simulation stands."""
    if not recorded:
        return origins
    eeg, behaviour = (Origin.REAL if one is Origin.UNKNOWN else one for one in (origins.eeg, origins.behaviour))
    return Origins(eeg, behaviour, origins.log)


def joined(parts: Sequence[Origins]) -> Origins:
    """Return the origins of recordings that are joined: one part that was simulated makes the whole so."""
    eeg, behaviour = ({getattr(part, name) for part in parts} for name in ("eeg", "behaviour"))
    return Origins(_of_whole(eeg), _of_whole(behaviour))


def _of_whole(kinds: set[Origin]) -> Origin:
    if Origin.SYNTHETIC in kinds:
        return Origin.SYNTHETIC
    return Origin.REAL if kinds == {Origin.REAL} else Origin.UNKNOWN


UNKNOWN = Origins(Origin.UNKNOWN, Origin.UNKNOWN)
SYNTHETIC = Origins(Origin.SYNTHETIC, Origin.SYNTHETIC)

# The first word and the program's name are what is looked for: a format with room for eighty letters holds both.
_FOUND = re.compile(r"(?<![A-Za-z-])(SEMI-)?SYNTHETIC:.{0,200}?hrcneuro", re.DOTALL)
# EEGLAB files of before the mark.
_ONCE = re.compile(r"source: (semi)?synthetic;.*hrcneuro acquire", re.DOTALL)


def mark_of(origins: Origins) -> str:
    """Return the sentence that an export of these data carries; empty where no EEG was simulated."""
    if origins.eeg is not Origin.SYNTHETIC:
        return ""
    return {
        Origin.SYNTHETIC: "SYNTHETIC: behaviour and EEG were simulated by hrcneuro; nobody was recorded.",
        Origin.REAL: "SEMI-SYNTHETIC: the EEG was simulated by hrcneuro around a real log; no EEG was recorded.",
        Origin.UNKNOWN: "SEMI-SYNTHETIC: the EEG was simulated by hrcneuro around a log of unknown origin.",
    }[origins.behaviour]


def marked(texts: Iterable[str]) -> Origins:
    """Return what the words that go with a recording tell of it; unknown where they carry no mark.

    A mark tells of simulated behaviour, never of real behaviour: that is known by the log's content alone.
    """
    for text in texts:
        found = _FOUND.search(text) or _ONCE.search(text)
        if found:
            return Origins(Origin.SYNTHETIC, Origin.UNKNOWN if found[1] else Origin.SYNTHETIC)
    return UNKNOWN


def with_log(recording: Origins, files: Mapping[str, Path]) -> Origins:
    """Return the origins of a recording with its log: a log of the authors is real, whatever else is not.

    Args:
        recording: What is known of the recording without its log.
        files: The subject's ``log`` and ``metadata``; the latter may carry a mark, too.
    """
    subject = authors_subject(files["log"])
    if subject:
        return Origins(recording.eeg, Origin.REAL, subject)
    if recording.behaviour is Origin.UNKNOWN and "metadata" in files:
        words_of_log = files["metadata"].read_text(encoding="utf-8", errors="replace")
        return Origins(recording.eeg, marked([words_of_log]).behaviour)
    return recording


def authors_subject(log: Path) -> str:
    """Return the subject of the study whose log this is, by its content; empty where it is nobody's."""
    return _SUBJECTS.get(log_digest(log), "")


def log_digest(log: Path) -> str:
    """Return the SHA-256 of a log's moves, however the table was saved; empty if it has none.

    Line ends, quotes, separators, further columns and the encoding do not count: what is read is what is known.

    The column of the movement's direction is left out: it follows from the tiles, but for the authors' own mistakes.
    """
    columns = [name for name, short in words.LOG.items() if short != "logged"]
    digest = hashlib.sha256()
    try:
        for row in spreadsheets.rows(log):
            digest.update("\t".join(row[name].strip() for name in columns).encode() + b"\n")
    except (OSError, UnicodeError, csv.Error, KeyError, AttributeError):
        # No such log: reading it says what is wrong.
        return ""
    return digest.hexdigest()


AUTHORS_LOGS = {
    "s01": "78af03a63c79c4622c11d81861ee72f048daa3e423af3c946144f1819fb76152",
    "s02": "3069595159bbdf219df53287175bcbbc2f5e523d84158faff3be00716da34755",
    "s03": "94f54bd1b75dc6bae639419706190c45f5dd781ccece1bf98df05e1a7750680a",
    "s04": "9cabfb798843f69a06a0ca859c8675b7a4933787452bc0e5bcee276e322faad2",
    "s05": "11837b4485b385f9b2bb5de9752684488ca77684c8192d72a81ccef986e3267b",
    "s06": "575ab576b4563cfc70a69536d5bb23f8f1b552412aa6a0ece6a195f76043ae23",
    "s07": "eb163134adce507ddb83f90403f7ec512200f860407d4ec4a7cf26d2c8215b59",
    "s08": "0c969abdaabb338c956441c43e0de002761deef0af29ba5ac2e5f043839a9f32",
    "s09": "ec95ac0cf43e6233a4f5dbf3e9ad236941c19008fa6d95cee3d8534b5dcd5d9e",
    "s10": "094db2bd86cb71728b79fe515252f5f2b09d56b7297b81b44125db41d65366e4",
    "s11": "93223f01f0c08b730a446ebbbdf8f4188648a4d964fdedb47b32c8a6b667f8e7",
    "s12": "82e82d1e647daad68b0074a02c6c803f6174f459f0f930532ff530df22d8311f",
}
"""Subject of the study -> :func:`log_digest` of its log, as published (stefan-ehrlich/HRC_neurobased_taskplanning)."""
_SUBJECTS = {digest: subject for subject, digest in AUTHORS_LOGS.items()}
