"""The commands that look at a whole study: run, status, path, report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options

if TYPE_CHECKING:
    from hrcneuro.config.settings import Settings
    from hrcneuro.errors import HrcError
    from hrcneuro.pipeline.item import Item


@command("Run a whole pipeline, then write the report.", "run", "run smoke -j 2", name="run")
def run(
    options: Options,
    pipeline: Annotated[
        Path | None,
        typer.Argument(
            help="A pipeline file, or smoke or paper; none: pipelines/paper.toml, else all stages.",
            autocompletion=completion.pipelines,
        ),
    ] = None,
) -> int:
    """Run a pipeline's stages over its subjects, then write the report."""
    from hrcneuro.cli import bring
    from hrcneuro.config import crosschecks
    from hrcneuro.config.pipelinefile import Pipeline, read_pipeline
    from hrcneuro.errors import HrcError
    from hrcneuro.pipeline import graph

    default = Path("pipelines/paper.toml")
    plan = read_pipeline(pipeline or default) if pipeline or default.is_file() else Pipeline()
    settings = bring.settings(options, plan.config)
    wanted = graph.targets(settings, plan.stages or settings.stages, plan.subjects)
    if settings.left_out and not plan.stages:
        bring.console(options).say(f"note: {crosschecks.without_moves(settings)}", style="yellow")
    with bring.logged("run", options, settings) as log:
        items = bring.bring(options, settings, wanted, log, joint=True)
        flaw = None
        if plan.report and not options.dry_run:
            try:
                if written := _write_report(options, settings, _all_of(options, settings, items)):
                    log.write("report", file=written.name)
            except HrcError as error:
                flaw = error
        code = bring.finished("run", options, settings, items, wanted, whole=True, also=flaw)
        log.end(items, code)
    return code


@command("Show what is fresh, what is stale and why.", "status", "status --set preprocess.l_freq=0.5", name="status")
def status(options: Options) -> int:
    """Print what is fresh and what is stale, as a table of units and stages."""
    from hrcneuro.cli import bring

    items = bring.planned(options, bring.settings(options))
    talk = bring.console(options)
    if not options.json:
        talk.status(items)
    return talk.finish("status", items, planned=True)


_Last = Annotated[
    bool, typer.Option("--last", help="What was last computed here, whatever the configuration asks for.")
]


@command("Print what came out of this configuration.", "show decode s01", "show epoch", name="show")
def show(
    options: Options,
    stage: Annotated[
        str, typer.Argument(help="The stage; none: what there is to show.", autocompletion=completion.stages)
    ] = "",
    unit: Annotated[
        str,
        typer.Argument(
            help="A subject, group, sweep or evidence; none: what is of all, else all subjects.",
            autocompletion=completion.units,
        ),
    ] = "",
    last: _Last = False,
) -> int:
    """Print the numbers of a stage again; compute nothing."""
    from hrcneuro.cli import bring, results
    from hrcneuro.pipeline import graph
    from hrcneuro.pipeline.workdir import Workdir

    settings = bring.settings(options)
    workdir = Workdir(options.workdir)
    talk = bring.console(replace(options, quiet=False))
    if not stage:
        of = results.there(settings, workdir, whatever=last)
        if options.json:
            print(json.dumps({"command": "show", "ok": True, "stages": of}, indent=1))
        width = max(map(len, of))
        lines = [f"{name:<{width}}  {', '.join(units)}" for name, units in of.items()]
        talk.results([*lines, "hrcneuro show STAGE [UNIT] prints the numbers of one"])
        return 0
    graph.check_stage(stage)
    summaries = (results.last if last else results.asked_for)(settings, workdir, stage, unit)
    if options.json:
        print(json.dumps({"command": "show", "ok": True, "stage": stage, "units": summaries}, indent=1))
    talk.results(results.blocks([(stage, one, summary) for one, summary in summaries.items()], every=True))
    return 0


@command(
    "Print where an artifact of this configuration lies.",
    "path preprocess s01",
    "path epoch s01 conditions.parquet",
    name="path",
)
def path(
    options: Options,
    stage: Annotated[str, typer.Argument(help="The stage that wrote it.", autocompletion=completion.stages)],
    unit: Annotated[str, typer.Argument(help="A subject, or group.", autocompletion=completion.units)],
    file: Annotated[str, typer.Argument(help="A file of the entry; none prints its folder.")] = "",
    last: _Last = False,
) -> int:
    """Print where an artifact lies."""
    from hrcneuro.cli import bring
    from hrcneuro.pipeline import asked, graph
    from hrcneuro.pipeline.workdir import Workdir

    graph.check_stage(stage, joint=True)
    workdir = Workdir(options.workdir)
    if last:
        place = workdir.artifact(stage, unit, file)
    else:
        place = asked.place(bring.settings(options), workdir, stage, unit, file)
    print(json.dumps({"command": "path", "ok": True, "path": str(place)}, indent=1) if options.json else place)
    return 0


@command("Write the report from what has run.", "report", "report --workdir study", name="report")
def report(options: Options) -> int:
    """Draw what is missing of the numbers that are up to date, and write the report from what has run so far."""
    from hrcneuro.cli import bring
    from hrcneuro.pipeline.item import State
    from hrcneuro.pipeline.workdir import Workdir
    from hrcneuro.report import shelf

    code = 0
    settings = bring.settings(options)
    talk = bring.console(options)
    if options.dry_run:
        items = bring.planned(options, settings)
        drawn = [item for item in items if item.draws and not item.state.done]
        draws = ", ".join(f"{i.stage} {i.unit}" for i in drawn) or "nothing"
        place: Path | None = shelf.folder(Workdir(options.workdir).results, settings) / shelf.PAGE
        talk.results([f"would draw {draws}", f"would write {place}"])
    else:
        with bring.logged("report", options, settings) as log:
            items = bring.planned(options, settings) if options.no_figures else bring.draw(options, settings, log)
            place = _write_report(options, settings, items)
            if place is None:
                raise _nothing(options, settings)
            if lacks := shelf.told(settings, items):
                talk.say(f"note: {lacks}", style="yellow")
            failed = [item for item in items if item.draws and item.state is State.FAILED]
            code = talk.failures(failed)
            log.end(items, code)
    if options.json:
        missing = shelf.lacking(settings, items)
        print(json.dumps({"command": "report", "ok": code == 0, "report": str(place), "missing": missing}, indent=1))
    return code


def _all_of(options: Options, settings: Settings, items: Sequence[Item]) -> list[Item]:
    """Return the items of a run, and what else of the study is up to date: a run of less takes nothing away.

    A picture of the group that a run of few subjects drew gives way to that of all, where there is one.
    """
    from hrcneuro.cli import bring
    from hrcneuro.contract import GROUP

    shown = {(item.stage, item.unit): item for item in items}
    if all((task.name, task.unit) in shown for task in bring.whole(options, settings).nodes):
        return list(items)  # there is no more, so nothing to look for
    for one in bring.planned(options, settings):
        place = (one.stage, one.unit)
        if one.state.done and (place not in shown or (one.draws and one.unit == GROUP)):
            shown[place] = one
    return list(shown.values())


def _write_report(options: Options, settings: Settings, items: Sequence[Item]) -> Path | None:
    """Write the report and say where it is; None where nothing of this configuration has run."""
    from hrcneuro.cache.disk import guarded
    from hrcneuro.cli import bring
    from hrcneuro.errors import HrcError, StageError
    from hrcneuro.pipeline.workdir import Workdir
    from hrcneuro.report import shelf

    if not any(item.state.done and not item.draws for item in items):
        return None
    results = Workdir(options.workdir).results
    with guarded(results):
        try:
            placed = shelf.place(settings, items, results)
        except (HrcError, OSError):
            raise
        except Exception as error:
            # The stages' results stand, and must still be told.
            problem = f"the report could not be made: {type(error).__name__}: {error}"
            raise StageError(problem, cure="hrcneuro report --debug shows where; please report it as a bug") from error
    talk = bring.console(options)
    talk.say(f"report: {placed.path}")
    if placed.kept is not None:
        text = f"note: it has less than an earlier one of this configuration, which was kept: {placed.kept}"
        talk.say(text, style="yellow")
    if placed.others is not None:
        talk.say(f"all reports here: {placed.others}")
    return placed.path


def _nothing(options: Options, settings: Settings) -> HrcError:
    from hrcneuro.errors import DataError
    from hrcneuro.pipeline.workdir import Workdir
    from hrcneuro.report import shelf

    results, own = Workdir(options.workdir).results, shelf.name(settings)
    there = shelf.names(results)
    has = "is up to date" if own in there else "has run"
    problem = f"nothing of this configuration ({own}) {has} in {results.parent}"
    if own in there:
        problem += f"; its earlier report is {shelf.folder(results, settings) / shelf.PAGE}"
    elif there:
        problem += f"; the reports there are of {', '.join(there)}"
    return DataError(
        problem, cure="run it first: hrcneuro run, with the same --config and --set; or name those of what has run"
    )
