"""One pipeline through every engine, beside one process: ``python tests/chaos/engines.py [PIPELINE] [ENGINE…]``.

A dask scheduler with two workers, SLURM and Snakemake. Each must make the artifacts of one process, under the same keys
and byte for byte, and a second run of ours must find all of them.
"""

import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

from study import COMMAND, around, states  # first: it makes the helpers importable

from dask_lab import dask_lab  # isort: skip
from slurm_lab import slurm, why_not
from table import Fault, tell
from tiny_study import ROOT, artifacts

_RUN_S = 1800


def main(pipeline="pipelines/smoke.toml", *names):
    """Return 0 where every engine that is here makes the bytes of one process."""
    base = Path(tempfile.mkdtemp(prefix="hrcneuro-engines-"))
    here = _run(pipeline, base / "here", "--executor", "serial")
    assert here.returncode == 0, here.stderr
    wanted = artifacts(base / "here")
    faults = []
    for name in names or ENGINES:
        fault = Fault(f"another engine: {name}")
        faults.append(fault)
        if reason := _why_not(name):
            fault.skip(reason)
            continue
        begin = time.monotonic()
        with fault.trial():
            ENGINES[name](pipeline, base)
            made = artifacts(base / name)
            other = sorted(one for one in {*made, *wanted} if made.get(one) != wanted.get(one))
            assert wanted, "nothing was made"
            assert not other, f"{len(other)} artifacts differ: {other[:3]}"
            again = _run(pipeline, base / name, "--executor", "serial")
            assert again.returncode == 0, again.stderr
            assert set(states(again).values()) == {"hit"}, "a second run does something"
            fault.note = f"{len(made)} artifacts, byte for byte, in {time.monotonic() - begin:.0f} s"
    shutil.rmtree(base)
    return tell(faults)


def _dask(pipeline, base):
    (base / "lab").mkdir()
    with dask_lab(base / "lab") as lab:
        done = _run(pipeline, base / "dask", "--executor", "dask", "--set", f"cluster.scheduler={lab.address}")
    assert done.returncode == 0, done.stderr


def _slurm(pipeline, base):
    with slurm(base / "control", cores=4) as environment:
        done = _run(pipeline, base / "slurm", "--executor", "slurm", environment=environment)
    assert done.returncode == 0, done.stderr


def _snakemake(pipeline, base):
    path = ROOT / pipeline
    asked = tomllib.loads(path.read_text())
    study = (path.parent / asked["config"]).resolve()
    stages = [f"study.stages={json.dumps(asked['stages'])}"] if "stages" in asked else []
    command = [
        *(sys.executable, "-m", "snakemake", "--snakefile", ROOT / "pipelines" / "Snakefile", "--cores", "2"),
        *("--directory", base, "--config", f"study={study}", f"workdir={base / 'snakemake'}"),
        f"set={json.dumps(stages)}",
    ]
    done = subprocess.run(
        [*map(str, command)], cwd=base, env=around(), capture_output=True, text=True, timeout=_RUN_S, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


ENGINES = {"dask": _dask, "slurm": _slurm, "snakemake": _snakemake}
_MODULES = {"dask": "distributed", "slurm": "submitit", "snakemake": "snakemake"}


def _why_not(name):
    """Return why an engine cannot be tried here; empty where it can."""
    if name == "slurm" and (reason := why_not()):
        return reason
    return "" if importlib.util.find_spec(_MODULES[name]) else f"{_MODULES[name]} is not installed"


def _run(pipeline, folder, *words, environment=None):
    command = [*COMMAND, "run", ROOT / pipeline, "--workdir", folder, "--json", *words]
    return subprocess.run(
        [*map(str, command)], cwd=folder.parent, env=around(environment), capture_output=True, text=True,
        timeout=_RUN_S, check=False,
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
