"""The commands that look at a whole study: run, status, path, report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options

if TYPE_CHECKING:
    from hrcneuro.config.settings import Settings
    from hrcneuro.pipeline.item import Item


@command("Run a whole pipeline, then write the report.", "run", "run pipelines/smoke.toml -j 2", name="run")
def run(
    options: Options,
    pipeline: Annotated[Path | None, typer.Argument(help="A pipeline file; none means pipelines/paper.toml.")] = None,
) -> int:
    """Run a pipeline's stages over its subjects, then write the report."""
    from hrcneuro.cli import bring
    from hrcneuro.config.pipelinefile import Pipeline, read_pipeline
    from hrcneuro.errors import HrcError
    from hrcneuro.pipeline import graph

    default = Path("pipelines/paper.toml")
    plan = read_pipeline(pipeline or default) if pipeline or default.is_file() else Pipeline()
    settings = bring.settings(options, plan.config)
    wanted = graph.targets(settings, plan.stages, plan.subjects)
    with bring.logged("run", options, settings) as log:
        items = bring.bring(options, settings, wanted, log, joint=True)
        flaw = None
        if plan.report and not options.dry_run:
            try:
                log.write("report", file=_write_report(options, settings, items).name)
            except HrcError as error:
                flaw = error
        code = bring.console(options).finish("run", items, also=flaw)
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
    return talk.finish("status", items)


@command("Print where an artifact lies.", "path preprocess s01", "path epoch s01 conditions.parquet", name="path")
def path(
    options: Options,
    stage: Annotated[str, typer.Argument(help="The stage that wrote it.", autocompletion=completion.stages)],
    unit: Annotated[str, typer.Argument(help="A subject, or group.", autocompletion=completion.units)],
    file: Annotated[str, typer.Argument(help="A file of the entry; none prints its folder.")] = "",
) -> int:
    """Print where an artifact lies."""
    from hrcneuro.pipeline import graph
    from hrcneuro.pipeline.workdir import Workdir

    graph.check_stage(stage, joint=True)
    place = str(Workdir(options.workdir).artifact(stage, unit, file))
    print(json.dumps({"command": "path", "ok": True, "path": place}, indent=1) if options.json else place)
    return 0


@command("Write the report from what has run.", "report", "report --workdir study", name="report")
def report(options: Options) -> int:
    """Draw what is missing of the numbers that are up to date, and write the report from what has run so far."""
    from hrcneuro.cli import bring
    from hrcneuro.pipeline.item import State
    from hrcneuro.pipeline.workdir import Workdir

    code = 0
    settings = bring.settings(options)
    talk = bring.console(options)
    place = Workdir(options.workdir).results / "report.html"
    if options.dry_run:
        drawn = [item for item in bring.planned(options, settings) if item.draws and not item.state.done]
        talk.say(f"would draw {', '.join(f'{i.stage} {i.unit}' for i in drawn) or 'nothing'}")
        talk.say(f"would write {place}")
    else:
        with bring.logged("report", options, settings) as log:
            items = bring.planned(options, settings) if options.no_figures else bring.draw(options, settings, log)
            place = _write_report(options, settings, items)
            failed = [item for item in items if item.draws and item.state is State.FAILED]
            code = talk.failures(failed)
            log.end(items, code)
    if options.json:
        print(json.dumps({"command": "report", "ok": code == 0, "report": str(place)}, indent=1))
    return code


def _write_report(options: Options, settings: Settings, items: Sequence[Item]) -> Path:
    from hrcneuro.cache.store import guarded
    from hrcneuro.cli import bring
    from hrcneuro.errors import HrcError, StageError
    from hrcneuro.pipeline.workdir import Workdir
    from hrcneuro.report import write_report

    workdir = Workdir(options.workdir)
    with guarded(workdir.results):
        try:
            written = write_report(settings, items, workdir.results / "report.html")
        except (HrcError, OSError):
            raise
        except Exception as error:
            # The stages' results stand, and must still be told.
            problem = f"the report could not be made: {type(error).__name__}: {error}"
            raise StageError(problem, cure="hrcneuro report --debug shows where; please report it as a bug") from error
    bring.console(options).say(f"report: {written}")
    return written
