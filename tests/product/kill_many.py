"""Kill -9 a smoke run at many random instants: ``python tests/product/kill_many.py [INSTANTS] [SEED] [PIPELINE]``.

An instant is drawn as a number of further entries and a time after them, so that a busy machine sees the whole run too.
After each kill every visible entry must verify. A run that was killed is started again where it stopped; one that
comes to its end begins anew in an empty folder. In the end a last run completes, and its artifacts must be, byte for
byte, those of a run that nobody disturbed, with one worker.
"""

import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from tiny_study import ROOT, alive, artifacts, half_written, kill_group, wait_for

COMMAND = [sys.executable, "-m", "hrcneuro"]


def main(instants=50, seed=0, pipeline="pipelines/smoke.toml"):
    """Return whether everything held."""
    draw = random.Random(seed)
    base = Path(tempfile.mkdtemp(prefix="hrcneuro-kill-"))
    study = base / "study"
    seen, left, complete = [], 0, 0
    while len(seen) < instants:
        process = subprocess.Popen(
            [*COMMAND, "run", pipeline, "--workdir", study, "-j", "2", "-q"], cwd=ROOT, start_new_session=True
        )
        goal = len(entries(study)) + draw.randint(0, 3)
        wait_for(lambda p=process, n=goal: len(entries(study)) >= n or p.poll() is not None, seconds=600)
        try:
            code = process.wait(timeout=draw.uniform(0.0, 4.0))
        except subprocess.TimeoutExpired:
            kill_group(process) if draw.random() < 0.5 else process.kill()
            process.wait()
            wait_for(lambda p=process: not alive(p.pid), seconds=30)
            left += len(half_written(study))
            seen.append(verified(study))
            print(f"kill {len(seen):3}: {seen[-1]} entries, all sound", flush=True)
        else:
            assert code == 0, f"a run ended with {code}"
            complete += 1
            shutil.rmtree(study)
    begin = time.monotonic()
    subprocess.run([*COMMAND, "run", pipeline, "--workdir", study, "-j", "2", "-q"], cwd=ROOT, check=True)
    print(f"the next run completed in {time.monotonic() - begin:.0f} s with {verified(study)} entries")
    assert half_written(study) == []
    calm = base / "calm"
    subprocess.run([*COMMAND, "run", pipeline, "--workdir", calm, "-j", "1", "-q"], cwd=ROOT, check=True)
    assert artifacts(calm) == artifacts(study), "the disturbed run has other bytes"
    print(
        f"{instants} kills, {complete} runs completed in between, a median of {statistics.median(seen):.0f} entries "
        f"visible, {left} temporary folders left behind and swept; {len(artifacts(calm))} artifacts equal, "
        "byte for byte, those of an undisturbed run with one worker"
    )
    shutil.rmtree(base)


def entries(study):
    """Return the visible entries."""
    return list(study.glob("cache/[!.]*/*/[!.]*/record.json"))


def verified(study):
    """Return the number of visible entries after checking that all are sound."""
    done = subprocess.run(
        [*COMMAND, "cache", "verify", "--workdir", study], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return int(done.stdout.split()[0])


if __name__ == "__main__":
    main(*(int(a) if a.isdigit() else a for a in sys.argv[1:]))
