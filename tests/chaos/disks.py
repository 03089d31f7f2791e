"""A disk that is full, read-only or somebody else's in mid-run: ``python tests/chaos/disks.py [TRIALS] [SEED]``.

Each trial spoils the disk under a run. The run must say so in its own words, lose nothing, and once the disk is mended
the next one must complete, with the bytes of a run that nobody disturbed.
"""

import contextlib
import os
import random
import shutil
import subprocess
import sys
import time

from study import RUN, check, complete, fresh, reference  # first: it makes the helpers importable

from quick import Quick, Unprivileged  # isort: skip
from table import Fault, Lost, tell

NOBODY = 65534
EXECUTORS = ("serial", "processes")
# What a study's files need; its largest file alone needs less than half of it.
_WHOLE_KB = 20_000
_SAID = {"full": "is full", "read-only": "cannot be written", "rights": "cannot be written"}


def main(trials=12, seed=0):
    """Return 0 where nothing was lost."""
    if os.geteuid():
        return tell([Fault("disk full, read-only, rights").skip("mounting needs root")])
    base, draw = fresh("disks"), random.Random(seed)
    base.chmod(0o755)
    wanted = reference(base)
    need_kb = sum((base / "calm" / "cache" / name).stat().st_size for name in wanted) // 1024
    faults = [
        _full(base, wanted, need_kb, draw, trials),
        _read_only(base, wanted, draw, trials),
        _rights(base, wanted, draw, trials),
    ]
    shutil.rmtree(base)
    return tell(faults)


def _full(base, wanted, need_kb, draw, trials):
    fault = Fault("disk full (tmpfs)")
    for number in range(trials):
        executor, size = EXECUTORS[number % 2], draw.randint(16, need_kb)
        with _mounted(base / "disk", f"size={size}k") as study, fault.trial(f"{size} kB, {executor}"):
            _spoiled(Quick(base, *_words(study, executor)), "full")
            before = check(study, wanted)
            subprocess.run(["mount", "-o", f"remount,size={4 * need_kb + 8000}k", str(study)], check=True)
            _mended(base, study, executor, wanted, before)
    return fault


def _read_only(base, wanted, draw, trials):
    fault = Fault("cache read-only in mid-run")
    for number in range(trials):
        executor = EXECUTORS[number % 2]
        with _mounted(base / "disk", "size=200m") as study, fault.trial(executor):
            run = Quick(base, *_words(study, executor))
            _into(run, study, draw)
            # Refused while a file is open for writing: then a moment later.
            while run.poll() is None and _remount(study, "ro"):
                time.sleep(0.002)
            if run.poll() is None:
                _spoiled(run, "read-only")
            before = check(study, wanted)
            _remount(study, "rw")
            _mended(base, study, executor, wanted, before)
    return fault


def _rights(base, wanted, draw, trials):
    fault = Fault("rights lost in mid-run (an unprivileged user)")
    if subprocess.run([*Unprivileged.PREFIX, "true"], capture_output=True, check=False).returncode:
        return fault.skip("setpriv cannot make an unprivileged process here")
    for number in range(trials):
        executor, study = EXECUTORS[number % 2], base / "theirs"
        study.mkdir()
        os.chown(study, NOBODY, NOBODY)
        with fault.trial(executor):
            home = {"HOME": str(study)}
            run = Unprivileged(base, *_words(study, executor), environment=home)
            _into(run, study, draw)
            _give(study, 0)
            if run.poll() is None:
                _spoiled(run, "rights")
            before = check(study, wanted)
            _give(study, NOBODY)
            _mended(base, study, executor, wanted, before, start=Unprivileged, environment=home)
        shutil.rmtree(study)
    return fault


def _words(study, executor):
    return [*RUN, "--workdir", study, "--executor", executor, "-j", "2"]


def _into(run, study, draw):
    """Wait for an instant of a run."""
    goal, deadline = draw.randint(0, 4), time.monotonic() + 120
    while len(list(study.glob("cache/[!.]*/*/[!.]*/record.json"))) < goal and run.poll() is None:
        if time.monotonic() > deadline:
            break
        time.sleep(0.002)
    run.wait(draw.uniform(0.0, 0.4))


def _spoiled(run, what):
    """A run whose disk was spoiled says so; one that says nothing is complete."""
    code = run.wait(300)
    said = run.said()
    if code is None:
        run.kill(group=True)
        raise Lost("the run does not end")
    if code not in (0, 1, 2) or "Traceback" in said or "report it as a bug" in said:
        raise Lost(f"exit code {code}: {said[-700:]}")
    if code and _SAID[what] not in said:
        raise Lost(f"exit code {code}, and the disk is not named: {said[-700:]}")


def _mended(base, study, executor, wanted, before, *, start=Quick, **how):
    run = start(base, *_words(study, executor), **how)
    if run.wait(300) != 0:
        run.kill(group=True)
        raise Lost(f"the next run ends with {run.code}: {run.said()[-700:]}")
    check(study, wanted, before)
    complete(study, wanted)


@contextlib.contextmanager
def _mounted(folder, options):
    folder.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)], check=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def _remount(folder, how):
    return subprocess.run(["mount", "-o", f"remount,{how}", str(folder)], capture_output=True, check=False).returncode


def _give(study, user):
    """Let everything in a study belong to somebody."""
    for place, _, names in os.walk(study):
        for path in (place, *(os.path.join(place, name) for name in names)):
            with contextlib.suppress(FileNotFoundError):
                os.chown(path, user, user, follow_symlinks=False)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
