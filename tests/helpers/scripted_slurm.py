"""SLURM's commands as scripts that say what a test wants: a busy server, a refusal, a job that is held.

No job runs: a test leaves the answers. For what a real SLURM does with jobs see ``slurm_lab``.
"""

import os
import pickle
import time

SCRIPTS = {
    "sinfo": "echo lab",
    "srun": "exit 1",
    "scancel": 'echo "$@" >> {place}/cancelled',
    "squeue": "cat {place}/queue || exit 1",
    # The first line of ``says`` is this call's answer; empty, or none left: a job is taken.
    "sbatch": """
length=$(sed -n 's/^#SBATCH --array=0-\\([0-9]*\\).*/\\1/p' "$1")
echo $((${{length:-0}} + 1)) >> {place}/lengths
if grep '^#SBATCH --mem=' "$1" | grep -qv '=[0-9]*[KMGT]B*$'; then
  echo "sbatch: error: Invalid --mem specification" >&2; exit 1
fi
said=$(sed -n 1p {place}/says 2>/dev/null)
sed -i 1d {place}/says 2>/dev/null
if [ -n "$said" ]; then echo "sbatch: error: $said" >&2; exit 1; fi
if [ $((${{length:-0}} + 1)) -gt "$(cat {place}/longest)" ]; then echo "sbatch: error: too long" >&2; exit 1; fi
echo "Submitted batch job $(wc -l < {place}/lengths)"
""",
}


class Scripted:
    """What the scripts say, and what they were called with."""

    def __init__(self, place):
        self.place = place
        (place / "longest").write_text("1000")
        (place / "queue").write_text("")
        for name, script in SCRIPTS.items():
            path = place / "bin" / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(f"#!/bin/sh\n{script.format(place=place)}\n")
            path.chmod(0o755)
        self.path = f"{place / 'bin'}:{os.environ['PATH']}"

    def says(self, *lines):
        """Let the next calls of sbatch fail with these words."""
        (self.place / "says").write_text("".join(f"{line}\n" for line in lines))

    def queue(self, *rows):
        """Let squeue print these rows: job, state, wait status, reason."""
        (self.place / "queue").write_text("".join(f"{'  '.join(map(str, row))}\n" for row in rows))

    def is_away(self):
        """Let squeue fail."""
        (self.place / "queue").unlink()

    def takes(self, longest):
        """Let sbatch refuse longer arrays."""
        (self.place / "longest").write_text(str(longest))

    @property
    def lengths(self):
        """How long the arrays were that sbatch was given, one after the other."""
        return [int(line) for line in self._lines("lengths")]

    @property
    def cancelled(self):
        """The jobs that were cancelled."""
        return [job for line in self._lines("cancelled") for job in line.split()]

    def _lines(self, name):
        path = self.place / name
        return path.read_text().splitlines() if path.exists() else []


def leave(folder, job, answer):
    """Write an answer as submitit does in a job."""
    path = folder / f"{job}_0_result.pkl"
    part = path.with_suffix(".part")
    part.write_bytes(pickle.dumps(("success", answer)))
    part.rename(path)


def until(holds, seconds=20.0):
    """Wait until something holds, and return it."""
    deadline = time.monotonic() + seconds
    while not (value := holds()):
        assert time.monotonic() < deadline, "it never came true"
        time.sleep(0.01)
    return value
