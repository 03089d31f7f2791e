"""The simulated schedule of benchmarks/scale_schedule.py, on graphs whose end is known by arithmetic."""

import importlib.util
import sys
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "_schedule.py"


@pytest.fixture(scope="module")
def of():
    spec = importlib.util.spec_from_file_location("_schedule", BENCHMARK)
    module = importlib.util.module_from_spec(spec)
    # Where a dataclass looks for the types that it names.
    sys.modules["_schedule"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["_schedule"]


def chains(n):
    """n subjects of two stages each, and a group that reads all."""
    needs = {("first", i): () for i in range(n)} | {("second", i): (("first", i),) for i in range(n)}
    return needs | {("group", 0): tuple(("second", i) for i in range(n))}


def loads(of, needs, **group):
    own = {"seconds": 3600.0, "memory_gb": 1.0, "read": 10, "written": 5}
    return {task: of.Load(**{**own, **(group if task[0] == "group" else {})}) for task in needs}


@pytest.mark.parametrize(("nodes", "cores", "hours"), [(1, 1, 9), (1, 2, 5), (2, 2, 3), (1, 3, 4), (5, 9, 3)])
def test_work_is_shared_by_cores_and_ends_no_sooner_than_its_longest_chain(of, nodes, cores, hours):
    needs = chains(4)
    found = of.schedule(needs, loads(of, needs), of.Site(nodes, cores, 64.0, 100.0))
    assert found.hours == pytest.approx(hours)
    assert found.core_hours == pytest.approx(9)
    assert found.longest_hours == pytest.approx(3)
    assert (found.written, found.moved) == (45, 135)
    assert found.disk_hours == pytest.approx(135 / 100e6 / 3600)


def test_memory_keeps_cores_idle_as_long_as_it_is_short(of):
    needs = chains(4)
    assert of.schedule(needs, loads(of, needs), of.Site(1, 4, 2.0, 100.0)).hours == pytest.approx(5)


def test_what_no_machine_has_the_memory_for_is_named_and_the_rest_is_done(of):
    needs = chains(4) | {("report", 0): (("group", 0),)}
    found = of.schedule(needs, loads(of, needs, memory_gb=65.0), of.Site(2, 2, 64.0, 100.0))
    assert found.unfit == (("group", 0),)
    assert (found.hours, found.core_hours, found.largest_gb) == (pytest.approx(2), pytest.approx(8), 65.0)


def test_a_small_task_goes_ahead_of_a_large_one_that_waits_for_memory(of):
    needs = {"small": (), "large": (), "later": ()}
    hours = {"small": 2.0, "large": 1.0, "later": 1.0}
    memory = {"small": 1.0, "large": 3.5, "later": 1.0}
    tasks = {name: of.Load(3600 * hours[name], memory[name], 0, 0) for name in needs}
    assert of.schedule(needs, tasks, of.Site(1, 2, 4.0, 100.0)).hours == pytest.approx(3)
