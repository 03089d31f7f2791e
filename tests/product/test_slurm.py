"""A run on SLURM, from outside, where SLURM is scripted (with a real one: chaos/slurm_study.py)."""

import os

import pytest
from scripted_slurm import Scripted
from tiny_study import ROOT, kill_group, wait_for

pytest.importorskip("submitit", reason="the extra slurm is not installed")
pytest.importorskip("paramiko", reason="the extra remote is not installed")
SECRET = "hunter2-hunter2"
URL = f"sftp://me:{SECRET}@127.0.0.1:1/bucket"
COMMAND = ("acquire", "--config", "tiny.toml", "--workdir", "study", "--no-figures", "--executor", "slurm")


@pytest.fixture
def environment(tmp_path):
    (tmp_path / "slurm").mkdir()
    return {**os.environ, "PYTHONPATH": str(ROOT), "PATH": Scripted(tmp_path / "slurm").path}


def test_while_jobs_are_under_way_the_password_of_a_second_cache_lies_in_no_file(start, tiny, environment):
    process = start(*COMMAND, cwd=tiny, env={**environment, "HRCNEURO_FROM": URL})
    try:
        runs = tiny / "study" / "cache" / ".runs"
        wait_for(lambda: len(list(runs.rglob("*_submitted.pkl"))) == 2)
        files = {path.name: path.read_bytes() for path in (tiny / "study").rglob("*") if path.is_file()}
        assert [path.stat().st_mode & 0o077 for path in runs.glob("*/*") if path.is_dir()] == [0]
    finally:
        kill_group(process)
        process.communicate()
    # The tickets are among what is looked into.
    assert sum(name.endswith("_submitted.pkl") for name in files) == 2
    assert [name for name, content in files.items() if SECRET.encode() in content] == []


@pytest.mark.parametrize("executor", ["slurm", "dask"])
def test_a_password_on_the_command_line_is_refused_before_anything_is_sent(hrcneuro, tiny, environment, executor):
    done = hrcneuro(*COMMAND[:-1], executor, "--from", URL, cwd=tiny, env={"PATH": environment["PATH"]})
    assert done.code == 2
    assert "is given with a password" in done.err
    assert "HRCNEURO_FROM" in done.err
    assert SECRET not in done.err
    assert list(tiny.rglob("*.pkl")) == []
