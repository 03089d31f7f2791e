"""What the command multiverse has in hand: the universes of a file of choices. What can be refused is refused here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hrcneuro import stages
from hrcneuro.analyses import multiverse as many
from hrcneuro.cli import bring
from hrcneuro.cli.options import Options
from hrcneuro.config import dataset, universes
from hrcneuro.config.multiverses import Choice, Multiverse, read_multiverse
from hrcneuro.config.settings import Settings
from hrcneuro.errors import ConfigError, did_you_mean
from hrcneuro.pipeline import second_cache, walk
from hrcneuro.pipeline.beside import Beside
from hrcneuro.pipeline.item import Item
from hrcneuro.pipeline.keys import Keys
from hrcneuro.pipeline.universes import Universe, chains, in_order, judged_place, universe
from hrcneuro.pipeline.workdir import Workdir
from hrcneuro.report import multiverse as told_of
from hrcneuro.report.claims import is_study
from hrcneuro.report.results import Results

_FOLDER, _WORK = "multiverse", ".work"


@dataclass
class Work:
    """A multiverse under way.

    Attributes:
        options, asked, choices: The command's, the file's, and its choices, the study's own value first.
        every: All universes, by number.
        chains: Universe -> its preprocessing chain.
        keys: Of the study's own universe, with what all share hashed.
        place: Where it works: a study of its own beside the study.
        judged: Universe -> its rows.
        failed: Universe -> what failed in it.
        seconds: Of work that was done now.
    """

    options: Options
    asked: Multiverse
    choices: Sequence[Choice]
    every: Sequence[Universe]
    chains: Mapping[int, int]
    keys: Keys
    place: Beside
    code: str
    judged: dict[int, list[told_of.Row]] = field(default_factory=dict)
    failed: dict[int, list[Item]] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def study(self) -> Workdir:
        """The working folder's."""
        return Workdir(self.options.workdir)

    @property
    def out(self) -> Path:
        """Where its tables, pictures and page lie."""
        return self.place.place.parent / self.asked.name

    def kept(self, one: Universe) -> Path:
        """Return where the verdicts of a universe are kept."""
        return judged_place(self.place.place / "judged", one, self.code)

    def walk(self, one: Universe) -> walk.Run:
        """Return the walk over a universe's tasks."""
        return walk.Run(
            one.settings,
            self.place,
            one.graph,
            verify=self.options.verify,
            second_cache=second_cache.named(self.options.second_cache, cache=self.place.cache.root),
            keys=self.keys.of(one.settings),
        )

    def words(self, one: Universe) -> str:
        """Return what a universe chose otherwise than the study."""
        return many.in_words(many.differing(one.chosen, self.every[0].chosen).items())


def planned(options: Options, file: Path) -> Work:
    """Return the universes of a file of choices; all that can be refused is refused here."""
    asked = read_multiverse(file)

    def load(assignments: Sequence[str]) -> Settings:
        return bring.settings(options, asked.config, others={str(file): list(assignments)})

    study = load(())
    _check(asked, study)
    choices = universes.own_first(asked, load)
    names = [{one.name: [v.name for v in one.values] for one in choices if one.crossed is how} for how in (True, False)]
    chosen = many.universes(*names)
    workdir = Workdir(options.workdir)
    place = Beside(workdir, workdir.folder / _FOLDER / _WORK)
    keys = Keys(study, place)
    stages_ = asked.stages or study.stages
    every: list[Universe] = []
    for number, settings in enumerate(universes.settings_of(asked, choices, chosen, load)):
        every.append(universe(number, chosen[number], settings, stages_, keys))
        if not number:
            # What is hashed of the code for one universe is known for the others.
            keys = _warm(keys, every[0])
        _ready(every[-1])
    _reaching(asked, choices, every)
    return Work(options, asked, choices, every, chains(in_order(every)), keys, place, told_of.code(keys.memo))


def _warm(keys: Keys, one: Universe) -> Keys:
    for task in one.graph:
        keys.parts(task, ())
    return keys


def _check(asked: Multiverse, study: Settings) -> None:
    """Refuse a study that the paper has nothing to say on, and findings that there are not."""
    if not is_study(Results(study, ())):
        raise ConfigError(
            f"{study.study.name} is no study of takeovers: no verdict of the report is about it",
            cure="choose a configuration of the study, such as --config paper",
        )
    for name in asked.curves:
        if name not in told_of.FINDINGS:
            raise ConfigError(
                f"{asked.name}: curves names {name!r}{did_you_mean(name, told_of.FINDINGS)}",
                cure=f"findings: {', '.join(told_of.FINDINGS)}",
            )


def _reaching(asked: Multiverse, choices: Sequence[Choice], every: Sequence[Universe]) -> None:
    """Refuse choices that change no result, such as one of a stage that the file does not name: copies are no evidence.

    Raises:
        ConfigError: With all such choices.
    """
    pairs = many.pairs([one.chosen for one in every])
    idle = [one.name for one in choices if all(every[a].id == every[b].id for a, b in pairs[one.name])]
    if idle:
        ran = dict.fromkeys(task.name for task in every[0].graph)
        raise ConfigError(
            f"{asked.name}: whatever {' or '.join(idle)} is, all results are the same: it decides nothing in "
            f"{', '.join(ran)}, which is all that a universe consists of",
            cure="leave it out, or name the stage that it is for in stages",
        )


def _ready(one: Universe) -> None:
    """Refuse what cannot run of a universe, before anything does."""
    tasks = one.graph
    dataset.refuse(one.settings, dict.fromkeys(task.unit for task in tasks if task.name == "acquire"))
    for name in dict.fromkeys(task.name for task in tasks):
        stages.load(name).ready(one.settings.sections[name])
