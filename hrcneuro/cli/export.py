"""The command export: recordings, trials and results in the form of other tools."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options

if TYPE_CHECKING:
    from hrcneuro.config.settings import Settings
    from hrcneuro.pipeline.graph import Task
    from hrcneuro.pipeline.walk import Item

Subjects = Annotated[
    list[str] | None, typer.Argument(help="Subjects; none means everyone.", autocompletion=completion.subjects)
]


@command(
    "Write recordings, trials and results in the form of other tools.",
    "export --bids bids",
    "export --bids bids s01 --raw",
    name="export",
)
def export(
    options: Options,
    subjects: Subjects = None,
    bids: Annotated[Path | None, typer.Option(help="A folder to write a BIDS data set into.")] = None,
    raw: Annotated[bool, typer.Option("--raw", help="Only the recordings, no derivatives.")] = False,
) -> int:
    """Bring subjects up to date and write them as a BIDS data set."""
    from hrcneuro.cli import bring
    from hrcneuro.errors import ConfigError, HrcError
    from hrcneuro.export import bids as edge

    if bids is None:
        raise ConfigError("export has to know the form and the place", cure="name a folder: hrcneuro export --bids DIR")
    settings = bring.settings(options)
    edge.prepare(bids, subjects or settings.study.subjects)
    wanted = _wanted(settings, subjects, raw=raw)
    with bring.logged("export", options, settings) as log:
        items = bring.bring(options, settings, wanted, log)
        flaw, count = None, 0
        if not options.dry_run:
            try:
                count = _write(options, settings, items, bids)
            except HrcError as error:
                flaw = error
            log.write("export", files=count)
        code = bring.console(options).finish("export", items, also=flaw)
        log.end(items, code)
    return code


def _wanted(settings: Settings, subjects: Sequence[str] | None, *, raw: bool) -> list[Task]:
    from hrcneuro.pipeline import graph

    stages = ("acquire",) if raw else ("acquire", "preprocess", "epoch", "erp")
    tasks = [task for name in stages for task in graph.targets(settings, [name], subjects or ())]
    return [task for task in tasks if task.unit != graph.GROUP]


def _write(options: Options, settings: Settings, items: Sequence[Item], folder: Path) -> int:
    """Write what is there of each subject whose recording is; return the number of files."""
    from hrcneuro.cache.disk import guarded
    from hrcneuro.cli import bring
    from hrcneuro.export import bids as edge
    from hrcneuro.sources.origin import Origins

    files: dict[str, dict[str, Path]] = {}
    for item in items:
        if item.state in ("hit", "ran"):
            files.setdefault(item.unit, {}).update({name: Path(path) for name, path in item.artifacts.items()})
    acquire = settings.sections["acquire"]
    summaries = {i.unit: i.summary["origin"] for i in items if i.stage == "acquire" and i.unit in files}
    origins = {name: Origins.of(one) for name, one in summaries.items()}
    simulated = acquire.source in ("synthetic", "semisynthetic")
    count = 0
    with guarded(folder):
        edge.write_dataset(folder, list(origins.values()), study=settings.study.name, paradigm=acquire.moves)
        for name, have in files.items():
            subject = edge.Subject(
                name,
                origins[name],
                have[f"{name}_raw.fif"],
                have["trials.parquet"],
                have.get(f"{name}_clean_raw.fif"),
                have.get(f"{name}_epo.fif"),
                have.get(f"{name}_ave.fif"),
            )
            task = edge.label(settings.study.name) or "task"
            line_hz = acquire.eeg.line_hz if simulated and acquire.eeg.line_uv else None
            reference = settings.sections["preprocess"].reference
            written = edge.write_subject(folder, subject, task=task, line_hz=line_hz, clean_reference=reference)
            bring.console(options).say(f"+ export {name}: {len(written)} files in {folder}")
            count += len(written)
    return count
