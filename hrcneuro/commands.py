"""What the commands do; cli.py declares them."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from hrcneuro import config, executors, graph, pipeline, stages
from hrcneuro.cache.store import guarded
from hrcneuro.config import Settings
from hrcneuro.console import Console
from hrcneuro.errors import ConfigError, DataError, HrcError, StageError
from hrcneuro.options import Options
from hrcneuro.pipelines import Pipeline, read_pipeline
from hrcneuro.provenance import command_line, provenance
from hrcneuro.runlog import RunLog, recorded
from hrcneuro.workdir import Workdir


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


def with_sweep(options: Options, axes: Sequence[str]) -> Options:
    """Return the options with ``--sweep AXIS=VALUES`` written as assignments.

    Raises:
        ConfigError: An axis has no values.
    """
    added = []
    for text in axes:
        if text == "wide":
            wide = stages.load("simulate").WIDE_SWEEP
            added += [f"simulate.sweep.{axis}={list(values)}" for axis, values in wide.items()]
            continue
        axis, equals, values = text.partition("=")
        if not equals or not axis.strip() or not values.strip():
            raise ConfigError(
                f"--sweep {text!r} names no values", cure="write --sweep accuracy=55,60,65, or --sweep wide"
            )
        added.append(f"simulate.sweep.{axis.strip()}=[{values}]")
    return replace(options, set=[*(options.set or []), *added])


def run(options: Options, path: Path | None) -> int:
    """Run a pipeline's stages over its subjects, then write the report."""
    default = Path("pipelines/paper.toml")
    plan = read_pipeline(path or default) if path or default.is_file() else Pipeline()
    found = settings(options, plan.config)
    wanted = graph.targets(found, plan.stages, plan.subjects)
    with logged("run", options, found) as log:
        items = bring(options, found, wanted, log)
        flaw = None
        if plan.report and not options.dry_run:
            try:
                log.write("report", file=_report(options, found, items).name)
            except HrcError as error:
                flaw = error
        code = console(options).finish("run", items, also=flaw)
        log.end(items, code)
    return code


def status(options: Options) -> int:
    """Print what is fresh and what is stale, as a table of units and stages."""
    found = settings(options)
    items = pipeline.Run(found, Workdir(options.workdir), verify=options.verify).plan(
        graph.targets(found, stages.NAMES, ())
    )
    talk = console(options)
    if not options.json:
        talk.status(items)
    return talk.finish("status", items)


def path(options: Options, name: str, unit: str, file: str) -> int:
    """Print where an artifact lies."""
    graph.check_stage(name)
    found = str(Workdir(options.workdir).artifact(name, unit, file))
    print(json.dumps({"command": "path", "ok": True, "path": found}, indent=1) if options.json else found)
    return 0


def report(options: Options) -> int:
    """Write the report from what has run so far."""
    found = settings(options)
    items = pipeline.Run(found, Workdir(options.workdir)).plan(graph.targets(found, stages.NAMES, ()))
    if options.dry_run:
        written = Workdir(options.workdir).results / "report.html"
        console(options).say(f"would write {written}")
    else:
        written = _report(options, found, items)
    if options.json:
        print(json.dumps({"command": "report", "ok": True, "report": str(written)}, indent=1))
    return 0


def cache_ls(options: Options) -> int:
    """List the entries with their sizes, and which of them results point at."""
    workdir = Workdir(options.workdir)
    used = workdir.keys()
    rows = []
    for folder in workdir.cache.entries():
        size = sum(p.stat().st_size for p in folder.rglob("*") if p.is_file())
        name = (folder.parts[-3], folder.parts[-2], folder.name)
        rows.append((*name, size, name in used))
    if options.json:
        columns = ("stage", "unit", "key", "bytes", "used")
        entries = [dict(zip(columns, row, strict=True)) for row in rows]
        print(json.dumps({"command": "cache ls", "ok": True, "entries": entries}, indent=1))
        return 0
    for stage_name, unit, key, size, pointed in rows:
        print(f"{'*' if pointed else ' '} {stage_name:<11} {unit:<8} {key}  {size / 1e6:9.1f} MB")
    print(f"{len(rows)} entries, {sum(row[3] for row in rows) / 1e9:.2f} GB; * = results point at it")
    return 0


def cache_verify(options: Options) -> int:
    """Hash all entries; quarantine and name the bad ones. Exit code 3 where there was one."""
    workdir = Workdir(options.workdir)
    bad = {}
    entries = workdir.cache.entries()
    for folder in entries:
        name = (folder.parts[-3], folder.parts[-2], folder.name)
        flaw = workdir.cache.diagnose(*name, verify=True)
        if flaw:
            bad["/".join(name)] = flaw
            # A cache that cannot be written can still be judged.
            if not options.dry_run:
                with contextlib.suppress(HrcError):
                    workdir.cache.quarantine(*name)
    if options.json:
        print(json.dumps({"command": "cache verify", "ok": not bad, "entries": len(entries), "bad": bad}, indent=1))
    else:
        for entry, flaw in bad.items():
            print(f"bad: {entry}: {flaw}")
        print(f"{len(entries) - len(bad)} of {len(entries)} entries are sound")
    return DataError.exit_code if bad else 0


def cache_gc(options: Options) -> int:
    """Drop the entries that no result points at, leftovers of interrupted runs, and quarantined entries."""
    import shutil

    workdir = Workdir(options.workdir)
    workdir.cache.sweep()
    used = workdir.keys()
    doomed = [p for p in workdir.cache.entries() if (p.parts[-3], p.parts[-2], p.name) not in used]
    doomed += [p for p in workdir.cache.leftovers() if p.parent.name == ".quarantine"]
    size = sum(q.stat().st_size for p in doomed for q in p.rglob("*") if q.is_file())
    for folder in doomed if not options.dry_run else ():
        with workdir.cache.guarded():
            shutil.rmtree(folder)
    if options.json:
        names = ["/".join(p.parts[-3:]) for p in doomed]
        print(json.dumps({"command": "cache gc", "ok": True, "dropped": names, "bytes": size}, indent=1))
    else:
        verb = "would drop" if options.dry_run else "dropped"
        print(f"{verb} {len(doomed)} entries, {size / 1e9:.2f} GB")
    return 0


def config_show(options: Options, section: str) -> int:
    """Print the effective configuration, with the origin and the range of each value."""
    from hrcneuro import configtext

    print(configtext.render(settings(options), section, as_json=options.json))
    return 0


def config_check(options: Options) -> int:
    """Report the mistakes of a configuration (by raising them), else its warnings."""
    found = settings(options)
    if options.json:
        print(json.dumps({"command": "config check", "ok": True, "warnings": list(found.warnings)}, indent=1))
    else:
        for warning in found.warnings:
            print(f"note: {warning}")
        print("the configuration is sound")
    return 0


def logged(name: str, options: Options, found: Settings) -> contextlib.AbstractContextManager[RunLog]:
    """Return the log of a run under way; a dry run leaves none."""
    if options.dry_run:
        return contextlib.nullcontext(RunLog(None))
    return recorded(Workdir(options.workdir).results, name, found, command_line())


def bring(options: Options, found: Settings, wanted: Iterable[graph.Task], log: RunLog) -> list[pipeline.Item]:
    """Bring tasks, and what they stand on, up to date (a dry run: say what would run); return every item."""
    talk = console(options)
    walk = pipeline.Run(found, Workdir(options.workdir), verify=options.verify)
    wanted = list(wanted)
    tasks = graph.closure(found, wanted)
    if _moves_the_one_arm(found, tasks):
        # Not in a worker: Ctrl-C must reach the loop that drives it.
        options = replace(options, executor="serial")
    if options.dry_run:
        items = walk.plan(wanted, force=options.force)
        for item in items:
            talk.report(item)
        return items
    executor = executors.create(options.executor, options.jobs or executors.cores())
    total = len(tasks)

    def tell(task: graph.Task, item: pipeline.Item) -> None:
        talk.report(item)
        log.item(item)

    try:
        with talk.progress(total), executor:
            return walk.run(
                wanted,
                executor,
                force=options.force,
                provenance=provenance,
                report=tell,
            )
    except BaseException:
        # The workers are gone by now, perhaps not all of them in peace.
        walk.workdir.cache.sweep()
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


def _report(options: Options, found: Settings, items: Sequence[pipeline.Item]) -> Path:
    from hrcneuro.report import write_report

    workdir = Workdir(options.workdir)
    with guarded(workdir.results):
        try:
            written = write_report(found, items, workdir.results / "report.html")
        except (HrcError, OSError):
            raise
        except Exception as error:
            # The stages' results stand, and must still be told.
            problem = f"the report could not be made: {type(error).__name__}: {error}"
            raise StageError(problem, cure="hrcneuro report --debug shows where; please report it as a bug") from error
    console(options).say(f"report: {written}")
    return written
