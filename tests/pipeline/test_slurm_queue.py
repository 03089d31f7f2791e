"""What SLURM says of a job that left no answer, and what becomes of its task (with a SLURM: product/slurm_study.py)."""

import pytest

from hrcneuro.pipeline.resources import Resources
from hrcneuro.pipeline.slurm_queue import Verdict, read_queue, verdict

ALLOWED = Resources(1.5, 10, 2)


@pytest.mark.parametrize(
    ("state", "code", "expected"),
    [
        ("TIMEOUT", 0, Verdict("its 10 min ran out", ran_out_of="time")),
        ("OUT_OF_MEMORY", 0, Verdict("its 1.5 GB of memory ran out", ran_out_of="memory")),
        ("FAILED", 137, Verdict("it was killed, as where memory runs out", ran_out_of="memory")),
        ("FAILED", -9, Verdict("it was killed, as where memory runs out", ran_out_of="memory")),
        ("FAILED", 1, Verdict("its job ended as FAILED, exit code 1", again=False)),
        ("DEADLINE", 0, Verdict("its job ended as DEADLINE, exit code 0", again=False)),
        ("PREEMPTED", 0, Verdict("it was preempted", preempted=True)),
        ("CANCELLED", 15, Verdict("its job was cancelled", again=False)),
        ("NODE_FAIL", 0, Verdict("its node failed")),
        ("GONE", 0, Verdict("its job ended and left no answer")),
    ],
)
def test_what_slurm_lost_is_sent_again_and_what_somebody_ended_is_not(state, code, expected):
    assert verdict(state, code, ALLOWED) == expected


def test_the_queue_is_read_with_the_exit_codes_that_it_hides_in_a_wait_status():
    said = (
        "15_0                    CANCELLED           15            \n"
        "15_1                    COMPLETED           0             \n"
        "15_3                    FAILED              35072         \n"
        "16                      PENDING             0             \n"
        "slurm_load_jobs error: Unable to contact slurm controller\n"
    )
    assert read_queue(said) == {
        "15_0": ("CANCELLED", -15),
        "15_1": ("COMPLETED", 0),
        "15_3": ("FAILED", 137),
        "16": ("PENDING", 0),
    }
