"""The artifacts of a study for notebooks: ``hrcneuro.open("results").epochs("s01")`` is a plain MNE object.

Nothing is computed here: what a stage has published is read as it is, and only what the configuration asks for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import answers
from hrcneuro.answers import html
from hrcneuro.contract import GROUP, OF_ALL
from hrcneuro.drawings import JOINT
from hrcneuro.errors import DataError, did_you_mean
from hrcneuro.pipeline.workdir import FIGURES, Workdir
from hrcneuro.stages import NAMES as STAGES

if TYPE_CHECKING:
    import mne
    import pandas as pd

    from hrcneuro.config.settings import Settings
    from hrcneuro.io.tables import Table

_GROUP_ONLY = ("simulate",)


@dataclass(frozen=True)
class Answer:
    """A unit's result in a few lines.

    Attributes:
        head: Stage and unit.
        lines: What came out.
    """

    head: str
    lines: tuple[str, ...]

    def __repr__(self) -> str:
        return "\n".join(answers.block(self.head, self.lines))

    def _repr_html_(self) -> str:
        return html.preformatted(self.head, self.lines)


class Tables(dict[str, "Table"]):
    """The tables of a unit: file -> its description. A notebook shows every column with its unit and meaning."""

    def _repr_html_(self) -> str:
        return "".join(
            html.table(
                f"{name}: {table.row}",
                ["column", "type", "unit", "meaning"],
                [[column, one.type, one.unit, one.text] for column, one in table.columns.items()],
            )
            for name, table in self.items()
        )


class Study:
    """What has run in a working folder with a configuration; see :func:`hrcneuro.open`.

    Args:
        workdir: The folder.
        settings: The configuration; None takes what ran last, whatever its configuration.
    """

    def __init__(self, workdir: Workdir, settings: Settings | None = None) -> None:
        self.workdir = workdir
        self.settings = settings

    def __repr__(self) -> str:
        return f"<hrcneuro study in {self.workdir.folder}: {', '.join(self.subjects) or 'nothing has run'}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: which units of which stages have run, and the numbers of each group."""
        ran = {name: units for name, units in self.stages.items() if name in STAGES}
        stages = [name for name in STAGES if name in ran]
        groups = [self.show(name, GROUP) for name in stages if GROUP in ran[name]]
        units = [*_subjects(ran), *([GROUP] if groups else [])]
        rows = [[unit, *("✓" if unit in ran[name] else "" for name in stages)] for unit in units]
        caption = f"hrcneuro study in {self.workdir.folder}"
        return html.table(caption, ["unit", *stages], rows) + "".join(one._repr_html_() for one in groups)

    @property
    def subjects(self) -> tuple[str, ...]:
        """Subjects of which some stage has run, in the order of their names."""
        return _subjects(self.stages)

    @property
    def stages(self) -> dict[str, tuple[str, ...]]:
        """Stage -> the units of which it has run."""
        units: dict[str, list[str]] = {}
        for stage, unit in sorted(self._ran()):
            units.setdefault(stage, []).append(unit)
        return {stage: tuple(names) for stage, names in units.items()}

    def _ran(self) -> set[tuple[str, str]]:
        if self.settings is None:
            entries = self.workdir.keys()
            return {(stage, unit) for stage, unit, _ in entries if not stage.endswith(FIGURES)}
        from hrcneuro.pipeline import asked

        return {(item.stage, item.unit) for item in asked.whole(self.settings, self.workdir) if item.state.done}

    def raw(self, subject: str) -> mne.io.BaseRaw:
        """Return the recording as acquired: EEG and EOG, not loaded into memory (channels × samples, volts)."""
        return self._recording("acquire", subject, f"{subject}_raw.fif")

    def clean(self, subject: str) -> mne.io.BaseRaw:
        """Return the recording after preprocess, not loaded into memory (channels × samples, volts)."""
        return self._recording("preprocess", subject, f"{subject}_clean_raw.fif")

    def epochs(self, subject: str) -> mne.BaseEpochs:
        """Return the epochs (epochs × channels × samples, volts); their metadata are the rows of the trial table."""
        from hrcneuro.io.fif import read_epochs

        return read_epochs(self.path("epoch", subject, f"{subject}_epo.fif"))

    def evokeds(self, subject: str) -> dict[str, mne.Evoked]:
        """Return the averages (channels × samples, volts) by name: ``SCENARIO/CONDITION``, as ``all/RH_before``."""
        from hrcneuro.io.fif import read_evokeds

        return {e.comment: e for e in read_evokeds(self.path("erp", subject, f"{subject}_ave.fif"))}

    def trials(self, subject: str) -> pd.DataFrame:
        """Return the trial table: one row a move, or one row an event of any other study."""
        return self.table("acquire", subject, "trials.parquet")

    def table(self, stage: str, unit: str, file: str = "") -> pd.DataFrame:
        """Return a Parquet artifact; ``file`` may be left out where the unit has only one.

        Raises:
            DataError: The unit has not run, has no such table, or has several and none is named.
        """
        from hrcneuro.io.tables import read_table

        return read_table(self.path(stage, unit, file or self._only_table(stage, unit)))

    def summary(self, stage: str, unit: str) -> Mapping[str, Any]:
        """Return what a stage says of its result in a few numbers; ``--json`` prints the same.

        Raises:
            DataError: The unit has not run.
        """
        if self.settings is None:
            # With the nearest name where there is no such stage or unit.
            self.path(stage, unit)
            return self.workdir.summary(stage, unit)
        from hrcneuro.pipeline import asked

        self._check(stage, unit)
        return asked.result(self.settings, self.workdir, stage, unit).summary

    def show(self, stage: str, unit: str = GROUP) -> Answer:
        """Return what came out of a unit of a stage, in words and units, as ``hrcneuro show`` prints it.

        Raises:
            DataError: The unit has not run.
        """
        return Answer(f"{stage}, {unit}", tuple(answers.lines(stage, unit, self.summary(stage, unit), every=True)))

    def tables(self, stage: str, unit: str) -> Tables:
        """Return which tables a unit has, and what their columns mean.

        Raises:
            DataError: The unit has not run.
        """
        from hrcneuro.io.tables import describe

        folder = self.path(stage, unit)
        return Tables({path.name: describe(path) for path in sorted(folder.glob("*.parquet"))})

    def path(self, stage: str, unit: str, file: str = "") -> Path:
        """Return where a unit's folder, or one file of it, lies.

        Raises:
            ConfigError: The study has no such unit.
            DataError: The unit has not run with this configuration, or has no such file.
        """
        self._check(stage, unit)
        if self.settings is None:
            return self.workdir.artifact(stage, unit, file)
        from hrcneuro.pipeline import asked

        return asked.place(self.settings, self.workdir, stage, unit, file)

    def _check(self, stage: str, unit: str) -> None:
        """Refuse a name that is none, with the nearest one."""
        known = (*STAGES, *JOINT)
        if stage not in known:
            raise DataError(
                f"there is no stage {stage!r}{did_you_mean(stage, known)}", cure=f"stages: {', '.join(known)}"
            )
        entries = self.workdir.keys()
        ran = sorted({one for _, one, _ in entries})
        subjects = (*(self.settings.study.subjects if self.settings else ()), *ran)
        if unit not in subjects and (hint := did_you_mean(unit, subjects)):
            raise DataError(
                f"{stage} of {unit!r} has not run{hint}", cure=f"units: {', '.join(dict.fromkeys(subjects))}"
            )

    def _recording(self, stage: str, subject: str, name: str) -> mne.io.BaseRaw:
        from hrcneuro.io.fif import read_raw

        return read_raw(self.path(stage, subject, name))

    def _only_table(self, stage: str, unit: str) -> str:
        tables = sorted(p.name for p in self.path(stage, unit).glob("*.parquet"))
        if len(tables) == 1:
            return tables[0]
        raise DataError(
            f"{stage} of {unit} has {len(tables) or 'no'} tables", cure=f"name one of: {', '.join(tables) or 'none'}"
        )


def _subjects(ran: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Return the subjects among the units of stages (stage -> units)."""
    units = {unit for stage, of in ran.items() if stage not in _GROUP_ONLY for unit in of}
    return tuple(sorted(units - {*OF_ALL}))


def open(
    folder: str | Path = ".", config: str | Path | None = None, set: Sequence[str] = (), *, last: bool = False
) -> Study:
    """Return the study in a folder, as :func:`hrcneuro.open` says.

    Raises:
        ConfigError: The configuration has a mistake.
        DataError: Nothing has run there.
    """
    path = Path(folder)
    for candidate in (path, path.absolute().parent if path.absolute().name == "results" else path):
        if (candidate / "results").is_dir():
            return Study(Workdir(candidate), None if last else _settings(candidate, config, set))
    raise DataError(f"{path} holds no results", cure="name the folder in which hrcneuro ran, or the results in it")


def _settings(folder: Path, config: str | Path | None, assignments: Sequence[str]) -> Settings:
    from hrcneuro.config import settings

    own = folder / "hrcneuro.toml"
    return settings.load(Path(config) if config else own if own.is_file() else None, assignments)
