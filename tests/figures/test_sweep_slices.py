"""Which points of a sweep enter which panel."""

import itertools

import pandas as pd

from hrcneuro.figures.sweep import slices

USUAL = {"events": 10, "subtasks": 4, "chosen": 2, "alpha": 0.05, "tau": 0.1, "period": 0}


def table(**axes):
    """Return the points of a full grid; m keeps its half of n unless it is an axis."""
    every = {**{name: (value,) for name, value in USUAL.items()}, "accuracy": (55.0, 80.0), **axes}
    points = pd.DataFrame(list(itertools.product(*every.values())), columns=list(every))
    return points if "chosen" in axes else points.assign(chosen=points["subtasks"] // 2)


def test_a_panel_an_axis_that_varies_with_the_others_at_their_usual_value():
    found = dict(slices(table(alpha=(0.05, 0.2), tau=(0.1, 0.3)), USUAL, ("accuracy", "alpha", "tau")))
    assert set(found) == {"alpha", "tau"}
    assert set(found["alpha"]["tau"]) == {0.1}
    assert set(found["tau"]["alpha"]) == {0.05}


def test_the_nearest_value_stands_for_a_usual_one_that_is_not_there():
    found = dict(slices(table(alpha=(0.08, 0.2), tau=(0.1, 0.3)), USUAL, ("accuracy", "alpha", "tau")))
    assert set(found["tau"]["alpha"]) == {0.08}


def test_m_follows_n_and_is_an_axis_only_where_the_sweep_names_it():
    both = table(subtasks=(4, 6), chosen=(1, 2, 3))
    assert [axis for axis, _ in slices(table(subtasks=(4, 6)), USUAL, ("accuracy", "subtasks"))] == ["subtasks"]
    found = dict(slices(both, USUAL, ("accuracy", "subtasks", "chosen")))
    assert set(found) == {"subtasks", "chosen"}
    assert set(zip(found["subtasks"]["subtasks"], found["subtasks"]["chosen"], strict=True)) == {(4, 2), (6, 3)}
    assert set(found["chosen"]["subtasks"]) == {4}
