"""Fixtures of the product tests."""

import subprocess
import sys

import pytest
from filelock import FileLock
from tiny_study import ROOT, write_tiny


@pytest.fixture
def tiny(tmp_path):
    """A folder with ``tiny.toml`` and ``pipeline.toml``."""
    return write_tiny(tmp_path)


@pytest.fixture(scope="session")
def finished(common, hrcneuro):
    """The folder of a tiny study that one process has run in ``one``, with pictures; all test workers share it.

    Do not change it: what is to go on from there begins with a copy.
    """
    base = common / "tiny"
    with FileLock(f"{base}.lock"):
        if not (base / "done").exists():
            base.mkdir(exist_ok=True)
            done = hrcneuro("run", write_tiny(base) / "pipeline.toml", "--workdir", base / "one", "-j", "1")
            assert done.code == 0, done.err
            (base / "done").touch()
    return base


@pytest.fixture(scope="session")
def start():
    """Start ``hrcneuro`` in a process group of its own; return the process."""

    def launch(*arguments, cwd=ROOT, **options):
        command = [sys.executable, "-m", "hrcneuro", *map(str, arguments)]
        given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **options}
        return subprocess.Popen(command, cwd=cwd, start_new_session=True, **given)

    return launch
