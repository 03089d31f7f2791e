"""The product from outside: the command line in a folder of its own, and the smoke study, run once for all tests."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from filelock import FileLock
from hypothesis import settings
from started import Starter, read_once

ROOT = Path(__file__).parents[1]
COMMAND = [sys.executable, "-m", "hrcneuro"]

# The same examples each time, and no verdict on how long one took: other work may hold it up.
settings.load_profile("ci")

# A shell starts what runs in its background with interrupts ignored, and every child inherits that; so a test that
# interrupts a command would wait for its end in vain. A handler, unlike that, is not inherited.
for _number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
    if signal.getsignal(_number) is signal.SIG_IGN:
        signal.signal(_number, signal.default_int_handler)


@dataclass
class Done:
    """What a finished command left: exit code and texts."""

    code: int
    out: str
    err: str

    @property
    def json(self):
        return json.loads(self.out)

    @property
    def states(self):
        return {f"{i['stage']} {i['unit']}": i["state"] for i in self.json["items"]}


def call(*arguments, cwd=ROOT, env=None, timeout=300):
    """Run ``hrcneuro`` and return what it did."""
    environment = {**os.environ, "NO_COLOR": "1", **(env or {})}
    environment.pop("HRCNEURO_CACHE", None) if not env else None
    done = subprocess.run(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    return Done(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="session")
def common(tmp_path_factory, worker_id):
    """The folder that all test workers of this session have in common."""
    base = tmp_path_factory.getbasetemp()
    return base if worker_id == "master" else base.parent


@pytest.fixture(scope="session")
def hrcneuro(common):
    """The command line as a function; with an environment that Python reads as it starts, from scratch."""
    starter = Starter(ROOT, memory=common / "source.json")

    def run(*arguments, cwd=ROOT, env=None, timeout=300):
        if read_once(env or {}):
            return call(*arguments, cwd=cwd, env=env, timeout=timeout)
        return Done(*starter.run(arguments, cwd=cwd, timeout=timeout, environment=env))

    yield run
    starter.end()


@pytest.fixture(scope="session")
def smoke(common):
    """The working folder of a finished smoke study, shared by all test workers; do not change it.

    ``SMOKE`` may name it, for who goes on with it after the tests: a folder that is not there yet.
    """
    folder = Path(os.environ.get("SMOKE") or common / "smoke").absolute()
    folder.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(f"{folder}.lock"):
        if not (folder / "done").exists():
            done = call("run", "pipelines/smoke.toml", "--workdir", folder, "-j", "2", "--json", timeout=500)
            assert done.code == 0, done.err
            (folder / "done").write_text(done.out)
    return folder
