"""The command acquire: the stage, a look at its source, the experiment's rules, the export in the authors' layout."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from hrcneuro.cli.declare import Subjects, command
from hrcneuro.cli.options import Options


@command(
    "Read or simulate recordings: continuous EEG and the trial table.",
    "acquire s01 --inspect",
    "acquire s01 --export study --dry-run",
    name="acquire",
)
def acquire(
    options: Options,
    subjects: Subjects = None,
    inspect: Annotated[
        bool, typer.Option("--inspect", help="Show markers, channels and log side by side; write nothing.")
    ] = False,
    rules: Annotated[
        bool, typer.Option("--rules", help="Measure the experiment's rules over all moves; write nothing.")
    ] = False,
    export: Annotated[
        Path | None,
        typer.Option(
            "--export",
            metavar="DIR",
            help="Also write DIR/sNN as the authors' repository has it: EEGLAB's .set and .fdt, and both CSV files.",
        ),
    ] = None,
) -> int:
    """Run the stage, or look at its source."""
    from hrcneuro.cli import bring

    _one_of(inspect=inspect, rules=rules, export=export is not None)
    if inspect:
        return _inspect(options, subjects)
    if rules:
        return _rules(options, subjects)
    if export is not None:
        return _export(options, subjects, export)
    return bring.stage("acquire", options, subjects)


def _one_of(**chosen: bool) -> None:
    """Refuse options that ask for different things.

    Raises:
        ConfigError: Names them.
    """
    from hrcneuro.errors import ConfigError

    names = [f"--{name}" for name, given in chosen.items() if given]
    if len(names) > 1:
        raise ConfigError(f"{' and '.join(names)} do not go together", cure="choose one of them")


def _inspect(options: Options, subjects: Sequence[str] | None) -> int:
    """Show what acquire would read: markers, channels and log side by side; return the code that it would end with."""
    from hrcneuro.cli import bring
    from hrcneuro.pipeline import graph
    from hrcneuro.stages import acquire as stage

    settings = bring.settings(options)
    units = [task.unit for task in graph.targets(settings, ["acquire"], subjects or ())]
    views = {unit: stage.inspect(settings.section("acquire", unit), unit) for unit in units}
    codes = [view["problems"][0]["exit_code"] for view in views.values() if view["problems"]]
    if options.json:
        print(json.dumps({"command": "acquire", "ok": not codes, "inspect": views}, indent=1))
    else:
        for view in views.values():
            print(stage.render(view))
    return codes[0] if codes else 0


def _rules(options: Options, subjects: Sequence[str] | None) -> int:
    """Print the rules of the experiment, measured over the subjects' moves; run and write nothing."""
    from hrcneuro.cli import bring
    from hrcneuro.pipeline import graph
    from hrcneuro.sources import behaviour

    settings = bring.settings(options)
    units = [task.unit for task in graph.targets(settings, ["acquire"], subjects or ())]
    table = behaviour.study_rules({unit: settings.section("acquire", unit) for unit in units})
    if options.json:
        print(json.dumps({"command": "acquire", "ok": True, "rules": behaviour.listed(table)}, indent=1))
    else:
        print(behaviour.render(table, len(units)))
    return 0


def _export(options: Options, subjects: Sequence[str] | None, folder: Path) -> int:
    """Bring acquire up to date and write what it made in the authors' layout, one folder a subject.

    Raises:
        ConfigError: The folder must not be written to.
    """
    from hrcneuro.cache.fingerprint import digest
    from hrcneuro.cli import bring
    from hrcneuro.contract import params
    from hrcneuro.errors import HrcError
    from hrcneuro.export import authors as layout
    from hrcneuro.pipeline import graph
    from hrcneuro.sources.origin import Origins

    settings = bring.settings(options)
    wanted = graph.targets(settings, ["acquire"], subjects or ())
    study = digest([settings.study.name, params(settings.sections["acquire"])])[:16]
    layout.prepare(folder, [task.unit for task in wanted], study=study)
    with bring.logged("acquire", options, settings) as log:
        items = bring.bring(options, settings, wanted, log)
        talk, flaw = bring.console(options), None
        for item in items if not options.dry_run else ():
            if item.state not in ("hit", "ran"):
                continue
            files = {name: Path(path) for name, path in item.artifacts.items()}
            try:
                written = layout.export_subject(
                    files[f"{item.unit}_raw.fif"],
                    files["trials.parquet"],
                    folder,
                    item.unit,
                    key=item.key,
                    study=study,
                    origins=Origins.of(item.summary["origin"]),
                )
            except HrcError as error:
                flaw = flaw or error
                continue
            item.summary = {**item.summary, "export": written}
            talk.say(f"{'=' if written['state'] == 'hit' else '+'} export {item.unit}: {written['folder']}")
            for note in written["notes"]:
                talk.say(f"  note: {note}")
        code = talk.finish("acquire", items, also=flaw)
        log.end(items, code)
    return code
