"""What the command multiverse does: plan, say what it costs, run and judge each universe, let go of what is over."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from hrcneuro import interrupts, stages
from hrcneuro.analyses import multiverse as many
from hrcneuro.answers.words import counted, roughly
from hrcneuro.cache.disk import guarded
from hrcneuro.cli import bring
from hrcneuro.cli.at_once import answered
from hrcneuro.cli.console import Console
from hrcneuro.cli.options import Options
from hrcneuro.config import dataset, universes
from hrcneuro.config.multiverses import Choice, Multiverse, read_multiverse
from hrcneuro.config.settings import Settings
from hrcneuro.errors import ConfigError, StageError, did_you_mean
from hrcneuro.pipeline import executors, second_cache, walk
from hrcneuro.pipeline.beside import Beside
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.keys import Keys
from hrcneuro.pipeline.provenance import provenance
from hrcneuro.pipeline.runlog import RunLog
from hrcneuro.pipeline.universe_cost import Cost, cost
from hrcneuro.pipeline.universes import Universe, chains, in_order, judged_place, last_uses, let_go, universe
from hrcneuro.pipeline.workdir import Workdir
from hrcneuro.report import multiverse as told_of
from hrcneuro.report.claims import is_study
from hrcneuro.report.multiverse import Judged
from hrcneuro.report.multiverse_files import Written, write
from hrcneuro.report.results import Results

_FOLDER, _WORK = "multiverse", ".work"


@dataclass
class _Work:
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
            second_cache=second_cache.named(self.options.second_cache),
            keys=self.keys.of(one.settings),
        )


def run(options: Options, file: Path, disk_gb: float | None) -> int:
    """Plan, run and judge a multiverse; return the exit code."""
    work = _planned(options, file)
    talk = bring.console(options)
    for one in work.every:
        if (rows := told_of.read_judged(work.kept(one))) is not None and not options.force:
            work.judged[one.number] = rows
    pending = in_order([one for one in work.every if one.number not in work.judged])
    limit = None if disk_gb is None else round(disk_gb * 1e9)
    wanted = cost(
        work.study,
        work.every,
        pending,
        lambda one: work.walk(one).plan(),
        chains=len(set(work.chains.values())),
        limit=limit,
    )
    if options.dry_run:
        talk.results(wanted.lines())
    else:
        for line in wanted.lines():
            talk.say(line)
    wanted.refuse()
    if options.dry_run:
        if options.json:
            print(json.dumps({"command": "multiverse", "ok": True, "cost": wanted.document()}, indent=1))
        return 0
    with bring.logged("multiverse", options, work.every[0].settings) as log:
        _run(work, pending, talk, log)
        written = _written(work, wanted) if work.judged else Written()
        failed = [item for items in work.failed.values() for item in items if item.state is State.FAILED]
        code = _finished(work, talk, wanted, written, failed)
        log.end(failed, code)
    return code


def _planned(options: Options, file: Path) -> _Work:
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
    return _Work(options, asked, choices, every, chains(in_order(every)), keys, place, told_of.code(keys.memo))


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


def _ready(one: Universe) -> None:
    """Refuse what cannot run of a universe, before anything does."""
    tasks = one.graph
    dataset.refuse(one.settings, dict.fromkeys(task.unit for task in tasks if task.name == "acquire"))
    for name in dict.fromkeys(task.name for task in tasks):
        stages.load(name).ready(one.settings.sections[name])


def _run(work: _Work, pending: Sequence[Universe], talk: Console, log: RunLog) -> None:
    """Run and judge universes, one after the other; after each, drop what none of the others needs."""
    if not pending:
        return
    options, note = work.options, None if work.options.quiet else partial(talk.say, style="yellow")
    first = work.walk(pending[0])
    if options.executor in executors.ELSEWHERE:
        first.second_cache = second_cache.for_workers(first.second_cache)
    executor = executors.create(
        options.executor, options.jobs or executors.cores(), lambda: bring.site_of(options, first, note)
    )
    last = last_uses(pending)
    answer = partial(talk.say, "interrupted: what is under way is being ended", style="yellow")

    def tell(item: Item) -> None:
        if options.verbose or item.state is State.FAILED:
            talk.report(item)
        log.item(item)

    try:
        with answered(answer), executor, interrupts.whole():
            for place, one in enumerate(pending, 1):
                study = work.walk(one)
                study.second_cache = first.second_cache
                items = study.run(executor, provenance=provenance, report=tell, tell=note)
                _judge(work, one, items)
                _let_go(work, one, items, last)
                if one.number in work.judged:
                    with guarded(work.place.place):
                        told_of.keep_judged(work.kept(one), work.judged[one.number])
                talk.say(f"{place}/{len(pending)} {_words(one, work)}: {_counts(items)}")
    except BaseException:
        work.study.cache.sweep()
        raise


def _judge(work: _Work, one: Universe, items: Sequence[Item]) -> None:
    work.seconds += sum(item.seconds for item in items if item.state is State.RAN)
    bad = [item for item in items if not item.state.done]
    if bad:
        work.failed[one.number] = bad
    else:
        work.judged[one.number] = told_of.judge(one.settings, items)


def _let_go(work: _Work, one: Universe, items: Sequence[Item], last: Mapping[Any, int]) -> None:
    """Drop what this universe was the last to need, before it counts as judged: else a kill would leave it there."""
    over = {lineage[:2] for lineage in one.lineages.values() if last[lineage] == one.number}
    let_go(work.place, work.study, [item for item in items if item.state.done and (item.stage, item.unit) in over])


def _words(one: Universe, work: _Work) -> str:
    return many.in_words(many.differing(one.chosen, work.every[0].chosen).items())


def _counts(items: Sequence[Item]) -> str:
    ran, failed = (sum(item.state is state for item in items) for state in (State.RAN, State.FAILED))
    return f"{ran} ran, {len(items) - ran - failed} fresh" + (f", {failed} failed" if failed else "")


def _written(work: _Work, wanted: Cost) -> Written:
    """Write tables, pictures and the page of what is judged."""
    ended = [
        Judged(one.number, work.chains[one.number], one.chosen, work.judged[one.number])
        for one in work.every
        if one.number in work.judged
    ]
    study = work.every[0]
    # Its recordings may be dropped by now; what their records say of their origin is there.
    reality = Results(study.settings, work.walk(study).plan()).reality[1]
    notes = [f"failed and not judged: {_words(work.every[number], work)}" for number in work.failed]
    try:
        with guarded(work.out):
            return write(
                work.out,
                ended,
                study=study.settings.study.name,
                own=study.chosen,
                reality=reality,
                what=f"{wanted.lines()[0].partition(';')[0]}. {_how(work.choices)}",
                notes=notes,
                choices=[_choice(one) for one in work.choices],
                curves=work.asked.curves or told_of.CURVES,
                failed=[Judged(number, work.chains[number], work.every[number].chosen, ()) for number in work.failed],
            )
    except (ValueError, KeyError, TypeError) as error:
        # What was judged is kept.
        problem = f"the multiverse's page could not be made: {type(error).__name__}: {error}"
        raise StageError(problem, cure="--debug shows where; please report it as a bug") from error


def _how(choices: Sequence[Choice]) -> str:
    crossed = [one.name for one in choices if one.crossed]
    alone = [one.name for one in choices if not one.crossed]
    parts = [f"Crossed in full: {', '.join(crossed)}." if crossed else ""]
    parts += [f"One at a time, all else as in the study: {', '.join(alone)}." if alone else ""]
    return " ".join(part for part in parts if part)


def _choice(one: Choice) -> tuple[str, str, str]:
    return one.name, "crossed" if one.crossed else "one at a time", "; ".join(value.name for value in one.values)


def _finished(work: _Work, talk: Console, wanted: Cost, written: Written, failed: Sequence[Item]) -> int:
    """Print what came out; return the exit code."""
    if work.options.json:
        answer = {
            "command": "multiverse",
            "ok": not work.failed,
            "cost": wanted.document(),
            "judged": len(work.judged),
            "failed": {number: _words(work.every[number], work) for number in work.failed},
            "seconds": round(work.seconds, 3),
            "summary": written.summary,
            "files": {name: str(path) for name, path in written.files.items()},
        }
        print(json.dumps(answer, indent=1))
    if written.files:
        talk.results([*written.lines, f"page: {written.page}"])
    code = talk.failures(failed)
    blocked = f", {counted(len(work.failed), 'universe')} failed" if work.failed else ""
    took = f"; {roughly(work.seconds)} of work" if work.seconds else ""
    talk.say(f"multiverse: {counted(len(work.judged), 'universe')} judged{blocked}{took}")
    return code or int(bool(work.failed))
