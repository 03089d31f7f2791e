"""Whatever ends a run, what is visible is whole, and the next run goes on from there."""

import contextlib
import json
import os
import random
import signal
import subprocess
import time

import pytest
from tiny_study import alive, half_written, kill_group, wait_for

# Somebody who pressed Ctrl-C waits this long; generous, since test machines are shared.
SOON_S = 15.0
# What is not an interrupt to everybody: as a shell shows it.
ENDS = {
    signal.SIGQUIT: (131, "ended by SIGQUIT (Ctrl-\\)"),
    signal.SIGXCPU: (152, "ended by SIGXCPU: the limit of processor time is reached"),
}


@pytest.fixture
def run(start, tiny):
    """Start the tiny pipeline in ``study``, without pictures; whatever is left of it ends with the test."""
    begun = []

    def launch(*arguments):
        process = start("run", tiny / "pipeline.toml", "--workdir", tiny / "study", "--no-figures", *arguments)
        begun.append(process)
        return process

    yield launch
    for process in begun:
        kill_group(process)
        process.communicate()


def at_work(tiny, stage="*"):
    """Return the temporary folders of a stage, once there are any."""
    return wait_for(lambda: sorted(tiny.glob(f"study/cache/{stage}/*/.tmp-*")))


def sound(hrcneuro, workdir):
    """Every visible entry verifies."""
    done = hrcneuro("cache", "verify", "--json", "--workdir", workdir)
    assert done.code == 0, done.out
    return done.json["entries"]


def test_after_kill_9_at_random_instants_all_entries_verify_and_the_next_run_completes(hrcneuro, run, tiny):
    draw = random.Random(7)
    for _ in range(4):
        process = run("-j", "2")
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=draw.uniform(0.3, 3.0))
        # The whole group as the system does when memory is gone, or the parent alone.
        kill_group(process) if draw.random() < 0.5 else process.kill()
        process.wait()
        wait_for(lambda process=process: not alive(process.pid), seconds=SOON_S)
        sound(hrcneuro, tiny / "study")
    done = hrcneuro("run", tiny / "pipeline.toml", "--workdir", tiny / "study", "-j", "1", "--no-figures", "--json")
    assert done.code == 0, done.err
    assert set(done.states.values()) <= {"hit", "ran"}
    assert sound(hrcneuro, tiny / "study") == len(done.states)
    assert half_written(tiny) == []


@pytest.mark.parametrize(
    ("number", "whole_group", "arguments"),
    [
        (signal.SIGINT, True, ("-j", "2")),
        (signal.SIGQUIT, True, ("-j", "2")),
        (signal.SIGTERM, False, ("-j", "2", "--json")),
        (signal.SIGTERM, True, ("-j", "2")),
        (signal.SIGINT, False, ("--executor", "serial", "--json")),
        (signal.SIGHUP, False, ("--executor", "serial")),
        (signal.SIGXCPU, False, ("--executor", "serial", "--json")),
    ],
    ids=[
        *("ctrl-c", "ctrl-backslash", "terminate", "terminate-all", "ctrl-c-serial", "hang-up-serial"),
        "limit-serial",
    ],
)
def test_an_interrupt_ends_it_soon_and_leaves_nothing_half_written(run, tiny, number, whole_group, arguments):
    process = run(*arguments)
    at_work(tiny)
    begin = time.monotonic()
    os.killpg(process.pid, number) if whole_group else process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert time.monotonic() - begin < SOON_S
    assert process.returncode == ENDS.get(number, (130,))[0]
    assert half_written(tiny) == []
    wait_for(lambda: not alive(process.pid), seconds=2)
    assert "the same command goes on from here" in err
    assert ENDS.get(number, (130, "interrupted"))[1] in err
    assert "Traceback" not in err
    assert "Warning" not in err
    if "--json" in arguments:
        assert json.loads(out)["error"]["problem"] == ENDS.get(number, (130, "interrupted"))[1]


def kill_worker_of(folder):
    """Kill the worker whose temporary folder this is; return its process."""
    worker = int(folder.name.rpartition("-")[2])
    os.kill(worker, signal.SIGKILL)
    return worker


def ended(process):
    """Return the items of a run with ``--json`` by their names, and what it said."""
    out, err = process.communicate(timeout=120)
    return {f"{i['stage']} {i['unit']}": i for i in json.loads(out)["items"]}, err


def test_the_job_of_a_killed_worker_is_run_again_and_named_and_nothing_else_is(hrcneuro, run, tiny):
    process = run("-j", "2", "--json")
    victim = at_work(tiny, "acquire")[0]
    kill_worker_of(victim)
    items, err = ended(process)
    unit = victim.parent.name
    assert process.returncode == 0, err
    assert {item["state"] for item in items.values()} == {"ran"}
    assert items[f"acquire {unit}"]["lost"] == ["its worker died: it was ended by SIGKILL"]
    assert [name for name, item in items.items() if "lost" in item] == [f"acquire {unit}"]
    assert f"sent to a worker again, and complete: acquire of {unit} (its worker died: it was ended by SIGKILL)" in err
    again = hrcneuro("run", tiny / "pipeline.toml", "--workdir", tiny / "study", "-j", "1", "--no-figures", "--json")
    assert set(again.states.values()) == {"hit"}
    assert half_written(tiny) == []


def test_a_job_that_kills_each_of_its_workers_fails_after_its_tries_and_costs_no_other(hrcneuro, run, tiny):
    process = run("-j", "2", "--json", "--set", "cluster.stages.acquire.retries=1")
    victim = at_work(tiny, "acquire")[0]
    unit, first = victim.parent, kill_worker_of(victim)
    (second,) = wait_for(lambda: [one for one in unit.glob(".tmp-*") if not one.name.endswith(f"-{first}")])
    kill_worker_of(second)
    items, err = ended(process)
    other = {"s01": "s02", "s02": "s01"}[unit.name]
    failed = items[f"acquire {unit.name}"]
    assert process.returncode == 1
    assert failed["state"] == "failed"
    assert failed["error"]["problem"] == f"the worker of acquire of {unit.name} died: it was ended by SIGKILL, 2 times"
    assert "use fewer workers (-j 1)" in failed["error"]["cure"]
    assert failed["lost"] == ["its worker died: it was ended by SIGKILL"] * 2
    assert f"error: acquire of {unit.name}" in err
    assert items[f"epoch {unit.name}"]["state"] == "blocked"
    assert items[f"epoch {other}"]["state"] == "ran"
    assert items["simulate group"]["state"] == "ran"
    again = hrcneuro("run", tiny / "pipeline.toml", "--workdir", tiny / "study", "-j", "1", "--no-figures", "--json")
    assert again.code == 0
    assert again.states[f"epoch {other}"] == "hit"
    assert half_written(tiny) == []


def test_workers_end_with_a_parent_that_was_killed(run, tiny):
    process = run("-j", "2")
    at_work(tiny)
    process.kill()
    process.wait()
    wait_for(lambda: not alive(process.pid), seconds=SOON_S)


def test_of_six_processes_that_race_for_one_key_one_computes(start, tiny, hrcneuro):
    racers = [
        start(
            *("simulate", "--config", tiny / "tiny.toml", "--workdir", tiny / "study"),
            *("--executor", kind, "--json", "--no-figures"),
        )
        for kind in ("serial", "processes") * 3
    ]
    ends = [racer.communicate(timeout=120) for racer in racers]
    assert [racer.returncode for racer in racers] == [0] * 6, ends
    states = sorted(json.loads(out)["items"][0]["state"] for out, _ in ends)
    assert states == ["hit"] * 5 + ["ran"]
    assert sound(hrcneuro, tiny / "study") == 1


def test_two_runs_at_once_share_the_work_and_both_succeed(start, tiny):
    both = [
        start(
            *("run", tiny / "pipeline.toml", "--workdir", tiny / "study", "-j", "1", "--json", "--no-figures"),
            *("--set", order),
        )
        for order in ('study.subjects=["s01", "s02"]', 'study.subjects=["s02", "s01"]')
    ]
    ends = [process.communicate(timeout=240) for process in both]
    assert [process.returncode for process in both] == [0, 0], ends
    items = [item for out, _ in ends for item in json.loads(out)["items"]]
    computed = [(item["stage"], item["unit"]) for item in items if item["state"] == "ran"]
    assert sorted(computed) == sorted({(item["stage"], item["unit"]) for item in items})
    assert len(computed) == 7
    assert half_written(tiny) == []
