"""The commands of the cache: ls, verify, gc."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hrcneuro.cli.declare import command, group
from hrcneuro.cli.options import Options

if TYPE_CHECKING:
    from hrcneuro.pipeline.cleaning import Survey

cache = group("cache", "Look into the cache, check it, clean it.")


@command("List the entries.", "cache ls", "cache ls --json", name="ls", group=cache)
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


@command("Hash every file of every entry.", "cache verify", "cache verify --json", name="verify", group=cache)
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
    group=cache,
)
def gc(
    options: Options,
    unlisted: Annotated[
        bool, typer.Option("--unlisted", help="Also drop what no study in the cache's list has written.")
    ] = False,
    now: Annotated[
        bool, typer.Option("--now", help="Also drop what was in use within the last day, in a shared cache.")
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
    if now:
        found.doomed, found.recent = [*found.doomed, *found.recent], []
    doomed = [*found.doomed, *found.unlisted]
    sizes = {folder: size(folder) for folder in (*doomed, *found.recent)}
    if not options.dry_run:
        doomed = cleaning.drop(workdir, doomed)
    (_print_json if options.json else _print_text)(found, doomed, sizes, dry_run=options.dry_run)
    for one in found.kept:
        if one.away:
            bring.console(options).say(f"note: {cleaning.away_in_words(one)}", style="yellow")
    return 0


def _print_json(found: Survey, dropped: list[Path], sizes: dict[Path, int], *, dry_run: bool) -> None:
    answer = {
        "command": "cache gc",
        "ok": True,
        "dropped": _names(dropped),
        "bytes": sum(sizes[folder] for folder in dropped),
        "kept": [{"study": str(k.study), "entries": len(k.entries), "away": k.away} for k in found.kept],
        "recent": _names(found.recent),
    }
    print(json.dumps(answer, indent=1))


def _names(folders: list[Path]) -> list[str]:
    return ["/".join(folder.parts[-3:]) for folder in folders]


def _print_text(found: Survey, dropped: list[Path], sizes: dict[Path, int], *, dry_run: bool) -> None:
    gone, recent = (sum(sizes[folder] for folder in folders) / 1e9 for folders in (dropped, found.recent))
    print(f"{'would drop' if dry_run else 'dropped'} {len(dropped)} entries, {gone:.2f} GB")
    for one in found.kept:
        if not one.away:
            print(f"kept for the study in {one.study}: {len(one.entries)} entries")
    if found.recent:
        print(
            f"kept for a day: {len(found.recent)} entries, {recent:.2f} GB; a copy of a study that has not run yet may "
            "point at them. Drop them too: hrcneuro cache gc --now"
        )
