"""Every rule of the experiment as one line: what is measured, and within which limits a study of 12 subjects must lie.

The same list judges the published logs and a simulation. What the paradigm enforces is never broken: limits 0, 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import chain

import pandas as pd

from hrcneuro import published
from hrcneuro.paradigm import measures as m
from hrcneuro.paradigm import path_measures as paths
from hrcneuro.paradigm.retrace import RetracedStudy, retrace

PAIR_COUNTS = {
    "sC": {"HH": (335, 39), "HR": (62, 8), "RR": (295, 29), "RH": (59, 7)},
    "iC": {"HH": (276, 33), "HR": (87, 11), "RR": (236, 28), "RH": (153, 18)},
}
"""Mean and standard deviation over the logged subjects (s07 left out) of the pairs that count."""

AFTER_ERROR = {
    "sC": {"HH": 0.34, "HR": 0.23, "RR": 0.33, "RH": 0.29},
    "iC": {"HH": 0.27, "HR": 0.03, "RR": 0.26, "RH": 0.68},
}
"""Share of the pairs' tr−1 that follow an error, in the logs."""

LEAST_CHANCE = 0.0001
"""Least probability at which chance still explains a spread: 0.001 for all ten or so rules of the kind together."""


@dataclass(frozen=True)
class Rule:
    """A line of the table: its wording, the inclusive limits, and how it is measured."""

    text: str
    low: float
    high: float
    measure: Callable[[RetracedStudy], float]


def check_rules(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return one row a rule: rule, measured, target (its limits in words) and ok.

    The limits leave room for chance in 12 subjects with sessions of the study's length; fewer or shorter ones may miss
    a statistical rule without breaking it. Rules of timing are left out where a table has no onsets.

    Args:
        tables: Subject -> trial table as :func:`hrcneuro.paradigm.conditions.annotate` returns it.
    """
    study = retrace(tables)
    timed = {"onset_s", "t_f_s"} <= set(study.moves) and bool(study.moves["onset_s"].notna().all())
    rows = []
    rules = (_errors, _responsibility, _keys, _paths, _joint_paths, _episodes, _pairs, *([_timing] if timed else []))
    for rule in chain.from_iterable(part() for part in rules):
        measured = float(rule.measure(study))
        ok = rule.low - 1e-9 <= measured <= rule.high + 1e-9
        rows.append({"rule": rule.text, "measured": measured, "target": _limits(rule), "ok": ok})
    return pd.DataFrame(rows)


def _limits(rule: Rule) -> str:
    return f"{rule.low:g}" if rule.low == rule.high else f"{rule.low:.4g} … {rule.high:.4g}"


def _near(text: str, target: float, tolerance: float, measure: Callable[[RetracedStudy], float]) -> Rule:
    return Rule(text, target - tolerance, target + tolerance, measure)


def _by_chance(text: str, measure: Callable[[RetracedStudy], float]) -> Rule:
    return Rule(text, LEAST_CHANCE, 1, measure)


def _never(text: str, measure: Callable[[RetracedStudy], float]) -> Rule:
    return Rule(text, 0, 0, measure)


def _errors() -> Iterator[Rule]:
    yield _never("errors right after an error", m.errors_in_a_row)
    yield _near("error rate after no error, main blocks", published.ERROR_SHARE.value, 0.014, m.error_rate)
    for column, value in (("actor", "human"), ("actor", "robot"), ("scenario", "sC"), ("scenario", "iC")):
        yield _near(
            f"the same, {column} {value}",
            published.ERROR_SHARE.value,
            0.025,
            partial(m.error_rate, column=column, value=value),
        )
    yield _near("the same, straight target", published.ERROR_SHARE.value, 0.025, partial(m.error_rate, diagonal=False))
    yield _near("the same, diagonal target", published.ERROR_SHARE.value, 0.14, partial(m.error_rate, diagonal=True))
    yield _near("share of errors, main blocks: p / (1 + p)", 0.23, 0.01, lambda s: m.main_moves(s)["error"].mean())
    yield _near("error rate after no error, practice blocks", 0.219, 0.04, partial(m.error_rate, practice=True))
    for way in ("left", "opposite", "right"):
        yield _near(f"share of errors that go {way}", 1 / 3, 0.025, partial(m.slip_share, way=way))
    yield _never("moves whose tile does not follow from their direction", m.jumps)
    yield _never("errors that went as intended, or others that did not", m.undue_moves)


def _responsibility() -> Iterator[Rule]:
    yield _never("targets that do not point to the pending tile", m.off_path)
    yield _never("iC: straight moves not by the owner of their direction", partial(m.conflicts, scenario="iC"))
    yield _never("iC: diagonals not by their owner, or split and not the robot's way", m.diagonal_exceptions)
    yield _by_chance("iC: chance explains the spread over six pairs of directions (p)", m.direction_pairs)
    yield _never("sC: moves not by the owner of the tile", partial(m.conflicts, scenario="sC"))
    yield _never("sC: areas in pieces or above 30 tiles", m.areas_too_large)
    yield _never("free diagonals on which the robot leaves its fixed way", m.robot_exceptions)


def _keys() -> Iterator[Rule]:
    yield _near("free diagonals on which the human goes north or south", 0.5, 0.06, m.vertical_share)
    yield _near("free diagonals on which the human takes an error back", 0.82, 0.2, m.undo_share)
    yield _near("share of wrong keys", 0.025, 0.015, m.wrong_keys)
    yield Rule("largest share of wrong keys of a subject", 0.01, 0.09, m.most_wrong_keys)
    yield _near("share of wrong keys that are not their episode's first", 0.66, 0.16, m.later_wrong_keys)
    yield _never("wrong keys on an episode's first move", m.wrong_first_keys)
    yield _never("iC: keys of the robot's directions", m.foreign_keys)


def _paths() -> Iterator[Rule]:
    yield _never("episodes whose start and goal are none of the 20 pairs", paths.misplaced_ends)
    yield _by_chance("chance explains the spread over 20 pairs of start and goal (p)", paths.end_pairs)
    yield _near("distance from start to goal, mean", 7.20, 0.04, paths.mean_distance)
    yield _near("distance from start to goal, SD", 0.40, 0.03, paths.sd_distance)
    for turns in (1, 2, 3):
        share = partial(paths.share_of, column="turns", value=turns)
        yield _near(f"share of paths with {turns} turn{'s' * (turns > 1)}", 1 / 3, 0.045, share)
    for steps, target in {7: 0.70, 8: 0.20, 9: 0.10}.items():
        yield _near(
            f"share of paths of {steps} steps", target, 0.04, partial(paths.share_of, column="steps", value=steps)
        )
    yield _never("paths that cross themselves, or with a wrong detour", paths.odd_paths)
    yield _never("splits of an axis that the experiment does not make", paths.odd_splits)
    for text, ways, steps, first in (
        ("three steps south or east that are 1 + 2", "SE", 3, 1),
        ("three steps north or west that are −1 + 4", "NW", 3, -1),
        ("four steps that are 3 + 1", "NESW", 4, 3),
    ):
        share = partial(paths.split_share, ways=ways, steps=steps, first=first)
        yield _near(f"share of splits of {text}", 1 / 2, 0.09, share)


def _joint_paths() -> Iterator[Rule]:
    yield _near("different paths of a study", 277, 5, paths.distinct_paths)
    yield _near("paths that occur once", 11, 10, paths.single_paths)
    yield _by_chance("chance explains the spread over 280 paths (p)", paths.spread_over_paths)
    yield _by_chance("the splits of both axes of a path are independent (p)", paths.joint_splits)
    for a, b, text in (
        ("turns", "start", "turns and start"),
        ("first_axis", "turns", "axis of the first leg and turns"),
        ("first_axis", "start", "axis of the first leg and start"),
        ("turns", "scenario", "turns and scenario"),
        ("start", "scenario", "start and scenario"),
        ("turns", "subject", "turns and subject"),
        ("start", "subject", "start and subject"),
    ):
        yield _by_chance(f"{text} are independent (p)", partial(paths.independence, a=a, b=b))
    yield _near("share of paths that were walked before in their block", 0.027, 0.015, paths.again_in_block)
    yield _near("share of episodes with the ends of the one before", 1 / 20, 0.02, paths.same_ends_again)
    yield _near("share of episodes that start on the last one's goal", 0.11, 0.03, paths.goal_is_next_start)


def _episodes() -> Iterator[Rule]:
    yield _never("episodes that do not end on the goal tile", m.not_arrived)
    yield _near("moves of an episode, mean", 13.8, 0.6, m.moves_per_episode)
    yield _near("moves of an episode, SD", 5.2, 1.0, m.sd_moves_per_episode)
    yield Rule("moves of the shortest episode", 7, 8, m.fewest_moves)
    yield _near("share of moves that the grid's edge stops", 0.0038, 0.0016, m.clamped_share)
    yield _near("share of moves that end on the border ring", 0.095, 0.025, m.border_share)


def _pairs() -> Iterator[Rule]:
    for scenario, cases in PAIR_COUNTS.items():
        for case, (mean, sd) in cases.items():
            measure = partial(m.pairs, scenario=scenario, case=case)
            yield _near(f"{scenario}: pairs {case} a subject, within one SD", mean, sd, measure)
    for scenario, shares in AFTER_ERROR.items():
        for case, share in shares.items():
            measure = partial(m.after_error, scenario=scenario, case=case)
            text = f"{scenario}: share of {case} that follow an error"
            yield Rule(text, max(share - 0.06, 0.0), share + 0.06, measure)


def _timing() -> Iterator[Rule]:
    for scenario, printed in published.SOA_MS.items():
        mean, sd = (value / 1000 for value in printed.value)
        yield _near(f"{scenario}: onset to onset, mean (s)", mean, 0.020, partial(m.mean_soa, scenario=scenario))
        yield _near(f"{scenario}: onset to onset, SD (s)", sd, 0.020, partial(m.sd_soa, scenario=scenario))
    yield Rule("shortest onset to onset (s)", 0.6, 0.7, m.least_soa)
    yield _never("moves whose t_f is not in 0.6 … 1.2 s", m.travel_outside)
    yield _never("onsets that do not come after the one before", m.onsets_out_of_order)
