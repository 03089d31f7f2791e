"""What SLURM says of a job that left no answer, and what becomes of its task (with a SLURM: chaos/slurm_study.py)."""

import pytest

from hrcneuro.pipeline import on_slurm
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


def test_of_a_job_that_failed_its_own_last_words_are_told_and_not_slurm_s(tmp_path):
    log = tmp_path / "log.err"
    log.write_text(
        "Traceback\nModuleNotFoundError: No module named 'mne'\nsrun: error: task 0: Exited with exit code 1\n"
    )
    assert on_slurm.last_words(log) == "ModuleNotFoundError: No module named 'mne'"
    log.write_text("slurmstepd: error: *** STEP CANCELLED ***\n")
    assert on_slurm.last_words(log) == "slurmstepd: error: *** STEP CANCELLED ***"
    assert on_slurm.last_words(tmp_path / "none") == ""
