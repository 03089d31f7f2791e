"""The experiment with simulated persons, whole sessions: ``python tests/product/experiment_subjects.py [SUBJECTS]``.

At virtual pace 12 subjects have their sessions. The rows of each must be those that ``simulate_session`` draws, in
every column but the times, and the logs must keep all rules of the experiment, as ``acquire --rules`` measures them.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

import experiment_lab as lab
import pandas as pd

COMMAND = [sys.executable, "-m", "hrcneuro"]


def main(n: int = 12) -> int:
    """Run so many subjects, and return how many; an assertion fails where something does not hold."""
    with tempfile.TemporaryDirectory(prefix="hrcneuro-experiment-") as folder:
        for subject in [f"s{number:02d}" for number in range(1, n + 1)]:
            begun = time.monotonic()
            _run("experiment", subject, "--human", "simulated", "--pace", "virtual", "--workdir", folder, "-q")
            took = time.monotonic() - begun
            rows = pd.read_parquet(Path(folder) / "recordings" / subject / "trials.parquet")
            lab.same(rows, lab.expected(lab.SessionParams(), subject=subject))
            print(f"{subject}: {took:.0f} s, {len(rows):,} moves, each as simulate_session draws it", flush=True)
        subjects = ["--set", f"study.subjects={[f's{number:02d}' for number in range(1, n + 1)]}"]
        for source in ("dataset", "semisynthetic"):
            words = ["--set", f"acquire.source={source}", "--set", f"acquire.path={Path(folder) / 'recordings'}"]
            said = _run("acquire", "--rules", "--json", *words, *subjects, "--set", "study.exclude=[]")
            rules = json.loads(said)["rules"]
            kept = sum(rule["ok"] for rule in rules)
            print(f"{source}: {kept} of {len(rules)} rules hold")
            assert n < 12 or kept == len(rules), [rule for rule in rules if not rule["ok"]]
    return n


def _run(*words: str) -> str:
    return subprocess.run([*COMMAND, *words], cwd=lab.ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
