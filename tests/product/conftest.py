"""Fixtures of the product tests."""

import subprocess
import sys

import pytest
from tiny_study import ROOT, write_tiny


@pytest.fixture
def tiny(tmp_path):
    """A folder with ``tiny.toml`` and ``pipeline.toml``."""
    return write_tiny(tmp_path)


@pytest.fixture(scope="session")
def start():
    """Start ``hrcneuro`` in a process group of its own; return the process."""

    def launch(*arguments, cwd=ROOT, **options):
        command = [sys.executable, "-m", "hrcneuro", *map(str, arguments)]
        given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **options}
        return subprocess.Popen(command, cwd=cwd, start_new_session=True, **given)

    return launch
