"""A study so small that it can be run, killed and run again; a copy of the package that may be edited."""

import contextlib
import hashlib
import json
import os
import shutil
import signal
import time
from pathlib import Path

from started import libraries

ROOT = Path(__file__).parents[2]
TINY = """
[study]
name = "tiny"
subjects = ["s01", "s02"]
exclude = []

[acquire]
sfreq = 128.0

[acquire.session]
practice_episodes = 1
blocks = 2
episodes_per_block = 1

[acquire.timing]
break_s = 1.0
pause_s = 1.0

[preprocess]
sfreq = 128.0
h_freq = 40.0

[simulate]
repetitions = 2
learner_repetitions = 0
episodes = 20
"""
PIPELINE = """
config = "tiny.toml"
stages = ["acquire", "preprocess", "epoch", "simulate"]
report = false
"""


def write_tiny(folder):
    (folder / "tiny.toml").write_text(TINY)
    (folder / "pipeline.toml").write_text(PIPELINE)
    return folder


class Copy:
    """A copy of the package that a test may edit, and a folder to work in."""

    def __init__(self, folder):
        self.folder = folder
        self.package = folder / "copy" / "hrcneuro"
        self.work = folder / "work"
        self.work.mkdir()
        write_tiny(self.work)
        shutil.copytree(ROOT / "hrcneuro", self.package, ignore=shutil.ignore_patterns("__pycache__"))

    def python(self, *arguments, check=True, **environment):
        """Return what ``python -m hrcneuro …`` or ``python -c …`` prints where ``hrcneuro`` is the copy."""
        flag, what, *rest = arguments
        place = self.package.parent
        ended, out, err = libraries().run(
            rest,
            code=what if flag == "-c" else None,
            cwd=self.work,
            timeout=300,
            environment={"PYTHONPATH": str(place), **environment},
            paths=[place],
        )
        assert not check or ended == 0, err
        return out

    def items(self, *arguments, workdir="study", **environment):
        """Return ``{"stage unit": item}`` of a command with ``--json``."""
        out = self.python("-m", "hrcneuro", *arguments, "--workdir", workdir, "--json", **environment)
        return {f"{item['stage']} {item['unit']}": item for item in json.loads(out)["items"]}

    def edit(self, module, old, new):
        """Replace a piece of a module's source."""
        path = self.package / module
        text = path.read_text()
        assert text.count(old) >= 1, f"{module} has no {old!r}"
        path.write_text(text.replace(old, new, 1))


def wait_for(condition, *, seconds=60.0):
    """Return what ``condition()`` gives as soon as it is true."""
    deadline = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < deadline, "it did not come to pass"
        time.sleep(0.005)
    return found


def alive(group):
    """Return whether any process of a group lives."""
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == group and fields[0] != "Z":
            return True
    return False


def kill_group(process, number=signal.SIGKILL):
    """Signal a whole process group that may be gone."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, number)


def half_written(workdir):
    """Return the temporary folders of a cache."""
    return sorted(p for p in workdir.rglob(".tmp-*"))


def artifacts(workdir):
    """Return ``{entry/file: sha256}`` of all entries, hashed here and checked against the records."""
    found = {}
    for record in sorted(workdir.glob("cache/*/*/*/record.json")):
        for name, about in json.loads(record.read_text())["outputs"].items():
            path = record.parent / name
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            assert digest == about["sha256"]
            found[path.relative_to(workdir / "cache").as_posix()] = digest
    return found


def numbers(workdir):
    """Return what :func:`artifacts` does, without the pictures."""
    return {name: digest for name, digest in artifacts(workdir).items() if ".figures/" not in name}
