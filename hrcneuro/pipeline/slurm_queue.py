"""What SLURM's queue says of jobs, and what that means for their tasks."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass

from hrcneuro.pipeline.resources import Resources

LIVES = {"PENDING", "RUNNING", "SUSPENDED", "COMPLETING", "CONFIGURING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED",
          "RESIZING", "SIGNALING", "SPECIAL_EXIT", "STAGE_OUT", "STOPPED", "RESV_DEL_HOLD"}  # fmt: skip
_KILLED = (-signal.SIGKILL, 128 + signal.SIGKILL)
_LOST = {"NODE_FAIL": "its node failed", "BOOT_FAIL": "its node did not start", "REVOKED": "its job was taken back"}


@dataclass(frozen=True)
class Verdict:
    """What is to become of a task whose job ended without an answer.

    Attributes:
        reason: Why it did, in words that go on from the task's name.
        again: Whether it is sent again.
        ran_out_of: ``time`` or ``memory``, of which it is given more then.
        preempted: Whether that counts as no try.
    """

    reason: str
    again: bool = True
    ran_out_of: str = ""
    preempted: bool = False


def verdict(state: str, code: int, allowed: Resources) -> Verdict:
    """Return what is to become of a task by SLURM's state of its job and the job's exit code (negative: a signal)."""
    if state == "TIMEOUT":
        return late(allowed)
    if state == "OUT_OF_MEMORY":
        return Verdict(f"its {allowed.memory_gb:g} GB of memory ran out", ran_out_of="memory")
    if state == "PREEMPTED":
        return Verdict("it was preempted", preempted=True)
    if state in _LOST:
        return Verdict(_LOST[state])
    if state in ("GONE", "COMPLETED"):
        return Verdict("its job ended and left no answer")
    if state == "CANCELLED":
        # Whoever did that does not want to see it again at once.
        return Verdict("its job was cancelled", again=False)
    if code in _KILLED:
        # The kernel's own word where memory is gone, and no proof of it.
        return Verdict("it was killed, as where memory runs out", ran_out_of="memory")
    return Verdict(f"its job ended as {state}, exit code {code}", again=False)


def late(allowed: Resources) -> Verdict:
    """Return what is to become of a task whose time ran out."""
    return Verdict(f"its {allowed.minutes} min ran out", ran_out_of="time")


def states(ids: Iterable[str]) -> dict[str, tuple[str, int]] | None:
    """Return each job's state and exit code, of those that SLURM still knows; None where it does not answer.

    Asked of the queue, not of the accounting: many clusters, and all small ones, keep no accounts.
    """
    arrays = ",".join(sorted({one.partition("_")[0] for one in ids}))
    columns = "--Format=JobArrayID:40,State:20,exit_code:20"
    code, said = asked(["squeue", "--noheader", "--array", "--states=all", f"--jobs={arrays}", columns])
    # Of one array alone that it has forgotten it says so; of several it leaves that out.
    return None if code and "Invalid job id" not in said else read_queue(said)


def read_queue(said: str) -> dict[str, tuple[str, int]]:
    """Return job -> state and exit code, negative for a signal, of what ``squeue`` prints."""
    found = {}
    for row in map(str.split, said.splitlines()):
        if len(row) == 3 and row[0].partition("_")[0].isdigit() and row[2].isdigit():
            # As the system's wait tells it: an exit code has its place above that of a signal.
            status = int(row[2])
            found[row[0]] = (row[1], status >> 8 or -(status & 0x7F))
    return found


def asked(command: list[str]) -> tuple[int, str]:
    """Return exit code and words of one of SLURM's commands."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    except (OSError, subprocess.SubprocessError) as error:
        return 1, str(error)
    return done.returncode, (done.stdout + done.stderr).strip()
