"""What a run has produced, as the report asks for it: summaries, tables, figures, and what is real in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from hrcneuro import drawings, published
from hrcneuro.cache.disk import read_json
from hrcneuro.contract import GROUP, OF_ALL
from hrcneuro.eeg.significance import SignificanceMap
from hrcneuro.pipeline.workdir import FIGURES
from hrcneuro.sources.origin import AUTHORS_LOGS, Origin, Origins
from hrcneuro.tables.maps import read_tested

_ANALYSED = sorted(set(AUTHORS_LOGS) - set(published.EXCLUDED.value))


@dataclass(frozen=True)
class Figure:
    """A picture that a stage has drawn."""

    stage: str
    unit: str
    path: Path
    caption: str
    title: str


class Results:
    """The items of a run that are up to date."""

    def __init__(self, settings: Any, items: Sequence[Any], memo: Any = None) -> None:
        from hrcneuro.cache.fingerprint import Memo

        self.settings = settings
        self.memo = memo or Memo(Path(".memo.json"))
        self.items = items
        self._maps: dict[str, Mapping[tuple[str, str], SignificanceMap]] = {}
        self.done = {(i.stage, i.unit): i for i in items if i.state.done and not i.draws}
        self.drawn = [i for i in items if i.state.done and i.draws]

    def units(self, stage: str) -> list[str]:
        """Return the subjects for which a stage has run."""
        return sorted(unit for name, unit in self.done if name == stage and unit not in OF_ALL)

    def included(self, stage: str) -> list[str]:
        """Return the subjects of a stage that enter the analyses."""
        return [u for u in self.units(stage) if u in self.settings.included]

    def summary(self, stage: str, unit: str = GROUP) -> Mapping[str, Any]:
        """Return a unit's summary; empty where it has not run."""
        item = self.done.get((stage, unit))
        return item.summary if item else {}

    def path(self, stage: str, unit: str, name: str) -> Path | None:
        """Return where an artifact lies, or None."""
        item = self.done.get((stage, unit))
        place = item.artifacts.get(name) if item else None
        return Path(place) if place else None

    def table(self, stage: str, unit: str, name: str) -> Any:
        """Return a Parquet artifact as a data frame, or None where it does not exist."""
        from hrcneuro.io.tables import read_table

        path = self.path(stage, unit, name)
        return None if path is None else read_table(path)

    def tables(self, stage: str, name: str) -> dict[str, Any]:
        """Return subject -> table, of the subjects that enter the analyses and have it."""
        tables = {unit: self.table(stage, unit, name) for unit in self.included(stage)}
        return {unit: table for unit, table in tables.items() if table is not None}

    def maps(self, stage: str) -> Mapping[tuple[str, str], SignificanceMap]:
        """Return (scenario, contrast) -> the group's tested map of erp or ersp; read once."""
        if stage not in self._maps:
            path = self.path(stage, GROUP, f"{stage}_stats.parquet")
            self._maps[stage] = read_tested(path).maps if path else {}
        return self._maps[stage]

    def record(self, stage: str, unit: str) -> Mapping[str, Any]:
        """Return the provenance of an entry; empty where it has not run."""
        item = self.done.get((stage, unit))
        if item is None or not item.artifacts:
            return {}
        path = Path(next(iter(item.artifacts.values())))
        while not (path / "record.json").is_file():
            if path == path.parent:
                return {}
            path = path.parent
        return read_json(path / "record.json")

    def figures(self, name: str) -> list[Figure]:
        """Return the pictures of a stage, or of several that they join, the group's first."""
        if name not in drawings.NAMES:
            return []
        drawn = drawings.load(name)
        figures = []
        for item in sorted(self.drawn, key=lambda i: (i.unit not in OF_ALL, i.unit)):
            drawing = drawn.of(item.unit)
            if item.stage == name + FIGURES and drawing:
                for file, caption in drawing.captions.items():
                    if file in item.artifacts:
                        figures.append(Figure(name, item.unit, Path(item.artifacts[file]), caption.text, caption.title))
        return figures

    def origins(self, units: Sequence[str]) -> list[Origins]:
        """Return where the data of subjects come from."""
        return [Origins.of(self.summary("acquire", unit).get("origin", {})) for unit in units]

    @property
    def same_logs(self) -> bool:
        """Whether the moves are those that the paper analysed, under whatever names."""
        return sorted(one.log for one in self.origins(self.included("acquire"))) == _ANALYSED

    def warnings(self) -> list[str]:
        """Return what the stages want a reader to know."""
        lines = []
        for (stage, unit), item in sorted(self.done.items()):
            lines += [f"{stage} {unit}: {w}" for w in item.summary.get("warnings", ())]
        for item in self.drawn:
            stage = item.stage.removesuffix(FIGURES)
            lines += [f"{stage} {item.unit}: {w}" for w in item.summary.get("warnings", ())]
        return lines

    @cached_property
    def reality(self) -> tuple[str, str]:
        """Return (short word, sentence) on what is real in the data."""
        origins = self.origins(self.units("acquire"))
        if not origins:
            return "no data", "No recording has been acquired yet."
        eeg, behaviour = {one.eeg for one in origins}, {one.behaviour for one in origins}
        if eeg == behaviour == {Origin.REAL}:
            return "real", "The EEG and the events are real recordings, as whoever ran this vouches (acquire.recorded)."
        if eeg == {Origin.SYNTHETIC}:
            return _simulated(behaviour)
        if eeg == {Origin.UNKNOWN}:
            moves = " The behaviour is real: the logs are known." if behaviour == {Origin.REAL} else ""
            return (
                "of unknown origin",
                f"Nothing tells whether the EEG was recorded from people or simulated.{moves} "
                "Nothing below about brains is a finding before someone vouches for it (acquire.recorded).",
            )
        return (
            "mixed",
            "Some subjects' data are real, others SYNTHETIC or of unknown origin; the table of recordings says which.",
        )


def _simulated(behaviour: set[Origin]) -> tuple[str, str]:
    """Return what is said of simulated EEG around such behaviour."""
    if behaviour == {Origin.SYNTHETIC}:
        return (
            "synthetic",
            "Behaviour and EEG are both SYNTHETIC, drawn by a simulation in which the effect was planted. "
            "Nothing below is a finding about people.",
        )
    moves = "real: logs of people at work" if behaviour == {Origin.REAL} else " or ".join(sorted(behaviour))
    return (
        "semi-synthetic",
        f"The behaviour is {moves}. The EEG is SYNTHETIC, simulated around the moves. "
        "Nothing below about brains is a finding.",
    )
