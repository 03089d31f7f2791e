"""pipelines/Snakefile: Snakemake names the tasks that we would, and its jobs make the bytes that ours make."""

import importlib.util
import json
import os
import re
import subprocess
import sys

import pytest
from tiny_study import ROOT, artifacts

pytestmark = pytest.mark.skipif(not importlib.util.find_spec("snakemake"), reason="snakemake is not installed")
STAGES = ("acquire", "preprocess", "epoch", "simulate")
STUDY = f"study.stages={json.dumps(STAGES)}"


@pytest.fixture
def snakemake(tiny):
    """Run Snakemake on the tiny study with these assignments of the configuration."""

    def run(*options, assignments=()):
        command = [
            *(sys.executable, "-m", "snakemake", "--snakefile", ROOT / "pipelines" / "Snakefile", "--cores", "2"),
            *("--config", "study=tiny.toml", "workdir=there", f"set={json.dumps([STUDY, *assignments])}"),
            *(*options, "--", "numbers"),
        ]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
        done = subprocess.run(
            [*map(str, command)], cwd=tiny, env=environment, capture_output=True, text=True, check=False, timeout=300
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    return run


def named(output):
    """Return the tasks that a dry run of Snakemake names."""
    jobs = re.findall(r"^rule (\w+):\n(?:    .*\n)*?    output: there/results/(\w+)/", output, re.M)
    return {f"{stage} {unit}" for stage, unit in jobs if stage in STAGES}


def ours(hrcneuro, tiny, *assignments):
    """Return the tasks that our dry run names."""
    given = [part for one in (STUDY, *assignments) for part in ("--set", one)]
    done = hrcneuro(
        *("run", "--config", "tiny.toml", *given, "--workdir", "there", "--dry-run", "--json", "--no-figures"), cwd=tiny
    )
    return {name for name, state in done.states.items() if state == "would-run"}


def test_a_dry_run_names_the_same_tasks_as_ours(hrcneuro, snakemake, tiny):
    everything = named(snakemake("--dry-run"))
    assert everything == ours(hrcneuro, tiny)
    assert len(everything) == 7
    whole = ("run", "--config", "tiny.toml", "--set", STUDY, "--workdir", "there", "--no-figures", "-j", "1")
    assert hrcneuro(*whole, cwd=tiny).code == 0
    assert named(snakemake("--dry-run")) == set()
    changed = ("preprocess.h_freq=30",)
    again = named(snakemake("--dry-run", assignments=changed))
    assert again == ours(hrcneuro, tiny, *changed)
    assert again == {f"{stage} {unit}" for stage in ("preprocess", "epoch") for unit in ("s01", "s02")}


def test_its_jobs_make_the_same_bytes_and_a_second_time_there_are_none(hrcneuro, snakemake, tiny):
    one = "study.subjects=['s01']"
    snakemake(assignments=[one])
    given = ("--config", "tiny.toml", "--set", STUDY, "--set", one, "--workdir", "here", "--no-figures", "-j", "1")
    assert hrcneuro("run", *given, cwd=tiny).code == 0
    assert artifacts(tiny / "here") == artifacts(tiny / "there") != {}
    assert "Nothing to be done" in snakemake(assignments=[one])
    changed = "epoch.tmax=0.9"
    assert named(snakemake("--dry-run", assignments=[one, changed])) == {"epoch s01"}
