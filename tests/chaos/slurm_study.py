"""Studies on a SLURM cluster of one node, started here: ``python tests/chaos/slurm_study.py [PIPELINE]``.

First a pipeline, smoke without a name, whose artifacts must be, byte for byte, those of one process. Then a tiny study
of four subjects: one job is cancelled, one hangs until its time is over, one is queued again by SLURM as a preempted
one is, one is killed as where memory runs out. The run must complete all but the cancelled one, name that, and the next
run must do only what is missing. It says why where no cluster can be started.
"""

import contextlib
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from slurm_lab import slurm, why_not
from table import Fault, tell
from tiny_study import ROOT, TINY, artifacts, half_written, kill_group, wait_for, write_tiny

COMMAND = [sys.executable, "-m", "hrcneuro"]


def main():
    """Return 0 where everything held."""
    faults = [Fault("SLURM: cancelled, late, requeued, killed")]
    reason = why_not() or ("" if importlib.util.find_spec("submitit") else "submitit is not installed")
    if reason:
        return tell(fault.skip(reason) for fault in faults)
    base = Path(tempfile.mkdtemp(prefix="hrcneuro-slurm-"))
    with slurm(base / "slurm", cores=4) as environment:
        environment["PYTHONPATH"] = str(ROOT)
        with faults[0].trial("four jobs"):
            lost_jobs(base, environment)
        with faults[0].trial("more memory than there is"):
            refused(base / "tiny", environment)
    shutil.rmtree(base)
    return tell(faults)


def lost_jobs(base, environment):
    """Jobs that are lost in four ways."""
    folder = base / "tiny"
    folder.mkdir()
    write_tiny(folder)
    (folder / "tiny.toml").write_text(TINY.replace('["s01", "s02"]', '["s01", "s02", "s03", "s04"]'))
    tiny = ("pipeline.toml", "--no-figures", "--workdir", "study")
    process = subprocess.Popen(
        [*COMMAND, "run", *tiny, "--json", "--executor", "slurm", "--set", "cluster.stages.acquire.minutes=1"],
        cwd=folder, env=environment, start_new_session=True, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        held = {unit: hold(folder / "study", unit) for unit in ("s01", "s02", "s03", "s04")}
        subprocess.run(["scancel", job_of(held["s01"])], env=environment, check=True)
        subprocess.run(["scontrol", "requeue", job_of(held["s03"])], env=environment, check=True)
        os.kill(held["s04"], signal.SIGKILL)
        out, err = process.communicate(timeout=600)
    finally:
        kill_group(process)
    items = {f"{item['stage']} {item['unit']}": item for item in json.loads(out)["items"]}
    assert process.returncode == 1, err
    assert "acquire of s01 is missing: its job was cancelled" in err, err
    assert items["acquire s02"]["lost"] == ["its 1 min ran out"], err
    assert items["acquire s03"]["lost"] == ["its worker was lost"], err
    assert items["acquire s04"]["lost"], err
    missing = {name for name, item in items.items() if item["state"] in ("failed", "blocked")}
    assert missing == {"acquire s01", "preprocess s01", "epoch s01"}
    assert {item["state"] for name, item in items.items() if name not in missing} == {"ran"}
    again = run(environment, *tiny, "--executor", "slurm", cwd=folder)
    assert again.returncode == 0, again.stderr
    assert {name for name, state in states(again).items() if state == "ran"} == missing
    assert half_written(folder / "study") == []
    calm = run(environment, *tiny[:-1], "calm", "-j", "1", cwd=folder)
    assert calm.returncode == 0, calm.stderr
    assert artifacts(folder / "study") == artifacts(folder / "calm"), "the disturbed run has other bytes"
    for name, item in items.items():
        if "lost" in item:
            print(f"{name}: {'; '.join(item['lost'])}: {item['state']}")
    print(f"the next run did {', '.join(sorted(missing))} and nothing else; all bytes are those of one process")


def refused(folder, environment):
    """More memory than the cluster has."""
    tiny = ("pipeline.toml", "--no-figures", "--workdir", "refused", "--executor", "slurm")
    done = run(environment, *tiny, "--set", "cluster.memory_gb=99999", cwd=folder)
    assert done.returncode == 2, done.stderr
    assert "SLURM takes no job of acquire with 99999 GB and 62 min: " in done.stderr
    print("what SLURM refuses is an error with SLURM's own words")


def hold(study, unit):
    """Stop the process that acquires a unit, as one that hangs, and return its number."""

    def stopped():
        with contextlib.suppress(IndexError, ProcessLookupError):
            folder = next(iter(study.glob(f"cache/acquire/{unit}/.tmp-*")), None)
            if folder is not None:
                number = int(folder.name.rpartition("-")[2])
                os.kill(number, signal.SIGSTOP)
                return number
        return None

    return wait_for(stopped, seconds=120)


def job_of(number):
    """Return the SLURM job of a process."""
    values = dict(
        pair.partition("=")[::2] for pair in Path(f"/proc/{number}/environ").read_bytes().decode().split("\0") if pair
    )
    return f"{values['SLURM_ARRAY_JOB_ID']}_{values['SLURM_ARRAY_TASK_ID']}"


def run(environment, *arguments, cwd=ROOT):
    """Run ``hrcneuro run`` to its end."""
    command = [*COMMAND, "run", *map(str, arguments), "--json"]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False, timeout=1800)


def states(done):
    """Return ``{"stage unit": state}`` of a finished run."""
    return {f"{item['stage']} {item['unit']}": item["state"] for item in json.loads(done.stdout)["items"]}


if __name__ == "__main__":
    sys.exit(main())
