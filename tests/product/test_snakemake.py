"""pipelines/Snakefile: Snakemake names the tasks that we would, and its jobs make the bytes that ours make."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys

import pytest
from tiny_study import ROOT, numbers

pytestmark = pytest.mark.skipif(not importlib.util.find_spec("snakemake"), reason="snakemake is not installed")
STAGES = ("acquire", "preprocess", "epoch", "simulate")
STUDY = f"study.stages={json.dumps(STAGES)}"


@pytest.fixture
def snakemake(tiny):
    """Run Snakemake on the tiny study with these assignments of the configuration."""

    def run(*options, assignments=(), study=STUDY, target="numbers", code=0):
        command = [
            *(sys.executable, "-m", "snakemake", "--snakefile", ROOT / "pipelines" / "Snakefile", "--cores", "2"),
            *("--config", "study=tiny.toml", "workdir=there", f"set={json.dumps([study, *assignments])}"),
            *(*options, "--", target),
        ]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
        done = subprocess.run(
            [*map(str, command)], cwd=tiny, env=environment, capture_output=True, text=True, check=False, timeout=300
        )
        assert done.returncode == code, done.stdout + done.stderr
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


def test_a_dry_run_names_the_same_tasks_as_ours(hrcneuro, snakemake, tiny, finished):
    everything = named(snakemake("--dry-run"))
    assert everything == ours(hrcneuro, tiny)
    assert len(everything) == 7
    shutil.copytree(finished / "one", tiny / "there", symlinks=True)
    assert named(snakemake("--dry-run")) == set()
    changed = ("preprocess.h_freq=30",)
    again = named(snakemake("--dry-run", assignments=changed))
    assert again == ours(hrcneuro, tiny, *changed)
    assert again == {f"{stage} {unit}" for stage in ("preprocess", "epoch") for unit in ("s01", "s02")}


def test_its_jobs_make_the_same_bytes_and_a_second_time_there_are_none(snakemake, tiny, finished):
    one = "study.subjects=['s01']"
    snakemake(assignments=[one])
    ours = {name: digest for name, digest in numbers(finished / "one").items() if "/s02/" not in name}
    assert numbers(tiny / "there") == ours != {}
    assert "Nothing to be done" in snakemake(assignments=[one])
    changed = "epoch.tmax=0.9"
    assert named(snakemake("--dry-run", assignments=[one, changed])) == {"epoch s01"}


def test_the_report_s_job_is_given_memory_for_each_thread_and_time(snakemake, tiny):
    one = ["study.subjects=['s01']", "cluster.memory_gb=1.5", "cluster.minutes=7"]
    said = snakemake("--dry-run", assignments=one, target="report")
    job = said[said.index("rule report:") :]
    given = re.search(r"resources: (.*)", job)[1].split(", ")
    assert {"mem_mb=1536", "runtime=7"} <= set(given)


@pytest.mark.parametrize("arm", [["backend=ur", "host=127.0.0.9", "at_the_robot=true"], ["backend=ursim"]])
def test_an_arm_in_real_time_is_not_left_to_it(snakemake, tiny, arm):
    given = [f"robot.{one}" for one in arm]
    said = snakemake("--dry-run", study="study.stages=['robot']", assignments=given, code=1)
    assert "drives one arm in real time, and 2 subjects are asked of it (s01, s02)" in said
    assert "one subject a command" in said


def test_a_job_is_tried_again_as_often_as_the_configuration_says_with_more_each_time(snakemake, tiny):
    given = ["study.subjects=['s01']", "acquire.source=file", "acquire.path=none/{subject}.fif", "cluster.retries=5"]
    given += ["cluster.stages.acquire.retries=1", "cluster.stages.acquire.memory_gb=0.5"]
    said = snakemake(study="study.stages=['acquire']", assignments=given, code=1)
    assert said.count("Error in rule acquire") == 2
    assert re.findall(r"mem_mb=(\d+)", said) == ["512", "1024"]
