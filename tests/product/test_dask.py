"""A study on the workers of a dask scheduler: the same bytes as here; what is lost is done again, and nothing else."""

import json
import os
import shutil
import signal

import pytest
from dask_lab import dask_lab
from tiny_study import ROOT, alive, half_written, kill_group, numbers, wait_for

pytest.importorskip("distributed", reason="the extra dask is not installed")
RUN = ("run", "pipeline.toml", "--no-figures", "--json")


@pytest.fixture
def lab(tmp_path):
    folder = tmp_path / "dask"
    folder.mkdir()
    with dask_lab(folder) as started:
        yield started


@pytest.fixture
def begin(tiny, start):
    """Start the tiny pipeline on a scheduler, in ``study``."""

    begun = []

    def launch(*arguments):
        begun.append(start(*RUN, "--executor", "dask", "--workdir", "study", *arguments, cwd=tiny))
        return begun[-1]

    yield launch
    for process in begun:
        kill_group(process)
        process.communicate()


def at(lab, **options):
    given = {"scheduler": lab.address, **options}
    return [part for name, value in given.items() for part in ("--set", f"cluster.{name}={value}")]


def victim(tiny, stage="acquire"):
    """Return the temporary folder of a job that is under way."""
    return wait_for(lambda: sorted(tiny.glob(f"study/cache/{stage}/*/.tmp-*")))[0]


def worker_of(folder):
    return int(folder.name.rpartition("-")[2])


def test_two_workers_make_the_same_bytes_under_the_same_keys_as_one_process(hrcneuro, lab, tiny, finished):
    there = hrcneuro(*RUN, "--executor", "dask", "--workdir", "there", *at(lab), cwd=tiny)
    assert there.code == 0, there.err
    assert set(there.states.values()) == {"ran"}
    assert numbers(finished / "one") == numbers(tiny / "there") != {}
    assert list((tiny / "there" / "cache" / ".runs").iterdir()) == []
    # Neither records nor the log say where the scheduler is.
    told = [*(tiny / "there").glob("cache/*/*/*/record.json"), *(tiny / "there").glob("results/log/*")]
    assert len(told) == 8
    assert [path for path in told if lab.address.rpartition("/")[2] in path.read_text()] == []
    assert all("cluster.scheduler=" in path.read_text() for path in told)


def test_workers_take_from_the_second_cache_what_it_has_and_say_what_it_has_not_whole(hrcneuro, lab, tiny, finished):
    pytest.importorskip("fsspec", reason="the extra remote is not installed")
    assert hrcneuro("cache", "push", tiny / "bucket", "--workdir", finished / "one").code == 0
    made = numbers(finished / "one")
    sha = min(made.values())
    one = tiny / "bucket" / "files" / sha[:2] / sha
    one.write_bytes(b"x" * one.stat().st_size)
    there = hrcneuro(*RUN, "--executor", "dask", "--workdir", "there", *at(lab), "--from", tiny / "bucket", cwd=tiny)
    assert there.code == 0, there.err
    assert sorted(there.states.values()).count("ran") == 1
    assert f"{len(there.states) - 1} results were taken from" in there.err
    assert "computed here: of " in there.err
    assert "has changed" in there.err
    assert numbers(tiny / "there") == made


def test_a_worker_killed_in_mid_stage_costs_its_job_alone_which_another_does(hrcneuro, lab, tiny, begin):
    process = begin(*at(lab))
    lost = victim(tiny)
    os.kill(worker_of(lost), signal.SIGKILL)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    items = {f"{item['stage']} {item['unit']}": item for item in json.loads(out)["items"]}
    name = f"acquire {lost.parent.name}"
    assert items[name]["lost"] == ["its worker was lost"]
    assert [one for one, item in items.items() if "lost" in item] == [name]
    assert f"acquire of {lost.parent.name} (its worker was lost)" in err
    again = hrcneuro(*RUN, "--executor", "serial", "--workdir", "study", cwd=tiny)
    assert set(again.states.values()) == {"hit"}
    assert half_written(tiny / "study") == []


def test_without_workers_the_run_names_what_is_missing_and_the_next_does_only_that(hrcneuro, lab, tiny, begin):
    process = begin(*at(lab, wait_s=1))
    wait_for(lambda: list(tiny.glob("study/cache/acquire/*/[!.]*/record.json")))
    for worker in lab.workers:
        worker.kill()
    out, err = process.communicate(timeout=120)
    assert process.returncode == 1
    states = {f"{item['stage']} {item['unit']}": item["state"] for item in json.loads(out)["items"]}
    done = {name for name, state in states.items() if state == "ran"}
    assert "failed" in states.values()
    assert "is missing: " in err
    assert "the dask scheduler has had no worker for 1 s" in err
    lab.add_worker()
    again = hrcneuro(*RUN, "--executor", "dask", "--workdir", "study", *at(lab), cwd=tiny)
    assert again.code == 0, again.err
    assert {name for name, state in again.states.items() if state == "hit"} >= done
    assert "ran" in again.states.values()


def test_a_job_that_kills_every_worker_is_given_up_after_its_tries(lab, tiny, begin):
    lab.add_worker()
    process = begin(*at(lab, retries=1))
    lost = victim(tiny)
    os.kill(worker_of(lost), signal.SIGKILL)
    unit = lost.parent
    second = wait_for(lambda: [one for one in unit.glob(".tmp-*") if worker_of(one) != worker_of(lost)])[0]
    os.kill(worker_of(second), signal.SIGKILL)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 1
    assert f"acquire of {unit.name} is missing: its worker was lost, 2 times" in err


def test_after_a_killed_run_the_next_one_completes(hrcneuro, lab, tiny, begin):
    process = begin(*at(lab))
    victim(tiny)
    process.kill()
    process.wait()
    again = hrcneuro(*RUN, "--executor", "dask", "--workdir", "study", *at(lab), cwd=tiny)
    assert again.code == 0, again.err
    assert set(again.states.values()) <= {"hit", "ran"}
    assert half_written(tiny / "study") == []


def test_a_worker_with_other_code_is_named_and_computes_nothing(hrcneuro, lab, tiny, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(ROOT / "hrcneuro", copy / "hrcneuro", ignore=shutil.ignore_patterns("__pycache__"))
    with (copy / "hrcneuro" / "stages" / "acquire.py").open("a") as file:
        file.write("\nOTHER = 1\n")
    for worker in lab.workers:
        worker.kill()
    lab.add_worker(PYTHONPATH=str(copy))
    done = hrcneuro("acquire", "s01", "--config", "tiny.toml", "--executor", "dask", *at(lab), cwd=tiny)
    assert done.code == 2
    assert "a worker's installation differs from that of the run: code: hrcneuro.stages.acquire\n" in done.err
    assert list(tiny.glob("cache/acquire/*/*/record.json")) == []


def test_an_interrupt_leaves_neither_workers_nor_anything_half_written(tiny, begin):
    process = begin("-j", "2")
    victim(tiny)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert half_written(tiny / "study") == []
    wait_for(lambda: not alive(process.pid))


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("tcp://127.0.0.1:1", ""),
        ("foo", "missing port number"),
        ("tcp://head", "missing port number"),
        ("head://127.0.0.1:1", "unknown address scheme 'head'"),
        ("tls://127.0.0.1:1", "TLS"),
    ],
)
def test_a_scheduler_that_is_not_there_is_named_with_what_to_start_and_nothing_else(hrcneuro, tiny, address, words):
    done = hrcneuro(*RUN, "--executor", "dask", "--set", f"cluster.scheduler={address}", cwd=tiny)
    assert done.code == 2
    problem, cure = done.err.splitlines()
    assert problem.startswith(f"error: no dask scheduler answers at '{address}': ")
    assert words in problem
    assert "with the port, as tcp://head:8786" in cure
    assert "'dask scheduler'" in cure
