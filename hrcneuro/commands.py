"""What the commands do; cli.py declares them."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from hrcneuro import config, executors, pipeline, stages
from hrcneuro.cache.store import guarded
from hrcneuro.config import Settings
from hrcneuro.console import Console
from hrcneuro.errors import ConfigError, DataError, HrcError, StageError
from hrcneuro.options import Options
from hrcneuro.pipelines import Pipeline, read_pipeline
from hrcneuro.provenance import provenance
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
    items = _bring(options, found, pipeline.targets(found, [name], subjects or ()))
    return console(options).finish(name, items)


def export(options: Options, subjects: Sequence[str] | None, folder: Path, *, inspect: bool = False) -> int:
    """Bring acquire up to date and write what it made in the authors' layout, one folder a subject.

    Raises:
        ConfigError: The folder must not be written to, or an inspection, which writes nothing, is asked for too.
    """
    from hrcneuro.cache.fingerprint import digest
    from hrcneuro.contract import params
    from hrcneuro.sources import export as layout

    if inspect:
        raise ConfigError("--inspect writes nothing, --export does", cure="choose one of the two")
    found = settings(options)
    wanted = pipeline.targets(found, ["acquire"], subjects or ())
    study = digest([found.study.name, params(found.sections["acquire"])])[:16]
    layout.prepare(folder, [task.unit for task in wanted], study=study)
    items = _bring(options, found, wanted)
    talk, flaw = console(options), None
    for item in items if not options.dry_run else ():
        if item.state not in ("hit", "ran"):
            continue
        files = {name: Path(path) for name, path in item.artifacts.items()}
        try:
            told = layout.export_subject(
                files[f"{item.unit}_raw.fif"],
                files["trials.parquet"],
                folder,
                item.unit,
                key=item.key,
                study=study,
                source=str(item.summary["source"]),
            )
        except HrcError as error:
            flaw = flaw or error
            continue
        item.summary = {**item.summary, "export": told}
        talk.say(f"{'=' if told['state'] == 'hit' else '+'} export {item.unit}: {told['folder']}")
        for note in told["notes"]:
            talk.say(f"  note: {note}")
    return talk.finish("acquire", items, also=flaw)


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
    items = _bring(options, found, pipeline.targets(found, plan.stages, plan.subjects))
    flaw = None
    if plan.report and not options.dry_run:
        try:
            _report(options, found, items)
        except HrcError as error:
            flaw = error
    return console(options).finish("run", items, also=flaw)


def status(options: Options) -> int:
    """Print what is fresh and what is stale, as a table of units and stages."""
    found = settings(options)
    items = pipeline.Run(found, Workdir(options.workdir), verify=options.verify).plan(
        pipeline.targets(found, stages.NAMES, ())
    )
    talk = console(options)
    if not options.json:
        talk.status(items)
    return talk.finish("status", items)


def path(options: Options, name: str, unit: str, file: str) -> int:
    """Print where an artifact lies."""
    pipeline.check_stage(name)
    found = str(Workdir(options.workdir).artifact(name, unit, file))
    print(json.dumps({"command": "path", "ok": True, "path": found}, indent=1) if options.json else found)
    return 0


def report(options: Options) -> int:
    """Write the report from what has run so far."""
    found = settings(options)
    items = pipeline.Run(found, Workdir(options.workdir)).plan(pipeline.targets(found, stages.NAMES, ()))
    written = _report(options, found, items)
    if options.json:
        print(json.dumps({"command": "report", "ok": True, "report": str(written)}, indent=1))
    return 0


def inspect(options: Options, subjects: Sequence[str] | None) -> int:
    """Show what acquire would read: markers, channels and log side by side."""
    found = settings(options)
    module = stages.load("acquire")
    views = {s: module.inspect(found.sections["acquire"], s) for s in subjects or found.study.subjects}
    if options.json:
        print(json.dumps({"command": "acquire", "ok": True, "inspect": views}, indent=1))
    else:
        for view in views.values():
            print(module.render(view))
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


def _bring(options: Options, found: Settings, wanted: Iterable[pipeline.Task]) -> list[pipeline.Item]:
    talk = console(options)
    walk = pipeline.Run(found, Workdir(options.workdir), verify=options.verify)
    wanted = list(wanted)
    if options.dry_run:
        items = walk.plan(wanted, force=options.force)
        for item in items:
            talk.report(item)
        return items
    executor = executors.create(options.executor, options.jobs or executors.cores())
    total = len(pipeline.closure(found, wanted))
    try:
        with talk.progress(total), executor:
            return walk.run(
                wanted,
                executor,
                force=options.force,
                provenance=provenance,
                report=lambda task, item: talk.report(item),
            )
    except BaseException:
        # The workers are gone by now, perhaps not all of them in peace.
        walk.workdir.cache.sweep()
        raise


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
