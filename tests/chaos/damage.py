"""Entries, records and pointers that are cut, changed or replaced: ``python tests/chaos/damage.py [TRIALS] [SEED]``.

The next run with --verify must end complete, with the bytes of an undisturbed one; without it, what it reads is judged
by size and time, and nothing else may come out than what it says.
"""

import os
import random
import shutil
import sys

from study import RUN, complete, fresh, reference  # first: it makes the helpers importable

from quick import Quick  # isort: skip
from table import Fault, Lost, tell


def _cut(path, draw):
    os.truncate(path, draw.randrange(max(1, path.stat().st_size)))


def _flip(path, draw):
    content = bytearray(path.read_bytes())
    content[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
    about = path.stat()
    path.write_bytes(content)
    os.utime(path, ns=(about.st_atime_ns, about.st_mtime_ns))


def _zeros(path, draw):
    path.write_bytes(bytes(path.stat().st_size))


def _empty(path, draw):
    path.write_bytes(b"")


def _longer(path, draw):
    path.write_bytes(path.read_bytes() + b"x")


def _gone(path, draw):
    path.unlink()


def _folder(path, draw):
    path.unlink()
    path.mkdir()


def _link(path, draw):
    copy = path.parents[4] / "aside"
    shutil.copy(path, copy)
    path.unlink()
    path.symlink_to(copy)


def _pipe(path, draw):
    path.unlink()
    os.mkfifo(path)


def _swap(path, draw):
    """Put another file of the cache there."""
    others = [p for p in path.parents[3].glob("*/*/*/*") if p.is_file() and p != path]
    path.write_bytes(draw.choice(others).read_bytes())


DAMAGE = (_cut, _flip, _zeros, _empty, _longer, _gone, _folder, _link, _pipe, _swap)


def main(trials=60, seed=0):
    """Return 0 where nothing was lost."""
    base, draw = fresh("damage"), random.Random(seed)
    wanted = reference(base)
    faults = {
        "artifact": Fault("artifact cut, changed or replaced"),
        "record": Fault("record cut, changed or replaced"),
        "pointer": Fault("pointer cut, changed or replaced"),
    }
    for number in range(trials):
        kind, damage = list(faults)[number % 3], DAMAGE[number // 3 % len(DAMAGE)]
        study = base / "study"
        shutil.copytree(base / "calm", study)
        path = draw.choice(_files(study)[kind])
        with faults[kind].trial(f"{damage.__name__[1:]} {path.relative_to(study)}"):
            damage(path, draw)
            _mended(base, study, wanted, path if kind == "pointer" and damage is _folder else None)
        shutil.rmtree(study)
    shutil.rmtree(base)
    return tell(faults.values())


def _mended(base, study, wanted, folder):
    """Run the study; a folder in a file's place, in which there may be anything, is for a person to take away."""
    run = Quick(base, *RUN, "--workdir", study, "--executor", "serial", "--verify")
    code = run.wait(120)
    said = run.said()
    if code == 2 and folder and f"{folder} cannot be written: it is a folder" in said:
        folder.rmdir()
        run = Quick(base, *RUN, "--workdir", study, "--executor", "serial", "--verify")
        code = run.wait(120)
    if code != 0:
        run.kill(group=True)
        raise Lost(f"exit code {code}: {said[-700:]}")
    complete(study, wanted)


def _files(study):
    entries = [p for p in study.glob("cache/[!.]*/*/*/*") if p.is_file()]
    return {
        "artifact": sorted(p for p in entries if p.name != "record.json"),
        "record": sorted(p for p in entries if p.name == "record.json"),
        "pointer": sorted(study.glob("results/*/*.json")),
    }


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
