"""The product as an installed program: from its wheel, without the repository, and without a network."""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from tiny_study import ROOT


def copy_source(folder: Path) -> Path:
    """Copy all that a wheel is built from, as it is, to a new folder; return the folder."""
    shutil.copytree(ROOT / "hrcneuro", folder / "hrcneuro", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copyfile(ROOT / name, folder / name)
    return folder


def installed(home: Path) -> Path:
    """Return the folder of the programs of an environment with the wheel alone, beside the libraries of this one."""
    source = copy_source(home / "source")
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    wheel = [*pip, "wheel", "--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", home, source]
    subprocess.run(wheel, check=True, capture_output=True)
    (package,) = home.glob("hrcneuro-*.whl")
    environment = home / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    site = next((environment / "lib").glob("python*/site-packages"))
    # Named in a .pth file, that folder's own .pth files do not count: the editable hrcneuro is out of sight.
    (site / "libraries.pth").write_text(sysconfig.get_path("purelib"))
    install = [*pip, "--python", environment / "bin" / "python", "install", "--no-deps", "--no-index"]
    # Also where it seems to be there: a clone that was installed has that in its folder.
    subprocess.run([*install, "--force-reinstall", package], check=True, capture_output=True)
    return environment / "bin"


def enter(command: str, folder: Path, programs: Path) -> tuple[int, str]:
    """Run a line in a shell, as it is typed; return the exit code and all that it printed."""
    env = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "HRCNEURO_CACHE")}
    env |= {"PATH": f"{programs}:{env['PATH']}", "NO_COLOR": "1", "SHELL": "/bin/bash", "MPLBACKEND": "agg"}
    done = subprocess.run(
        ["bash", "-c", command], cwd=folder, env=env, text=True, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=600, check=False,
    )  # fmt: skip
    return done.returncode, done.stdout
