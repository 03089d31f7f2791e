"""A SLURM job where it runs: who may write what it reads, and what it says as SLURM ends it."""

import os
import pickle
import signal
import time

import pytest

from hrcneuro.errors import ConfigError
from hrcneuro.pipeline import slurm_job
from hrcneuro.pipeline.item import State
from hrcneuro.pipeline.slurm_job import OUT_OF_TIME, PREEMPTED, in_a_job, others_may_write, private_folder, read_answer
from hrcneuro.pipeline.worker import Answer


@pytest.fixture
def home(tmp_path, monkeypatch):
    folder = tmp_path / "home"
    folder.mkdir(mode=0o755)
    monkeypatch.setenv("HOME", str(folder))
    return folder


@pytest.fixture
def run(tmp_path):
    folder = tmp_path / "cache" / ".runs" / "aa"
    folder.mkdir(parents=True)
    return folder


def test_in_a_cache_of_one_s_own_the_jobs_folder_lies_in_it_and_nobody_else_may_look(run, home):
    with private_folder(run) as folder:
        assert folder.parent == run
        assert folder.stat().st_mode & 0o777 == 0o700
        assert others_may_write(folder) is None
    assert not folder.exists()
    assert list(home.iterdir()) == []


@pytest.mark.parametrize("part", ["cache", "cache/.runs", "cache/.runs/aa"])
def test_in_a_cache_that_a_group_shares_it_lies_in_the_home_folder(run, home, tmp_path, part):
    (tmp_path / part).chmod(0o2775)
    with private_folder(run) as folder:
        assert folder.parent == home / ".hrcneuro" / "slurm"
        assert others_may_write(folder) is None
    assert not folder.exists()


def test_behind_a_link_the_folder_that_it_leads_to_counts_too(tmp_path):
    (tmp_path / "shared" / "cache").mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / "shared" / "cache")
    assert others_may_write(tmp_path / "link") is None
    (tmp_path / "shared").chmod(0o775)
    assert others_may_write(tmp_path / "link") == tmp_path / "shared"
    (tmp_path / "shared").chmod(0o1777)  # everybody renames what is theirs
    assert others_may_write(tmp_path / "link") is None


def test_where_others_may_write_the_home_folder_too_no_job_is_sent(run, home):
    run.chmod(0o777)
    home.chmod(0o777)
    with pytest.raises(ConfigError, match="it would run as you") as caught, private_folder(run):
        pass
    assert caught.value.cure.endswith(f"chmod go-w {home}")


class Harm:
    """Pickled, it runs code where it is read."""

    def __reduce__(self):
        return os.mkdir, (os.environ["HARM"],)


@pytest.fixture
def answer(tmp_path, monkeypatch):
    """A place for an answer, and one that does harm to whoever reads it."""
    monkeypatch.setenv("HARM", str(tmp_path / "harm"))
    folder = tmp_path / "jobs"
    folder.mkdir(mode=0o700)
    yield folder / "1_0_result.pkl"
    assert not (tmp_path / "harm").exists()


def test_an_answer_of_one_s_own_is_read_and_none_is_none(answer):
    assert read_answer(answer) is None
    answer.write_bytes(pickle.dumps(("success", Answer(State.RAN))))
    assert read_answer(answer) == ("success", Answer(State.RAN))


def test_an_answer_that_others_can_have_written_is_not_run(answer, tmp_path, monkeypatch):
    harm = pickle.dumps(Harm())
    answer.write_bytes(harm)
    answer.chmod(0o666)
    with pytest.raises(PermissionError, match="not yours alone"):
        read_answer(answer)
    answer.chmod(0o600)
    answer.parent.chmod(0o770)
    with pytest.raises(PermissionError, match="not yours alone"):
        read_answer(answer)
    answer.parent.chmod(0o700)
    (tmp_path / "elsewhere").write_bytes(harm)
    answer.unlink()
    answer.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OSError, match="symbolic links"):
        read_answer(answer)
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    answer.unlink()
    answer.write_bytes(harm)
    with pytest.raises(PermissionError, match="not yours alone"):
        read_answer(answer)


@pytest.fixture
def handlers():
    before = {number: signal.getsignal(number) for number in (signal.SIGUSR2, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize(
    ("end_s", "minutes", "expected"),
    [(60, 5, OUT_OF_TIME), (3600, 5, PREEMPTED), (None, 5, PREEMPTED), (None, 0, OUT_OF_TIME), ("odd", 0, OUT_OF_TIME)],
)
def test_a_warning_long_before_the_end_of_its_time_is_a_preemption(handlers, monkeypatch, end_s, minutes, expected):
    monkeypatch.delenv("SLURM_JOB_END_TIME", raising=False)
    if end_s is not None:
        monkeypatch.setenv("SLURM_JOB_END_TIME", end_s if end_s == "odd" else str(int(time.time() + end_s)))
    monkeypatch.setattr(slurm_job, "work", lambda ticket: signal.raise_signal(signal.SIGUSR2))
    assert in_a_job(None, minutes) == expected


@pytest.mark.parametrize("number", [signal.SIGUSR2, signal.SIGTERM])
def test_what_is_done_is_answered_whatever_signal_comes_then(handlers, monkeypatch, number):
    done = Answer(State.RAN)
    monkeypatch.setattr(slurm_job, "work", lambda ticket: done)
    assert in_a_job(None, 5) is done
    signal.raise_signal(number)  # while submitit writes the answer
