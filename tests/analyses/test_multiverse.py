"""Universes, the pairs that differ in one choice, and what is told of them."""

import itertools
import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.analyses import multiverse as many

SIZES = st.dictionaries(st.sampled_from("abcde"), st.integers(2, 4), max_size=3)


def named(sizes):
    return {name: [f"{name}{i}" for i in range(n)] for name, n in sizes.items()}


@given(SIZES, SIZES)
def test_all_combinations_of_the_crossed_then_each_other_value_alone(crossed, alone):
    alone = {name.upper(): n for name, n in alone.items()}
    every = many.universes(named(crossed), named(alone))
    assert len(every) == math.prod(crossed.values()) + sum(n - 1 for n in alone.values())
    assert len({tuple(sorted(one.items())) for one in every}) == len(every)
    study = {name: values[0] for name, values in (named(crossed) | named(alone)).items()}
    assert every[0] == study
    for one in every:
        differ = many.differing(one, study)
        assert set(differ) <= set(crossed) or (len(differ) == 1 and set(differ) <= set(alone))


@given(SIZES, SIZES)
def test_pairs_differ_in_their_choice_alone(crossed, alone):
    every = many.universes(named(crossed), named({name.upper(): n for name, n in alone.items()}))
    found = many.pairs(every)
    for one, other in itertools.combinations(range(len(every)), 2):
        differ = list(many.differing(every[one], every[other]))
        for name, places in found.items():
            assert ((one, other) in places) == (differ == [name])


def planted(every, value, threshold):
    """Return verdicts of two findings: one fits from a threshold on, the other has no number and always fits."""
    rows = []
    for place, one in enumerate(every):
        number = value(one)
        rows.append((place, place, "number", number, many.FITS if number >= threshold else many.DIFFERS))
        rows.append((place, place, "word", math.nan, many.FITS))
    return pd.DataFrame(rows, columns=["universe", "analysis", "finding", "value", "fits"])


EVERY = many.universes({"filter": ["zero", "causal", "low"], "lambda": ["0.9", "0.5"]}, {"baseline": ["200", "100"]})
SHIFT = {"zero": 0.0, "causal": 3.0, "low": 1.0, "0.9": 0.0, "0.5": 10.0, "200": 0.0, "100": 0.25}


@pytest.fixture
def verdicts():
    return planted(EVERY, lambda one: sum(SHIFT[value] for value in one.values()), threshold=2.0)


def test_what_is_added_by_a_choice_is_what_it_moves(verdicts):
    moved = many.influence(verdicts, EVERY).set_index(["finding", "choice"])
    assert dict(moved.loc[("number", "filter")]) == pytest.approx(
        {"pairs": 6, "flips": 2 / 6, "moved": (3 + 1 + 2) / 3, "most": 3.0}
    )
    assert dict(moved.loc[("number", "lambda")]) == pytest.approx(
        {"pairs": 3, "flips": 2 / 3, "moved": 10.0, "most": 10.0}
    )
    assert dict(moved.loc[("number", "baseline")]) == pytest.approx(
        {"pairs": 1, "flips": 0.0, "moved": 0.25, "most": 0.25}
    )
    assert (moved.loc["word", "flips"] == 0).all()
    assert moved.loc["word", "moved"].isna().all()


def test_what_holds_is_counted_and_the_choice_that_turns_it_most_is_named(verdicts):
    held = many.held(verdicts, many.influence(verdicts, EVERY)).set_index("finding")
    number, word = held.loc["number"], held.loc["word"]
    assert (number["study"], number["fits"], number["differs"], number["open"]) == (many.DIFFERS, 4, 3, 0)
    assert number["share"] == pytest.approx(4 / 7)
    assert (number["value"], number["low"], number["high"], number["choice"]) == (0.0, 0.0, 13.0, "lambda")
    assert (word["fits"], word["share"], word["choice"]) == (7, 1.0, "")
    assert math.isnan(word["low"])


def test_a_universe_that_is_missing_or_cannot_tell_is_in_no_share(verdicts):
    some = verdicts[verdicts["universe"] != 5].copy()
    some.loc[(some["universe"] == 1) & (some["finding"] == "number"), "fits"] = many.OPEN
    moved = many.influence(some, EVERY).set_index(["finding", "choice"])
    held = many.held(some, many.influence(some, EVERY)).set_index("finding")
    number = held.loc["number"]
    assert (number["fits"], number["differs"], number["open"]) == (2, 3, 1)
    assert number["share"] == pytest.approx(2 / 5)
    # Two of three pairs of lambda are there, and one of them can be told.
    assert moved.loc[("number", "lambda"), "pairs"] == 2
    assert moved.loc[("number", "lambda"), "flips"] == 0.0


def test_the_order_of_universes_moves_nothing(verdicts):
    order = np.random.default_rng(0).permutation(len(EVERY))
    back = {int(old): new for new, old in enumerate(order)}
    places = verdicts["universe"].map(back)
    shuffled = verdicts.assign(universe=places, analysis=places).sample(frac=1, random_state=1)
    one = many.influence(verdicts, EVERY).set_index(["finding", "choice"]).sort_index()
    other = many.influence(shuffled, [EVERY[i] for i in order]).set_index(["finding", "choice"]).sort_index()
    pd.testing.assert_frame_equal(one, other)


def test_universes_that_do_the_same_for_a_finding_count_once(verdicts):
    """Here what the filter does comes after the finding; the baseline reaches it, the lambda does too."""
    first = {}
    same = [first.setdefault((one["lambda"], one["baseline"]), place) for place, one in enumerate(EVERY)]
    copies = planted(EVERY, lambda one: SHIFT[one["lambda"]] + SHIFT[one["baseline"]], threshold=2.0)
    copies = copies.assign(analysis=copies["universe"].map(dict(enumerate(same))))
    moved = many.influence(copies, EVERY).set_index(["finding", "choice"])
    assert dict(moved.loc[("number", slice(None)), "pairs"].droplevel(0)) == {"filter": 0, "lambda": 1, "baseline": 1}
    assert math.isnan(moved.loc[("number", "filter"), "flips"])
    held = many.held(copies, many.influence(copies, EVERY)).set_index("finding")
    counts = held.loc["number", ["analyses", "fits", "differs", "open"]].tolist()
    assert counts == [3, 1, 2, 0]
    assert held.loc["number", "share"] == pytest.approx(1 / 3)
    # Each universe for itself: the copies of the study's own would weigh six times.
    alone = many.held(verdicts, many.influence(verdicts, EVERY)).set_index("finding")
    assert (alone["analyses"] == len(EVERY)).all()
