"""The product as people install it: from a wheel, without the repository, in each of the usual ways; needs a registry.

    python tests/product/installs.py                             # pip, pipx, uv and the lowest versions, as a table
    python tests/product/installs.py --way lowest                # the oldest libraries that pyproject.toml allows
    python tests/product/installs.py --way pip --python python3.13 --extras xdf,export,bids,decoders,lsl,experiment

Each way gets an empty folder, runs the smoke study there, and again (nothing may be computed), and where the extras are
installed exports it in both ways. Exit code 1 where something of that fails. No part of the test suite, which has no
network.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from tiny_study import ROOT
from wheel import copy_source

EXTRAS = "xdf,export,bids,decoders,lsl,experiment,ur"


class NotInstalled(Exception):
    """A tool ended with an error; what it said last."""


def quietly(command: list[str | Path], **options: object) -> str:
    """Run a tool and return what it printed; what it says besides is told only where it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if done.returncode:
        raise NotInstalled(f"{Path(command[0]).name}: {' '.join(done.stderr.split()[-60:])}")
    return done.stdout


@dataclass
class Place:
    """Where one way installs: a folder, the wheel, the Python that users have, and the extras they ask for."""

    folder: Path
    wheel: Path
    python: str
    extras: str = EXTRAS

    def tool(self, name: str) -> Path:
        """Return an installed tool from the registry that is none of the product's."""
        home = self.folder / name
        quietly([self.python, "-m", "venv", home])
        quietly([home / "bin" / "pip", "install", "--quiet", name])
        return home / "bin" / name


def by_pip(place: Place) -> list[str]:
    """Into an environment of its own, the newest of everything, with the extras."""
    home = place.folder / "environment"
    quietly([place.python, "-m", "venv", home])
    quietly([home / "bin" / "pip", "install", "--quiet", f"{place.wheel}[{place.extras}]"])
    return [str(home / "bin" / "hrcneuro")]


def by_pipx(place: Place) -> list[str]:
    """As a program of its own, without extras."""
    home, programs = place.folder / "home", place.folder / "programs"
    env = {**os.environ, "PIPX_HOME": str(home), "PIPX_BIN_DIR": str(programs), "PIPX_MAN_DIR": str(home / "man")}
    quietly([place.tool("pipx"), "install", "--python", place.python, place.wheel], env=env)
    return [str(programs / "hrcneuro")]


def by_uv(place: Place) -> list[str]:
    """Without an installation: uv makes an environment for the call, and keeps it."""
    return [str(place.tool("uv")), "tool", "run", "--python", place.python, "--from", str(place.wheel), "hrcneuro"]


def lowest(place: Place) -> list[str]:
    """Into an environment of its own, each library of pyproject.toml in the oldest version that it allows."""
    home, uv = place.folder / "environment", place.tool("uv")
    quietly([place.python, "-m", "venv", home])
    install = [uv, "pip", "install", "--quiet", "--python", home / "bin" / "python"]
    extras = [word for name in place.extras.split(",") for word in ("--extra", name)]
    # From the file itself: what a wheel asks for is nothing direct, and would come in its newest version.
    quietly([*install, "--resolution", "lowest-direct", "-r", ROOT / "pyproject.toml", *extras])
    quietly([*install, "--no-deps", place.wheel])
    return [str(home / "bin" / "hrcneuro")]


WAYS: dict[str, Callable[[Place], list[str]]] = {"pip": by_pip, "pipx": by_pipx, "uv": by_uv, "lowest": lowest}
WITH_EXTRAS = ("pip", "lowest")


def wheel(folder: Path, python: str) -> Path:
    """Return the wheel of the working tree, as it is."""
    source = copy_source(folder / "source")
    quietly([python, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", folder, source])
    (path,) = folder.glob("hrcneuro-*.whl")
    return path


def try_out(command: list[str], work: Path, *, extras: bool) -> list[str]:
    """Return what is wrong with an installed program; empty where all is well."""
    work.mkdir()
    env = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    workers = ["-j", str(os.cpu_count() or 1)]
    calls = [["--version"], ["doctor"], ["run", "smoke", *workers], ["run", "smoke", *workers, "--json"],
             ["show", "decode", "group", "--config", "smoke"], ["robot", "s01", "--config", "smoke"]]  # fmt: skip
    if extras:
        calls += [
            ["export", "--bids", "bids", "--config", "smoke"],
            ["acquire", "s01", "--config", "smoke", "--export", "out"],
        ]
    wrong = []
    for call in calls:
        done = subprocess.run([*command, *call], cwd=work, env=env, capture_output=True, text=True, check=False)
        if done.returncode:
            wrong.append(f"{' '.join(call)}: exit code {done.returncode}\n{done.stderr.strip()}")
        elif "--json" in call:
            states = {item["state"] for item in json.loads(done.stdout)["items"]}
            wrong += [f"{' '.join(call)}: {sorted(states)} the second time"] if states != {"hit"} else []
    if not list(work.glob("results/reports/*/report.html")):
        wrong.append("no report")
    return wrong


def main() -> int:
    """Try each way; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--way", action="append", choices=WAYS, help="all where none is given")
    parser.add_argument("--python", default=sys.executable, help="the Python that users have")
    parser.add_argument("--extras", default=EXTRAS, help="of the ways pip and lowest; ur has no package for 3.13 yet")
    given = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        package = wheel(folder, given.python)
        version = quietly([given.python, "--version"]).strip()
        print(f"{package.name}, {version}\n\n| way | seconds | what went wrong |\n|---|---|---|", flush=True)
        for way in given.way or WAYS:
            begin, place = time.monotonic(), Place(folder / way, package, given.python, given.extras)
            place.folder.mkdir()
            try:
                wrong = try_out(WAYS[way](place), place.folder / "work", extras=way in WITH_EXTRAS)
            except NotInstalled as error:
                wrong = [f"not installed: {error}"]
            failed += bool(wrong)
            print(f"| {way} | {time.monotonic() - begin:.0f} | {'; '.join(wrong) or 'nothing'} |", flush=True)
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
