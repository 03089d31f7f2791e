"""What acquire can do beside running: show its source, measure the rules, export."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from hrcneuro import graph, stages
from hrcneuro.commands import bring, console, logged, settings
from hrcneuro.errors import ConfigError, HrcError
from hrcneuro.options import Options


def one_of(**chosen: bool) -> None:
    """Refuse options that ask for different things.

    Raises:
        ConfigError: Names them.
    """
    names = [f"--{name}" for name, given in chosen.items() if given]
    if len(names) > 1:
        raise ConfigError(f"{' and '.join(names)} do not go together", cure="choose one of them")


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


def rules(options: Options, subjects: Sequence[str] | None) -> int:
    """Print the rules of the experiment, measured over the subjects' moves; run and write nothing."""
    from hrcneuro.sources import behaviour

    found = settings(options)
    units = [task.unit for task in graph.targets(found, ["acquire"], subjects or ())]
    table = behaviour.study_rules(found.sections["acquire"], units)
    if options.json:
        print(json.dumps({"command": "acquire", "ok": True, "rules": behaviour.listed(table)}, indent=1))
    else:
        print(behaviour.render(table, len(units)))
    return 0


def export(options: Options, subjects: Sequence[str] | None, folder: Path) -> int:
    """Bring acquire up to date and write what it made in the authors' layout, one folder a subject.

    Raises:
        ConfigError: The folder must not be written to.
    """
    from hrcneuro.cache.fingerprint import digest
    from hrcneuro.contract import params
    from hrcneuro.sources import export as layout

    found = settings(options)
    wanted = graph.targets(found, ["acquire"], subjects or ())
    study = digest([found.study.name, params(found.sections["acquire"])])[:16]
    layout.prepare(folder, [task.unit for task in wanted], study=study)
    with logged("acquire", options, found) as log:
        items = bring(options, found, wanted, log)
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
        code = talk.finish("acquire", items, also=flaw)
        log.end(items, code)
    return code
