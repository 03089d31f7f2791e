"""All faults, one script after the other, and one table of them in the end: ``python tests/chaos [SCRIPT…]``.

``KILLS``, ``TRIALS`` and ``SEED`` of the environment make it longer, shorter or another one. What a script prints
besides stays on the screen; one that breaks off counts as lost.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from table import PLACE, Fault, lines, read

HERE = Path(__file__).parent
KILLS, TRIALS, SEED = (os.environ.get(name, "") for name in ("KILLS", "TRIALS", "SEED"))
PRODUCT = HERE.parent / "product"
# What each is called with; those that fill no rows of their own say in words what they tried.
SCRIPTS = {
    "kills": [HERE / "kills.py", KILLS or "500", SEED or "0"],
    "disks": [HERE / "disks.py", TRIALS or "12", SEED or "0"],
    "damage": [HERE / "damage.py", TRIALS or "60", SEED or "0"],
    "hostile": [HERE / "hostile.py", TRIALS or "36", SEED or "0"],
    "machines": [HERE / "machines.py", TRIALS or "6", SEED or "0"],
    "clocks": [HERE / "clocks.py", TRIALS or "8", SEED or "0"],
    "memory": [HERE / "memory.py", TRIALS or "10", SEED or "0"],
    "interrupts": [HERE / "interrupts.py", TRIALS or "16", SEED or "0"],
    "versions": [HERE / "versions.py", TRIALS or "4", SEED or "0"],
    "shared": [HERE / "shared.py", TRIALS or "20", SEED or "0"],
    "slurm": [HERE / "slurm_study.py"],
    "experiment": [PRODUCT / "experiment_kills.py", TRIALS or "20", SEED or "0"],
    "subjects": [PRODUCT / "experiment_subjects.py"],
    "loop": [PRODUCT / "loop_kills.py", TRIALS or "10", SEED or "0"],
}
WORDS = {
    "shared": "studies that share a cache, in any order",
    "slurm": "SLURM: cancelled, late, requeued, killed",
    "experiment": "kill -9, an experiment",
    "subjects": "subjects of an experiment, one after the other",
    "loop": "kill -9, a closed loop",
}


def main(*names):
    """Run the scripts that are named, or all; return 0 where nothing was lost."""
    faults = []
    with tempfile.TemporaryDirectory(prefix="hrcneuro-chaos-") as folder:
        for name in names or SCRIPTS:
            print(f"--- {name}", flush=True)
            place = Path(folder) / f"{name}.jsonl"
            command = [sys.executable, *map(str, SCRIPTS[name])]
            code = subprocess.run(command, env={**os.environ, PLACE: str(place)}, check=False).returncode
            found = read(place)
            if not found or (code and not any(one.lost for one in found)):
                tried = int(SCRIPTS[name][1]) if len(SCRIPTS[name]) > 1 else 1
                lost = int(code != 0)
                found.append(Fault(WORDS.get(name, name), tried, tried - lost, lost, "broke off" if lost else ""))
            faults += found
    print("\n" + "\n".join(lines(faults)))
    kills = sum(one.tried for one in faults if one.fault.startswith("kill -9, executor"))
    lost = sum(one.lost for one in faults)
    print(f"{sum(one.tried for one in faults)} trials, {kills} kills of runs, {lost} lost")
    return int(lost > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
