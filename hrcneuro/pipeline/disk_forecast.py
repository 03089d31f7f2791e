"""How much disk a run will want: by what the tasks of earlier runs have written, else by the length of the session."""

from __future__ import annotations

import statistics
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from hrcneuro.cache.disk import free_bytes
from hrcneuro.config.settings import Settings
from hrcneuro.contract import GROUP, OF_ALL, is_piece
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.measured import measured, of_kind
from hrcneuro.pipeline.workdir import FIGURES, Workdir

# Bytes a channel and second of a recording, as synthetic subjects of the paper's size wrote them at the default
# options (1000 Hz, 512 Hz from preprocess on), together 0.68 GB a subject; the tables of erp and ersp hardly depend on
# the length. Of the group, in bytes: as the study of twelve wrote them.
_OF_SUBJECT = {
    "acquire": 4300, "preprocess": 1900, "epoch": 2300, "erp": 95, "ersp": 440, "decode": 7, "robot": 550,
    "rerp": 45, "transfer": 65, "calibrate": 2
}  # fmt: skip
_OF_GROUP = {"erp": 27_000_000, "ersp": 135_000_000, "decode": 60_000, "simulate": 1_000_000, "transfer": 100_000}
# Pictures in bytes, as the smoke study drew them: their size hardly depends on the length of a session.
_PICTURES_OF_SUBJECT = {
    "preprocess": 400_000, "epoch": 120_000, "erp": 2_600_000, "ersp": 800_000, "decode": 1_200_000, "robot": 650_000
}  # fmt: skip
_PICTURES_OF_GROUP = {
    "erp": 7_300_000, "ersp": 2_800_000, "decode": 100_000, "simulate": 1_000_000,
    "cases": 2_200_000, "confound": 140_000, "moves": 160_000, "quality": 220_000
}  # fmt: skip
_OTHER_PICTURES = 1_000_000
# Of their tables the sampling rate decides nothing.
_AT_ANY_RATE = ("robot", "transfer", "calibrate")
_RECORDED_HZ, _PREPROCESSED_HZ = 1000.0, 512.0
# Of a session of the paper's: 27 channels of EEG and 3 of EOG; 166 episodes took 2385 s.
_CHANNELS, _EPISODE_S = 30, 14.4


@dataclass(frozen=True)
class DiskForecast:
    """What tasks that would run will write.

    Attributes:
        tasks: How many would run.
        size: What they will write, in bytes, without those of ``unknown``.
        estimated: How much of it is estimated from the length of a session, as nothing of the kind has run.
        unknown: Stages of which nothing has run, and of which nobody knows what they write.
        free: What is free where the cache lies, in bytes.
    """

    tasks: int
    size: int
    estimated: int
    unknown: tuple[str, ...]
    free: int

    @property
    def enough(self) -> bool | None:
        """Whether it fits; None where that is not known."""
        if self.size > self.free:
            return False
        return None if self.unknown else True

    def document(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "bytes": self.size,
            "estimated": self.estimated,
            "free": self.free,
            "unknown": self.unknown,
            "enough": self.enough,
        }

    def __str__(self) -> str:
        free = f"{large(self.free)} are free"
        if not self.size and self.unknown:
            return f"disk: {free}; how much will be written is not known before something has run"
        origin = "by what earlier runs wrote"
        if self.estimated:
            guess = "an estimate by the length of a session"
            origin = guess if self.estimated == self.size else f"{origin}; {large(self.estimated)} of it are {guess}"
        of = f"; nothing has run yet of {', '.join(self.unknown)}: whether that is enough is not known"
        short = "; that is not enough: 'hrcneuro cache gc' and 'hrcneuro cache slim' make room"
        end = short if self.enough is False else of if self.unknown else ""
        return f"disk: about {large(self.size)} will be written, {origin}; {free}{end}"


def expected(workdir: Workdir, items: Iterable[Item], settings: Settings) -> DiskForecast:
    """Return how much disk those of these tasks want that would run."""
    coming = [item for item in items if item.state is State.WOULD_RUN]
    last = measured(workdir, [(item.stage, item.unit) for item in coming])
    alike: dict[tuple[str, bool], list[int]] = {}
    total, estimated, unknown = 0, 0, []
    for item in coming:
        kind = (item.stage, item.unit == GROUP)
        if kind not in alike:
            alike[kind] = [record.size for record in of_kind(workdir, kind[0], group=kind[1])]
        own = last.get((item.stage, item.unit))
        known = None if own is None else own.size
        if known is None and alike[kind]:
            known = round(statistics.median(alike[kind]))
        if known is None:
            known = _pictures(item) if item.draws else estimate(item.stage, item.unit, settings)
            estimated += known or 0
            if known is None:
                unknown.append(item.stage)
        total += known or 0
    free = free_bytes(workdir.cache.root)
    return DiskForecast(len(coming), total, estimated, tuple(dict.fromkeys(unknown)), free)


def _pictures(item: Item) -> int:
    """Return what a task that draws will write, in bytes, where nothing of the kind has been drawn."""
    sizes = _PICTURES_OF_GROUP if item.unit in OF_ALL else _PICTURES_OF_SUBJECT
    return sizes.get(item.stage.removesuffix(FIGURES), _OTHER_PICTURES)


def estimate(stage: str, unit: str, settings: Settings) -> int | None:
    """Return what a task will write by the length of a session, in bytes; None where nobody knows.

    Of a recording that nobody has read yet, the length is taken to be that of the configured session.
    """
    if unit in OF_ALL or is_piece(unit):
        return _OF_GROUP.get(stage)
    if stage not in _OF_SUBJECT:
        return None
    acquire = settings.section("acquire", unit)
    session = acquire.session
    seconds = _EPISODE_S * (session.blocks * session.episodes_per_block + 2 * session.practice_episodes)
    rate = acquire.sfreq if acquire.source == "synthetic" else _RECORDED_HZ
    kept = min(rate, settings.section("preprocess", unit).sfreq)
    shares = {"acquire": rate / _RECORDED_HZ, **dict.fromkeys(_AT_ANY_RATE, 1.0)}
    share = shares.get(stage, kept / _PREPROCESSED_HZ)
    return round(_OF_SUBJECT[stage] * share * _CHANNELS * seconds)


def large(size: int) -> str:
    """Return bytes as people say them."""
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.1f} MB"
