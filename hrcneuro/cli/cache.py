"""The commands of the cache: ls, verify, gc."""

from __future__ import annotations

import contextlib
import json
import shutil

from hrcneuro.cli.declare import command, group
from hrcneuro.cli.options import Options

_cache = group("cache", "Look into the cache, check it, clean it.")


@command("List the entries.", "cache ls", "cache ls --json", name="ls", group=_cache)
def ls(options: Options) -> int:
    """List the entries with their sizes, and which of them results point at."""
    from hrcneuro.pipeline.workdir import Workdir

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


@command("Hash every file of every entry.", "cache verify", "cache verify --json", name="verify", group=_cache)
def verify(options: Options) -> int:
    """Hash all entries; quarantine and name the bad ones. Exit code 3 where there was one."""
    from hrcneuro.errors import DataError, HrcError
    from hrcneuro.pipeline.workdir import Workdir

    workdir = Workdir(options.workdir)
    bad = {}
    entries = workdir.cache.entries()
    for folder in entries:
        name = (folder.parts[-3], folder.parts[-2], folder.name)
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


@command("Drop the entries that no result points at.", "cache gc", "cache gc --dry-run", name="gc", group=_cache)
def gc(options: Options) -> int:
    """Drop the entries that no result points at, leftovers of interrupted runs, and quarantined entries."""
    from hrcneuro.pipeline.workdir import Workdir

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
