"""The commands of the cache: ls, verify, gc."""

from __future__ import annotations

import contextlib
import json
from typing import Annotated

import typer

from hrcneuro.cli.declare import command, group
from hrcneuro.cli.options import Options

_cache = group("cache", "Look into the cache, check it, clean it.")


@command("List the entries.", "cache ls", "cache ls --json", name="ls", group=_cache)
def ls(options: Options) -> int:
    """List the entries with their sizes, and which of them results point at."""
    from hrcneuro.cache.disk import size
    from hrcneuro.cache.record import entry_of
    from hrcneuro.pipeline.workdir import Workdir

    workdir = Workdir(options.workdir)
    used = workdir.keys()
    rows = []
    for folder in workdir.cache.entries():
        name = entry_of(folder)
        rows.append((*name, size(folder), name in used))
    if options.json:
        columns = ("stage", "unit", "key", "bytes", "used")
        entries = [dict(zip(columns, row, strict=True)) for row in rows]
        print(json.dumps({"command": "cache ls", "ok": True, "entries": entries}, indent=1))
        return 0
    for stage_name, unit, key, large, pointed in rows:
        print(f"{'*' if pointed else ' '} {stage_name:<11} {unit:<8} {key}  {large / 1e6:9.1f} MB")
    print(f"{len(rows)} entries, {sum(row[3] for row in rows) / 1e9:.2f} GB; * = results point at it")
    return 0


@command("Hash every file of every entry.", "cache verify", "cache verify --json", name="verify", group=_cache)
def verify(options: Options) -> int:
    """Hash all entries; quarantine and name the bad ones. Exit code 3 where there was one."""
    from hrcneuro.cache.record import entry_of
    from hrcneuro.errors import DataError, HrcError
    from hrcneuro.pipeline.workdir import Workdir

    workdir = Workdir(options.workdir)
    bad = {}
    entries = workdir.cache.entries()
    for folder in entries:
        name = entry_of(folder)
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


@command(
    "Drop the entries that no study points at.",
    "cache gc",
    "cache gc --dry-run",
    name="gc",
    group=_cache,
)
def gc(
    options: Options,
    unlisted: Annotated[
        bool, typer.Option("--unlisted", help="Also drop what no study in the cache's list has written.")
    ] = False,
    forget: Annotated[
        list[str] | None,
        typer.Option(metavar="FOLDER", help="Keep nothing more for a study that was there and is gone; repeatable."),
    ] = None,
) -> int:
    """Drop the entries that no study points at, leftovers of interrupted runs, and quarantined entries."""
    from hrcneuro.cache.disk import size
    from hrcneuro.cli import bring
    from hrcneuro.pipeline import cleaning
    from hrcneuro.pipeline.workdir import Workdir

    workdir = Workdir(options.workdir)
    if not options.dry_run:
        workdir.cache.sweep()
        cleaning.enter(workdir)
        cleaning.forget(workdir, forget or ())
    found = cleaning.survey(workdir)
    if not unlisted:
        cleaning.refuse_unlisted(workdir, found.unlisted)
    doomed = [*found.doomed, *found.unlisted]
    sizes = {folder: size(folder) for folder in doomed}
    if not options.dry_run:
        doomed = cleaning.drop(workdir, doomed)
    freed = sum(sizes[folder] for folder in doomed)
    if options.json:
        kept = [{"study": str(k.study), "entries": len(k.entries), "away": k.away} for k in found.kept]
        names = ["/".join(p.parts[-3:]) for p in doomed]
        print(json.dumps({"command": "cache gc", "ok": True, "dropped": names, "bytes": freed, "kept": kept}, indent=1))
    else:
        print(f"{'would drop' if options.dry_run else 'dropped'} {len(doomed)} entries, {freed / 1e9:.2f} GB")
        for one in found.kept:
            if not one.away:
                print(f"kept for the study in {one.study}: {len(one.entries)} entries")
    for one in found.kept:
        if one.away:
            bring.console(options).say(f"note: {cleaning.away_in_words(one)}", style="yellow")
    return 0
