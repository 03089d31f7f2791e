"""What commands share: the configuration and console of a call, its log, and bringing tasks up to date."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from hrcneuro import stages
from hrcneuro.cli.console import Console
from hrcneuro.cli.options import Options
from hrcneuro.config import settings as config
from hrcneuro.config.settings import Settings
from hrcneuro.errors import ConfigError
from hrcneuro.pipeline import executors, graph, walk
from hrcneuro.pipeline.provenance import command_line, provenance
from hrcneuro.pipeline.runlog import RunLog, recorded
from hrcneuro.pipeline.workdir import Workdir


def console(options: Options) -> Console:
    """Return the console of a call."""
    return Console(as_json=options.json, verbose=options.verbose, quiet=options.quiet, debug=options.debug)


def settings(options: Options, extra: Path | None = None) -> Settings:
    """Return the configuration of a call."""
    return config.load(options.config or extra, options.set or ())


def stage(name: str, options: Options, subjects: Sequence[str] | None) -> int:
    """Bring a stage, and what it stands on, up to date."""
    found = settings(options)
    wanted = graph.targets(found, [name], subjects or ())
    with logged(name, options, found) as log:
        items = bring(options, found, wanted, log)
        code = console(options).finish(name, items)
        log.end(items, code)
    return code


def planned(options: Options, settings: Settings, *, verify: bool = False) -> list[walk.Item]:
    """Return what would happen to every task of the study; nothing runs."""
    study = walk.Run(settings, Workdir(options.workdir), verify=verify)
    return study.plan(graph.targets(settings, stages.NAMES, ()))


def logged(name: str, options: Options, found: Settings) -> contextlib.AbstractContextManager[RunLog]:
    """Return the log of a run under way; a dry run leaves none."""
    if options.dry_run:
        return contextlib.nullcontext(RunLog(None))
    return recorded(Workdir(options.workdir).results, name, found, command_line())


def bring(options: Options, found: Settings, wanted: Iterable[graph.Task], log: RunLog) -> list[walk.Item]:
    """Bring tasks, and what they stand on, up to date (a dry run: say what would run); return every item."""
    talk = console(options)
    study = walk.Run(found, Workdir(options.workdir), verify=options.verify)
    wanted = list(wanted)
    tasks = graph.closure(found, wanted)
    if _moves_the_one_arm(found, tasks):
        # Not in a worker: Ctrl-C must reach the loop that drives it.
        options = replace(options, executor="serial")
    if options.dry_run:
        items = study.plan(wanted, force=options.force)
        for item in items:
            talk.report(item)
        return items
    executor = executors.create(options.executor, options.jobs or executors.cores())
    total = len(tasks)

    def tell(task: graph.Task, item: walk.Item) -> None:
        talk.report(item)
        log.item(item)

    try:
        with talk.progress(total), executor:
            return study.run(
                wanted,
                executor,
                force=options.force,
                provenance=provenance,
                report=tell,
            )
    except BaseException:
        # The workers are gone by now, perhaps not all of them in peace.
        study.workdir.cache.sweep()
        raise


def _moves_the_one_arm(found: Settings, tasks: Iterable[graph.Task]) -> bool:
    """Return whether tasks drive an arm that is there only once.

    Raises:
        ConfigError: They do for more than one subject: after a stop, the next session would move it with nobody asked.
    """
    subjects = [task.unit for task in tasks if task.stage == "robot"]
    section = found.sections["robot"]
    if not subjects or not stages.load("robot").one_arm(section):
        return False
    if len(subjects) > 1:
        raise ConfigError(
            f"robot.backend = {section.backend!r} has one arm, and {len(subjects)} subjects are asked of it "
            f"({', '.join(subjects)}); allowed: one subject a command",
            cure=f"hrcneuro robot {subjects[0]} with the same options, then the next; a pipeline for hrcneuro run "
            "leaves robot out of its stages or names one subject",
        )
    return True
