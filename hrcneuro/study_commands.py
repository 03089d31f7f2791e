"""What doctor, init and export do; cli_study.py declares them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from hrcneuro import commands, graph, pipeline
from hrcneuro.config import Settings
from hrcneuro.errors import ConfigError, HrcError
from hrcneuro.options import Options
from hrcneuro.workdir import Workdir


def doctor(options: Options) -> int:
    """Print what this machine offers, and what is wrong with it; return 0 where nothing is, else 1."""
    from hrcneuro import doctor as examination

    view = examination.examine(lambda: commands.settings(options), Workdir(options.workdir).cache.root)
    code = examination.exit_code(view)
    if options.json:
        print(json.dumps({"command": "doctor", "ok": code == 0, **view}, indent=1))
        return code
    print("\n".join(examination.lines(view)))
    for kind in ("notes", "problems"):
        for text in view[kind]:
            print(f"{kind.removesuffix('s')}: {text}")
    print("everything needed is there" if code == 0 else f"{len(view['problems'])} problems")
    return code


def init(options: Options, folder: Path) -> int:
    """Make a new study that runs as it is."""
    from hrcneuro import newstudy

    files = newstudy.create(folder, dry_run=options.dry_run)
    if options.json:
        names = [p.name for p in files]
        print(json.dumps({"command": "init", "ok": True, "folder": str(folder), "files": names}, indent=1))
        return 0
    talk = commands.console(options)
    verb = "would write" if options.dry_run else "wrote"
    talk.say(f"{verb} {', '.join(p.name for p in files)} in {folder}")
    talk.say(f"next: cd {folder} && hrcneuro run")
    return 0


def export(options: Options, subjects: Sequence[str] | None, *, bids: Path | None, raw: bool) -> int:
    """Bring subjects up to date and write them as a BIDS data set."""
    from hrcneuro.export import bids as edge

    if bids is None:
        raise ConfigError("export has to know the form and the place", cure="name a folder: hrcneuro export --bids DIR")
    found = commands.settings(options)
    edge.prepare(bids, subjects or found.study.subjects)
    wanted = _wanted(found, subjects, raw=raw)
    with commands.logged("export", options, found) as log:
        items = commands.bring(options, found, wanted, log)
        flaw, count = None, 0
        if not options.dry_run:
            try:
                count = _write(options, found, items, bids)
            except HrcError as error:
                flaw = error
            log.write("export", files=count)
        code = commands.console(options).finish("export", items, also=flaw)
        log.end(items, code)
    return code


def _wanted(found: Settings, subjects: Sequence[str] | None, *, raw: bool) -> list[graph.Task]:
    stages = ("acquire",) if raw else ("acquire", "preprocess", "epoch", "erp")
    tasks = [task for name in stages for task in graph.targets(found, [name], subjects or ())]
    return [task for task in tasks if task.unit != graph.GROUP]


def _write(options: Options, found: Settings, items: Sequence[pipeline.Item], folder: Path) -> int:
    """Write what is there of each subject whose recording is; return the number of files."""
    from hrcneuro.cache.store import guarded
    from hrcneuro.export import bids as edge

    files: dict[str, dict[str, Path]] = {}
    for item in items:
        if item.state in ("hit", "ran"):
            files.setdefault(item.unit, {}).update({name: Path(path) for name, path in item.artifacts.items()})
    acquire = found.sections["acquire"]
    simulated = acquire.source in ("synthetic", "semisynthetic")
    count = 0
    with guarded(folder):
        edge.write_dataset(folder, study=found.study.name, source=acquire.source)
        for name, have in files.items():
            subject = edge.Subject(
                name,
                have[f"{name}_raw.fif"],
                have["trials.parquet"],
                have.get(f"{name}_clean_raw.fif"),
                have.get(f"{name}_epo.fif"),
                have.get(f"{name}_ave.fif"),
            )
            task = edge.label(found.study.name) or "task"
            line_hz = acquire.eeg.line_hz if simulated and acquire.eeg.line_uv else None
            reference = found.sections["preprocess"].reference
            written = edge.write_subject(folder, subject, task=task, line_hz=line_hz, clean_reference=reference)
            commands.console(options).say(f"+ export {name}: {len(written)} files in {folder}")
            count += len(written)
    return count
