"""Every rule of the experiment on logs and simulations, and the checker itself on studies that break one."""

from collections import Counter
from dataclasses import replace
from itertools import accumulate, cycle

import numpy as np
import pandas as pd
import pytest

from hrcneuro.paradigm.conditions import annotate
from hrcneuro.paradigm.paths import count_turns, splits
from hrcneuro.paradigm.retrace import retrace
from hrcneuro.paradigm.rules import _joint_paths, _paths, check_rules
from hrcneuro.paradigm.session import SessionParams, simulate_session


def failed(tables):
    verdicts = check_rules(tables)
    return verdicts["rule"][~verdicts["ok"]].tolist()


def test_a_simulated_study_keeps_every_rule(study):
    verdicts = check_rules(study)
    assert list(verdicts) == ["rule", "measured", "target", "ok"]
    assert not verdicts[~verdicts["ok"]].to_dict("records")
    assert verdicts["rule"].is_unique
    assert len(verdicts) > 60


def test_the_published_logs_keep_every_rule(logs):
    verdicts = check_rules(logs)
    assert not verdicts[~verdicts["ok"]].to_dict("records")


def test_what_was_retraced_from_the_logs(logs):
    study = retrace(logs)
    paths = study.episodes
    assert (len(study.moves), len(paths), len(study.blocks)) == (27310, 1992, 168)
    assert paths["turns"].value_counts().to_dict() == {1: 678, 2: 661, 3: 653}
    assert paths["steps"].value_counts().to_dict() == {7: 1401, 8: 395, 9: 196}
    assert paths["border"].sum() == 95
    assert (paths["path"].nunique(), (paths["path"].value_counts() == 1).sum()) == (278, 12)
    splits = Counter((split.way, split.first) for row in paths["splits"] for split in row if split.steps == 3)
    south_east = {("S", 1): 95, ("S", 2): 84, ("E", 1): 116, ("E", 2): 92}
    assert splits == south_east | {("N", -1): 88, ("N", 2): 88, ("W", -1): 108, ("W", 2): 113}
    assert sorted(study.blocks["directions"].value_counts()) == [8, 11, 12, 16, 18, 19]
    owner, diagonal = study.moves["owner"], study.moves["target"].str.len() == 2
    assert owner[diagonal].value_counts().to_dict() == {"split": 1432, "human": 396, "robot": 304}


def changed(study, edit, *, subjects=12):
    """The study with an edit of a copy of each table."""
    tables = {}
    for subject, trials in list(study.items())[:subjects]:
        copy = trials.copy()
        tables[subject] = edited if (edited := edit(copy)) is not None else copy
    return {subject: annotate(trials) for subject, trials in tables.items()}


def swap(trials, column, where, values):
    trials.loc[trials.index[where.to_numpy().nonzero()[0][:1]], column] = values


def double_error(trials):
    swap(trials, "error", trials["prev_error"], True)


def other_actor_sc(trials):
    swap(trials, "actor", (trials["scenario"] == "sC") & (trials["actor"] == "human") & ~trials["practice"], "robot")


def other_actor_ic(trials):
    straight = (trials["scenario"] == "iC") & (trials["target"].str.len() == 1)
    swap(trials, "actor", straight & (trials["actor"] == "human"), "robot")


def other_target(trials):
    swap(trials, "target", trials["target"] == "N", "S")


def other_tile(trials):
    swap(trials, "row", (trials["row"] == 3) & (trials["trial"] > 2), 5)


def robot_elsewhere(trials):
    free = (trials["scenario"] == "sC") & (trials["actor"] == "robot") & (trials["target"] == "NE") & ~trials["error"]
    swap(trials, ["intended", "executed"], free, "E")


def wrong_first_key(trials):
    swap(trials, "key_wrong", (trials["trial"] == 0) & (trials["actor"] == "human"), True)


def scattered_wrong_keys(trials):
    keys = trials.index[(trials["actor"] == "human") & (trials["trial"] > 0)]
    count = int(trials["key_wrong"].sum())
    trials["key_wrong"] = trials.index.isin(keys[:: max(len(keys) // count, 1)])


def no_edge(trials):
    trials["executed"] = trials["executed"].where(trials["executed"].notna(), trials["intended"])


def late_onset(trials):
    trials["onset_s"] = trials["onset_s"] * 1.1


def same_onset(trials):
    trials.loc[trials.index[5], "onset_s"] = trials["onset_s"].iloc[6]


def slow_arm(trials):
    trials.loc[trials.index[5], "t_f_s"] = 1.3


@pytest.mark.parametrize(
    ("edit", "rule"),
    [
        (double_error, "errors right after an error"),
        (other_actor_sc, "sC: moves not by the owner of the tile"),
        (other_actor_ic, "iC: straight moves not by the owner of their direction"),
        (other_target, "targets that do not point to the pending tile"),
        (other_tile, "moves whose tile does not follow from their direction"),
        (robot_elsewhere, "free diagonals on which the robot leaves its fixed way"),
        (wrong_first_key, "wrong keys on an episode's first move"),
        (scattered_wrong_keys, "share of wrong keys that are not their episode's first"),
        (no_edge, "share of moves that the grid's edge stops"),
        (late_onset, "sC: onset to onset, mean (s)"),
        (same_onset, "onsets that do not come after the one before"),
        (slow_arm, "moves whose t_f is not in 0.6 … 1.2 s"),
    ],
)
def test_a_single_broken_move_is_seen(study, edit, rule):
    assert rule in failed(changed(study, edit, subjects=3))


def test_an_episode_without_its_end_is_seen(study):
    trials = study["s01"]
    astray = trials.index[(trials["error"] & ~trials["practice"])][-1]
    assert "episodes that do not end on the goal tile" in failed({"s01": annotate(trials.loc[:astray])})
    # Cut on a tile of the path, the path itself seems to end there, too near to the start.
    on_path = trials.index[trials["trial"] == 0][-1]
    assert "episodes whose start and goal are none of the 20 pairs" in failed({"s01": annotate(trials.loc[:on_path])})


@pytest.mark.parametrize(
    ("params", "rule"),
    [
        (SessionParams(error_rate=0.25), "error rate after no error, main blocks"),
        (SessionParams(wrong_key_rate=0.1), "share of wrong keys"),
        (SessionParams(undo_rate=0.5), "free diagonals on which the human takes an error back"),
    ],
)
def test_another_habit_is_seen(params, rule):
    tables = {f"s{i:02d}": simulate_session(params, rng=np.random.default_rng([5, i])) for i in range(4)}
    assert rule in failed(tables)


@pytest.fixture(scope="module")
def retraced(study):
    """The simulated study, retraced."""
    return retrace(study)


def broken_by(retraced, paths):
    """The rules of paths that the study breaks when its episodes have these paths."""
    episodes = retraced.episodes.assign(
        path=paths,
        start=[path[0] for path in paths],
        goal=[path[-1] for path in paths],
        turns=[count_turns(path) for path in paths],
        splits=[splits(path) for path in paths],
    )
    changed = replace(retraced, episodes=episodes)
    rules = [*_paths(), *_joint_paths()]
    return {rule.text for rule in rules if not rule.low <= rule.measure(changed) <= rule.high}


def test_the_way_of_a_split_matters(retraced):
    # Mirrored at the grid's centre every path keeps its turns, steps and border tiles, but leads the other way.
    mirrored = [tuple((6 - row, 6 - column) for row, column in path) for path in retraced.episodes["path"]]
    assert "splits of an axis that the experiment does not make" in broken_by(retraced, mirrored)


def test_turns_that_know_of_the_start_are_seen(retraced):
    paths = retraced.episodes["path"].tolist()
    straight = cycle(path for path in paths if count_turns(path) == 1 and path[0][0] > 3)
    broken = broken_by(retraced, [next(straight) if path[0][0] > 3 else path for path in paths])
    assert {"turns and start are independent (p)", "chance explains the spread over 280 paths (p)"} <= broken


def test_splits_that_know_of_each_other_are_seen(retraced):
    paths = retraced.episodes["path"].tolist()
    alike = cycle(path for path in paths if len({split.first == 2 for split in splits(path)}) == 1 < len(splits(path)))
    broken = broken_by(retraced, [path if count_turns(path) < 3 else next(alike) for path in paths])
    assert "the splits of both axes of a path are independent (p)" in broken


def test_paths_that_know_of_the_one_before_are_seen(retraced):
    paths = retraced.episodes["path"].tolist()
    twice = broken_by(retraced, [paths[number - number % 2] for number in range(len(paths))])
    assert "share of paths that were walked before in their block" in twice
    assert "share of episodes with the ends of the one before" in twice
    from_there = {start: cycle(path for path in paths if path[0] == start) for start in {path[0] for path in paths}}
    onward = list(accumulate(paths, lambda last, _: next(from_there[last[-1]])))
    assert "share of episodes that start on the last one's goal" in broken_by(retraced, onward)


def test_torn_areas_are_seen(study):
    trials = next(iter(study.values())).copy()
    block = (trials["scenario"] == "sC") & ~trials["practice"]
    # A stripe of the human's through the middle of the grid parts the robot's area.
    before = retrace({"s01": trials}).moves["before_row"].to_numpy()
    trials.loc[block, "actor"] = np.where(before[block] == 3, "human", "robot")
    assert "sC: areas in pieces or above 30 tiles" in failed({"s01": annotate(trials)})


def test_logs_without_times_are_not_asked_for_them(study):
    plain = {"s01": study["s01"].drop(columns=["onset_s", "t_f_s"]).assign(soa_s=np.nan)}
    assert not any("onset" in rule for rule in check_rules(plain)["rule"])
    assert isinstance(check_rules(plain), pd.DataFrame)
