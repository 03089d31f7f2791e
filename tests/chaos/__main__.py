"""All faults, one script after the other, and one table of them in the end: ``python tests/chaos [SCRIPT…]``.

``KILLS``, ``TRIALS`` and ``SEED`` of the environment make it longer, shorter or another one. What a script prints
besides stays on the screen; one that breaks off, or says nothing, counts as lost; what was skipped counts as nothing.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from table import PLACE, Fault, lines, read

HERE = Path(__file__).parent
KILLS, TRIALS, SEED = (os.environ.get(name, "") for name in ("KILLS", "TRIALS", "SEED"))
WHOLE = int(KILLS or 500)
LIVE = HERE / "of_the_live_side.py"
# What each is called with.
SCRIPTS = {
    "kills": [HERE / "kills.py", str(WHOLE), SEED or "0"],
    "disks": [HERE / "disks.py", TRIALS or "12", SEED or "0"],
    "damage": [HERE / "damage.py", TRIALS or "60", SEED or "0"],
    "hostile": [HERE / "hostile.py", TRIALS or "36", SEED or "0"],
    "machines": [HERE / "machines.py", TRIALS or "6", SEED or "0"],
    "clocks": [HERE / "clocks.py", TRIALS or "8", SEED or "0"],
    "memory": [HERE / "memory.py", TRIALS or "10", SEED or "0"],
    "interrupts": [HERE / "interrupts.py", TRIALS or "16", SEED or "0"],
    "versions": [HERE / "versions.py", TRIALS or "4", SEED or "0"],
    "shared": [HERE / "shared.py", TRIALS or "20", SEED or "0"],
    "engines": [HERE / "engines.py"],
    "slurm": [HERE / "slurm_study.py"],
    "experiment": [LIVE, "experiment_kills", TRIALS or "20", SEED or "0"],
    "subjects": [LIVE, "experiment_subjects"],
    "loop": [LIVE, "loop_kills", TRIALS or "10", SEED or "0"],
}


def main(*names):
    """Run the scripts that are named, or all; return 0 where nothing was lost and all kills were tried."""
    faults = []
    with tempfile.TemporaryDirectory(prefix="hrcneuro-chaos-") as folder:
        for name in names or SCRIPTS:
            print(f"--- {name}", flush=True)
            place = Path(folder) / f"{name}.jsonl"
            command = [sys.executable, *map(str, SCRIPTS[name])]
            code = subprocess.run(command, env={**os.environ, PLACE: str(place)}, check=False).returncode
            faults += rows_of(name, place, code)
    print("\n" + "\n".join(lines(faults)))
    kills, lost = kills_in(faults), sum(one.lost for one in faults)
    short = (not names or "kills" in names) and kills < WHOLE
    print(f"{sum(one.tried for one in faults)} trials, {kills} kills of runs, {lost} lost")
    if short:
        print(f"only {kills} of {WHOLE} kills were tried")
    return int(lost > 0 or short)


def rows_of(name, place, code):
    """Return the rows of a script; one that has left none, or failed and lost nothing by its rows, has broken off."""
    found = read(place)
    if not found or (code and not any(one.lost for one in found)):
        found.append(Fault(name, tried=1, lost=1, note=f"broke off with exit code {code}"))
    return found


def kills_in(faults):
    """Return how often runs were killed."""
    return sum(one.tried for one in faults if one.fault.startswith("kill -9, executor"))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
