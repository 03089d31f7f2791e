"""What commands share: the configuration and console of a call, its log, and bringing tasks up to date."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import interrupts, stages
from hrcneuro.cache.address import without_login
from hrcneuro.cli.at_once import answered
from hrcneuro.cli.console import Console
from hrcneuro.cli.options import Options
from hrcneuro.cli.progress import Progress
from hrcneuro.config import dataset
from hrcneuro.config import settings as config
from hrcneuro.config.settings import Settings
from hrcneuro.errors import HrcError
from hrcneuro.pipeline import disk_forecast, executors, forecast, graph, second_cache, sides, walk
from hrcneuro.pipeline.anonymous import command_line, hidden
from hrcneuro.pipeline.item import Item
from hrcneuro.pipeline.keys import check_places
from hrcneuro.pipeline.measured import measured
from hrcneuro.pipeline.provenance import provenance
from hrcneuro.pipeline.runlog import RunLog, recorded
from hrcneuro.pipeline.workdir import Workdir

if TYPE_CHECKING:
    from hrcneuro.pipeline.cluster import Site


def console(options: Options) -> Console:
    """Return the console of a call."""
    return Console(as_json=options.json, verbose=options.verbose, quiet=options.quiet, debug=options.debug)


def settings(options: Options, extra: Path | None = None, **others: Any) -> Settings:
    """Return the configuration of a call; ``others`` and ``mistakes`` of its other options as ``load`` takes them."""
    loaded = config.load(options.config or extra, options.set or (), **others)
    check_places(loaded, Workdir(options.workdir))
    return loaded


def stage(
    name: str,
    options: Options,
    subjects: Sequence[str] | None,
    *,
    others: Mapping[str, Sequence[str]] | None = None,
    mistakes: Sequence[str] = (),
    notes: Callable[[Settings, Sequence[Item]], Sequence[str]] = lambda study, items: (),
) -> int:
    """Bring a stage, and what it stands on, up to date; ``notes`` are what a person should know of the result."""
    study = settings(options, others=others, mistakes=mistakes)
    wanted = graph.targets(study, [name], subjects or ())
    with logged(name, options, study) as log:
        items = bring(options, study, wanted, log)
        for note in notes(study, items) if not options.dry_run else ():
            console(options).say(f"note: {note}", style="yellow")
        code = finished(name, options, study, items, wanted)
        log.end(items, code)
    return code


def finished(
    name: str,
    options: Options,
    study: Settings,
    items: Sequence[Item],
    wanted: Iterable[graph.Task],
    *,
    whole: bool = False,
    also: HrcError | None = None,
) -> int:
    """Print what came out of the tasks that were asked for, what failed, and how many did what; return the exit code.

    Args:
        name: The command's.
        options: The command's.
        study: The configuration.
        items: Of all tasks.
        wanted: Those that were asked for.
        whole: A whole study was: a stage is told in fewer lines.
        also: What failed and is of no item.
    """
    from hrcneuro.cli import results

    talk = console(options)
    if not options.dry_run:
        asked = {(task.name, task.unit) for task in wanted}
        done = [item for item in items if item.state.done and (item.stage, item.unit) in asked]
        talk.results(results.blocks([(i.stage, i.unit, i.summary) for i in done], whole=whole))
    disk = disk_forecast.expected(Workdir(options.workdir), items, study) if options.dry_run else None
    return talk.finish(name, items, also=also, planned=options.dry_run, disk=disk)


def planned(options: Options, settings: Settings) -> list[Item]:
    """Return what would happen to every task of the study; nothing runs."""
    return sides.told(settings, whole(options, settings).plan())


def logged(name: str, options: Options, settings: Settings) -> contextlib.AbstractContextManager[RunLog]:
    """Return the log of a run under way; a dry run leaves none."""
    if options.dry_run:
        return contextlib.nullcontext(RunLog(None))
    workdir = Workdir(options.workdir)
    private = hidden(settings, workdir.folder, workdir.cache.root)
    return recorded(workdir.results, name, settings, command_line(), hidden=private)


def bring(
    options: Options, settings: Settings, wanted: Iterable[graph.Task], log: RunLog, *, joint: bool = False
) -> list[Item]:
    """Bring tasks, and what they stand on, up to date (a dry run: say what would run); return every item.

    ``joint`` asks for the pictures that join stages, too.
    """
    wanted = list(wanted)
    tasks = _graph(options, settings, wanted, joint=joint)
    dataset.refuse(settings, dict.fromkeys(task.unit for task in tasks if task.name == "acquire"))
    for name in dict.fromkeys(task.name for task in tasks if not task.draws):
        for note in (*stages.load(name).notes(settings.sections[name]), *settings.remarks.get(name, ())):
            console(options).say(f"note: {note}", style="yellow")
        stages.load(name).ready(settings.sections[name])
    workdir = Workdir(options.workdir)
    study = walk.Run(
        settings,
        workdir,
        tasks,
        verify=options.verify,
        # A whole study goes on with what is there; who names a stage wants its files.
        whole=() if joint else wanted,
        second_cache=second_cache.named(options.second_cache, cache=workdir.cache.root),
    )
    forced = _forced(wanted, tasks) if options.force else []
    if graph.in_real_time(settings, tasks):
        # Not in a worker: Ctrl-C must reach the loop that drives the arm.
        options = replace(options, executor="serial")
    if options.dry_run:
        talk = console(options)
        items = study.plan(forced)
        talk.planned(items)
        return items
    return _walked(options, study, log, forced=forced)


def draw(options: Options, settings: Settings, log: RunLog) -> list[Item]:
    """Draw what can be drawn of the numbers that are up to date; return every item of the study."""
    study = whole(options, settings)
    forced = [task for task in study.nodes if task.draws] if options.force else []
    return sides.told(settings, _walked(options, study, log, forced=forced, pictures_only=True))


def whole(options: Options, settings: Settings) -> walk.Run:
    """Return the whole study, with the sweep that was asked for last."""
    workdir = Workdir(options.workdir)
    known = sides.remembered(settings, workdir)
    tasks = _graph(options, known, graph.targets(known, settings.stages, ()), joint=True)
    second = second_cache.named(options.second_cache, cache=workdir.cache.root)
    return walk.Run(known, workdir, tasks, verify=options.verify, second_cache=second)


def _walked(options: Options, study: walk.Run, log: RunLog, **how: Any) -> list[Item]:
    talk = console(options)
    source = without_login(study.second_cache)
    note = None if options.quiet else partial(talk.say, style="yellow")
    executor = executor_of(options, study, note)

    def tell(item: Item) -> None:
        talk.report(item)
        log.item(item)

    places = [(task.name, task.unit) for task in study.nodes]
    last = measured(study.workdir, places) if talk.shows_progress else {}
    known = {place: took.seconds for place, took in last.items() if took.seconds}
    workers = 1 if isinstance(executor, executors.Serial) else options.jobs or executors.cores()
    progress = Progress(len(places), forecast.Forecast(places, known, workers=workers), workers=workers)
    answer = partial(talk.say, "interrupted: what is under way is being ended", style="yellow")
    try:
        with talk.progress(progress), answered(answer), executor, interrupts.whole():
            items = study.run(executor, provenance=provenance, report=tell, tell=note, **how)
    except BaseException:
        # The workers are gone by now, perhaps not all of them in peace.
        study.workdir.cache.sweep()
        raise
    if pulled := sum(item.pulled for item in items):
        talk.say(f"{pulled} results were taken from {source or 'the second cache of the workers'}")
    return items


def executor_of(options: Options, study: walk.Run, note: Callable[[str], None] | None) -> executors.Executor:
    """Return where the jobs of a study run; a study whose workers are elsewhere knows then what these may read."""
    from hrcneuro.pipeline.resources import retries

    if options.executor in executors.ELSEWHERE:
        study.second_cache = second_cache.for_workers(study.second_cache)
    return executors.create(
        options.executor,
        options.jobs or executors.cores(),
        lambda: _site(options, study, note),
        lambda task: retries(task, study.settings.live["cluster"]),
    )


def _site(options: Options, study: walk.Run, note: Callable[[str], None] | None) -> Site:
    """Return what an executor for other machines needs to know of a study."""
    from hrcneuro.pipeline.cluster import Site
    from hrcneuro.pipeline.resources import most, resources

    cluster = study.settings.live["cluster"]
    known = most(measured(study.workdir, [(task.name, task.unit) for task in study.nodes]))
    here = options.executor == "dask" and not cluster.scheduler
    return Site(
        root=study.workdir.cache.root,
        options=cluster,
        resources=lambda task: resources(task, cluster, known),
        workers=options.jobs or (executors.cores() if here else 0),
        notify=note or (lambda text: None),
    )


def _graph(options: Options, settings: Settings, wanted: Iterable[graph.Task], *, joint: bool) -> graph.Graph:
    numbers = graph.closure(settings, wanted)
    return numbers if options.no_figures else numbers | graph.pictures(settings, numbers, joint=joint)


def _forced(wanted: Iterable[graph.Task], tasks: graph.Graph) -> list[graph.Task]:
    """Return what is wanted, and its pictures."""
    named = {(task.name, task.unit) for task in wanted}
    return [task for task in tasks if (task.subject, task.unit) in named]
