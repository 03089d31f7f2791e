"""The commands of the cache that move entries between machines, and that save disk: push, pull, slim."""

from __future__ import annotations

import contextlib
import json
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.cache import cache
from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options

if TYPE_CHECKING:
    from hrcneuro.cache.transfer import Moved

_WORKERS = 8
_URL = Annotated[str, typer.Argument(help="s3://BUCKET/FOLDER, ssh://HOST/FOLDER, file:///FOLDER or a folder.")]
_STAGES = Annotated[
    list[str] | None, typer.Argument(help="Only of these stages; none: all.", autocompletion=completion.stages)
]


@command(
    "Copy this study's entries into a bucket.",
    "cache push bucket",
    "cache push bucket preprocess epoch --dry-run",
    name="push",
    group=cache,
)
def push(
    options: Options,
    url: _URL,
    stages: _STAGES = None,
    every: Annotated[bool, typer.Option("--all", help="Also what no result of this study points at.")] = False,
) -> int:
    """Copy the entries that results point at into a bucket; --force writes also what is there already."""
    from hrcneuro.cache import transfer
    from hrcneuro.cache.bucket import Bucket
    from hrcneuro.cache.record import entry_of
    from hrcneuro.pipeline.workdir import Workdir

    workdir = Workdir(options.workdir)
    bucket = Bucket(url, cache=workdir.cache.root)
    there = {entry_of(folder) for folder in workdir.cache.entries()}
    wanted = sorted(_of(there if every else there & workdir.keys(), stages))
    if options.dry_run:
        known = set() if options.force else set(bucket.records()[0])
        return _plan("cache push", options, [entry for entry in wanted if entry not in known])
    moved = transfer.push(workdir.cache, bucket, wanted, force=options.force, workers=options.jobs or _WORKERS)
    return _report("cache push", "pushed", options, moved, ())


@command(
    "Copy the entries of a bucket into the cache.",
    "cache pull bucket",
    "cache pull bucket decode",
    name="pull",
    group=cache,
)
def pull(options: Options, url: _URL, stages: _STAGES = None) -> int:
    """Copy entries from a bucket, each hashed and looked at before it counts; exit code 3 where one is refused.

    What 'cache slim' has dropped here stays dropped; --force brings it back.
    """
    from hrcneuro.cache import transfer
    from hrcneuro.cache.bucket import Bucket
    from hrcneuro.errors import DataError, HrcError
    from hrcneuro.pipeline.graph import FORMATS
    from hrcneuro.pipeline.workdir import Workdir

    workdir = Workdir(options.workdir)
    bucket = Bucket(url, cache=workdir.cache.root)
    there, odd = bucket.records()
    if not (there or odd):
        raise DataError(f"{bucket} has no entry", cure="check the address; hrcneuro cache push URL puts entries there")
    wanted = sorted(_of(there, stages))
    if options.dry_run:
        lookup = workdir.cache.lookup
        missing = [entry for entry in wanted if lookup(*entry, slim=not options.force) is None]
        return _plan("cache pull", options, missing)
    workdir.cache.sweep()
    # What is pulled now is then known to have come after the list: gc may drop it once nobody wants it.
    with contextlib.suppress(OSError, HrcError):
        workdir.studies.begin()
    moved = transfer.pull(
        workdir.cache,
        bucket,
        wanted,
        formats=FORMATS,
        verify=options.verify,
        force=options.force,
        workers=options.jobs or _WORKERS,
    )
    return _report("cache pull", "pulled", options, moved, odd)


@command(
    "Drop signals that can be made again; tables, pictures and records stay.",
    "cache slim epoch",
    "cache slim acquire preprocess epoch --dry-run",
    name="slim",
    group=cache,
)
def slim(
    options: Options,
    stages: Annotated[list[str], typer.Argument(help="Of these stages.", autocompletion=completion.stages)],
) -> int:
    """Drop the FIF files of entries that are up to date; what reads them later makes them again."""
    from hrcneuro.cli import bring
    from hrcneuro.pipeline import graph, slimming
    from hrcneuro.pipeline.workdir import Workdir

    settings = bring.settings(options)
    for name in stages:
        graph.check_stage(name)
    slimming.check(settings, stages)
    done = slimming.slim(Workdir(options.workdir), bring.planned(options, settings), stages, dry=options.dry_run)
    gone, kept = [one for one in done if not one.kept], [one for one in done if one.kept]
    if options.json:
        rows = [
            {"entry": "/".join(one.entry), "bytes": one.size, **({"kept": one.kept} if one.kept else {})}
            for one in done
        ]
        answer = {"command": "cache slim", "ok": True, "bytes": sum(one.size for one in gone), "entries": rows}
        print(json.dumps(answer, indent=1))
        return 0
    for name in dict.fromkeys(stages):
        of = [one for one in gone if one.entry[0] == name]
        print(f"{name:<11} {len(of):4} entries  {sum(one.size for one in of) / 1e6:10.1f} MB")
    verb = "would drop" if options.dry_run else "dropped"
    total = sum(one.size for one in gone)
    print(f"{verb} {total / 1e6:.1f} MB ({total} bytes)")
    for one in kept:
        print(f"kept: {'/'.join(one.entry)}: {one.kept}")
    return 0


def _of(entries: Iterable[tuple[str, str, str]], stages: Sequence[str] | None) -> list[tuple[str, str, str]]:
    """Return the entries of the named stages, with their pictures; all where none is named."""
    from hrcneuro.pipeline import graph

    for name in stages or ():
        graph.check_stage(name, joint=True)
    return [one for one in entries if not stages or one[0].partition(".")[0] in stages]


def _plan(name: str, options: Options, entries: Sequence[tuple[str, str, str]]) -> int:
    if options.json:
        print(json.dumps({"command": name, "ok": True, "entries": ["/".join(e) for e in entries]}, indent=1))
        return 0
    for entry in entries:
        print("/".join(entry))
    print(f"{name.removeprefix('cache ')}: {len(entries)} entries would be copied")
    return 0


def _report(name: str, verb: str, options: Options, moved: Iterable[Moved], odd: Sequence[str]) -> int:
    """Print what became of entries, and names in the bucket that can be of none; return the exit code."""
    from hrcneuro.cache.bucket import is_like_record
    from hrcneuro.cache.transfer import Fate
    from hrcneuro.cli import bring
    from hrcneuro.errors import DataError

    fates: Counter[Fate] = Counter()
    size, failed = 0, {}
    talk = bring.console(options)
    for one in moved:
        fates[one.fate] += 1
        size += one.size
        if one.error is not None:
            failed["/".join(one.entry)] = {"problem": one.error.problem, "cure": one.error.cure}
            if not options.json:
                talk.error(one.error, of="/".join(one.entry))
        elif options.verbose and one.fate is Fate.MOVED:
            talk.say(f"+ {'/'.join(one.entry)}  {one.size / 1e6:.1f} MB")
    # What somebody has laid beside the records, such as notes, is no reason to fail.
    like_records, strays = [one for one in odd if is_like_record(one)], [one for one in odd if not is_like_record(one)]
    for text in like_records:
        talk.say(f"refused: {text!r} looks like an entry's record and is none", style="yellow")
    for text in strays:
        talk.say(f"note: {text!r} is no name of an entry's record, and is left there")
    code = DataError.exit_code if like_records or fates[Fate.REFUSED] else 1 if fates[Fate.FAILED] else 0
    if options.json:
        answer = {"command": name, "ok": code == 0, verb: fates[Fate.MOVED], "there": fates[Fate.THERE], "bytes": size}
        answer |= {"slim": fates[Fate.SLIM], "refused": failed, "odd": list(odd)}
        print(json.dumps(answer, indent=1))
        return code
    words = {
        Fate.THERE: "there already",
        Fate.SLIM: "without the files that 'cache slim' has dropped here",
        Fate.REFUSED: "refused",
        Fate.FAILED: "failed",
    }
    rest = "".join(f", {fates[fate]} {word}" for fate, word in words.items() if fates[fate])
    print(f"{verb} {fates[Fate.MOVED]} entries, {size / 1e6:.1f} MB{rest}")
    if fates[Fate.SLIM] and verb == "pulled":
        print("what was dropped here stays so; --force brings it back")
    return code
