"""The order in which a walk takes its tasks, held against a plain search through all of them."""

import concurrent.futures as futures
import time

from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.pipeline.frontier import Ended, Frontier
from hrcneuro.pipeline.graph import Task


def task(number):
    return Task(number, "s01", f"stage{number}")


@st.composite
def graphs(draw):
    """Tasks each of which stands on some earlier ones."""
    n = draw(st.integers(1, 8))
    return {task(i): [task(j) for j in range(i) if draw(st.booleans())] for i in range(n)}


@given(graphs(), st.data())
def test_the_first_task_whose_upstream_is_settled_is_taken_whatever_ends_when(needs, data):
    frontier, waiting, running, settled = Frontier(needs), dict(needs), [], set()
    while frontier or running:
        ready = [one for one, sources in waiting.items() if settled.issuperset(sources)]
        found = frontier.take()
        assert found == (ready[0] if ready else None)
        if found is not None:
            del waiting[found]
            running.append(found)
        if running and (found is None or data.draw(st.booleans())):
            one = running.pop(data.draw(st.integers(0, len(running) - 1)))
            settled.add(one)
            frontier.settle(one)
    assert settled == set(needs)


def test_what_was_found_altered_is_taken_again_before_what_stands_on_it():
    first, second, third = task(0), task(1), task(2)
    frontier = Frontier({first: [], second: [first], third: [first]})
    for one in (first, second):
        assert frontier.take() == one
        if one is first:
            frontier.settle(one)
    frontier.wait_again(second, first)
    assert frontier.take() is None
    frontier.resume()
    assert frontier.take() == first
    assert frontier.take() is None
    frontier.settle(first)
    assert [frontier.take(), frontier.take(), frontier.take()] == [second, third, None]
    assert not frontier


def test_what_waits_for_another_s_end_is_taken_only_after_a_pause():
    only = task(0)
    frontier = Frontier({only: []})
    assert frontier.take() == only
    frontier.wait_again(only)
    assert frontier
    assert frontier.take() is None
    frontier.resume()
    assert frontier.take() == only


def test_ten_thousand_subjects_are_taken_in_seconds():
    """A search through all that waits, each time, would take hours."""
    n = 10_000
    needs = {task(i): [task(i - n)] if i >= n else [] for i in range(5 * n)}
    needs[task(5 * n)] = [task(4 * n + i) for i in range(n)]
    frontier, began, count = Frontier(needs), time.process_time(), 0
    while (one := frontier.take()) is not None:
        frontier.settle(one)
        count += 1
    assert count == len(needs)
    assert time.process_time() - began < 10


def test_what_has_ended_comes_in_its_order_and_one_that_had_ended_before_is_not_missed():
    ended, jobs = Ended(), [futures.Future() for _ in range(3)]
    jobs[2].set_result(2)
    for one in jobs:
        ended.watch(one)
    assert ended
    jobs[1].set_result(1)
    jobs[0].set_exception(ValueError("0"))
    assert list(ended.take()) == [jobs[2], jobs[1], jobs[0]]
    assert not ended
