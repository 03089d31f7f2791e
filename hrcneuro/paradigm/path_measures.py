"""What the rules measure of the marked paths: each alone, and what would bind them to each other and to their place."""

from __future__ import annotations

from collections import Counter
from itertools import product

import pandas as pd
from scipy.stats import chi2_contingency, chisquare

from hrcneuro.paradigm.measures import chance
from hrcneuro.paradigm.paths import PAIRS, trace
from hrcneuro.paradigm.retrace import RetracedStudy


def misplaced_ends(study: RetracedStudy) -> float:
    """Return the number of episodes whose start and goal are none of the 20 pairs."""
    ends = zip(study.episodes["start"], study.episodes["goal"], strict=True)
    return sum(pair not in PAIRS for pair in ends)


def end_pairs(study: RetracedStudy) -> float:
    """Return how well chance explains the spread of start and goal over the 20 pairs."""
    ends = pd.Series(list(zip(study.episodes["start"], study.episodes["goal"], strict=True)))
    counts = ends.value_counts().to_dict()
    return chance(pd.Series([counts.get(pair, 0) for pair in PAIRS]))


def mean_distance(study: RetracedStudy) -> float:
    """Return the mean Manhattan distance from start to goal."""
    return study.episodes["distance"].mean()


def sd_distance(study: RetracedStudy) -> float:
    """Return its standard deviation."""
    return study.episodes["distance"].std()


def share_of(study: RetracedStudy, *, column: str, value: int) -> float:
    """Return the share of paths with a value: of their turns or steps."""
    return (study.episodes[column] == value).mean()


def odd_paths(study: RetracedStudy) -> float:
    """Return the number of paths that cross themselves, have another length or number of turns, or a wrong detour."""
    paths = study.episodes
    detour = paths["steps"] > paths["distance"]
    wrong = (paths["revisits"] > 0) | ~paths["steps"].isin([7, 8, 9]) | ~paths["turns"].isin([1, 2, 3])
    wrong |= detour & ((paths["steps"] != 9) | (paths["distance"] != 7) | (paths["turns"] < 2))
    return (wrong | (paths["border"] & ~detour)).sum()


# Splits of the axes that are walked in two legs


def odd_splits(study: RetracedStudy) -> float:
    """Return the number of splits that the experiment does not make."""
    return sum(not split.known for splits in study.episodes["splits"] for split in splits)


def split_share(study: RetracedStudy, *, ways: str, steps: int, first: int) -> float:
    """Return the share of a first leg among the splits of so many steps in these directions."""
    splits = [split for row in study.episodes["splits"] for split in row if split.way in ways and split.steps == steps]
    return sum(split.first == first for split in splits) / len(splits) if splits else float("nan")


# Paths beside each other


def spread_over_paths(study: RetracedStudy) -> float:
    """Return how well chance explains the spread over all 280 paths, were every choice equally likely and free."""
    expected = Counter(
        trace(*pair, turns=turns, first_axis=axis, picks=(down, along))
        for pair, turns, axis, down, along in product(PAIRS, (1, 2, 3), (0, 1), (0, 1), (0, 1))
    )
    counts = study.episodes["path"].value_counts().to_dict()
    known = pd.Series({path: counts.get(path, 0) for path in expected})
    shares = pd.Series(expected) / expected.total()
    return float(chisquare(known, shares * known.sum()).pvalue) if known.sum() else float("nan")


def distinct_paths(study: RetracedStudy) -> float:
    """Return the number of different paths."""
    return study.episodes["path"].nunique()


def single_paths(study: RetracedStudy) -> float:
    """Return the number of paths that occur once."""
    return (study.episodes["path"].value_counts() == 1).sum()


def independence(study: RetracedStudy, *, a: str, b: str) -> float:
    """Return how well chance explains the joint counts of two properties of the episodes (χ² of independence)."""
    table = pd.crosstab(study.episodes[a].map(str), study.episodes[b].map(str))
    return float(chi2_contingency(table).pvalue)


def joint_splits(study: RetracedStudy) -> float:
    """Return the same for the splits of both axes, where a path splits both: does one know of the other?"""
    both = [splits for splits in study.episodes["splits"] if len(splits) == 2]
    table = pd.crosstab([row.first == 2 for row, _ in both], [column.first == 2 for _, column in both])
    return float(chi2_contingency(table).pvalue) if both else float("nan")


def again_in_block(study: RetracedStudy) -> float:
    """Return the share of episodes whose path was walked before in their block."""
    return study.episodes.duplicated(["subject", "practice", "block", "path"]).mean()


def same_ends_again(study: RetracedStudy) -> float:
    """Return the share of episodes, first ones of a block aside, with the start and goal of the episode before."""
    last = _before(study)
    same = (study.episodes[["start", "goal"]] == last[["start", "goal"]]).all(axis=1)
    return same[last["goal"].notna()].mean()


def goal_is_next_start(study: RetracedStudy) -> float:
    """Return the share of episodes, first ones of a block aside, that start where the episode before ended."""
    last = _before(study)["goal"]
    return (study.episodes["start"] == last)[last.notna()].mean()


def _before(study: RetracedStudy) -> pd.DataFrame:
    """Return start and goal of the episode before in the block, missing for a block's first."""
    return study.episodes.groupby(["subject", "practice", "block"], sort=False)[["start", "goal"]].shift()
