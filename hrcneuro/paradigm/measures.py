"""What the rules measure: each function takes a retraced study and returns one number, or the counts of a spread."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.stats import chisquare

from hrcneuro.paradigm.conditions import EPISODE, count_pairs
from hrcneuro.paradigm.design import T_F_S
from hrcneuro.paradigm.grid import INNER, OPPOSITE, STEPS
from hrcneuro.paradigm.owners import DIRECTION_PAIRS
from hrcneuro.paradigm.partners import ROBOT_CHOICE
from hrcneuro.paradigm.retrace import RetracedStudy


def main_moves(study: RetracedStudy) -> pd.DataFrame:
    """Return the moves of the main blocks."""
    return study.moves[~study.moves["practice"]]


def chance(counts: pd.Series) -> float:
    """Return the probability (χ²) that equally likely outcomes give counts as uneven as these."""
    return float(chisquare(counts.to_numpy()).pvalue)


# Errors


def errors_in_a_row(study: RetracedStudy) -> float:
    """Return the number of errors right after an error."""
    return (study.moves["error"] & study.moves["prev_error"]).sum()


def error_rate(
    study: RetracedStudy, *, practice: bool = False, column: str = "", value: str = "", diagonal: bool | None = None
) -> float:
    """Return the share of errors among moves that follow none, of all or of those with a value, in main blocks."""
    moves = study.moves[(study.moves["practice"] == practice) & ~study.moves["prev_error"]]
    if column:
        moves = moves[moves[column] == value]
    if diagonal is not None:
        moves = moves[_diagonal(moves) == diagonal]
    return moves["error"].mean()


def slip_share(study: RetracedStudy, *, way: str) -> float:
    """Return the share of errors that went ``left``, ``opposite`` or ``right`` of the intended direction."""
    return (study.moves["slip"].dropna() == way).mean()


def jumps(study: RetracedStudy) -> float:
    """Return the number of moves whose tile does not follow from the executed direction."""
    return study.moves["jump"].sum()


def undue_moves(study: RetracedStudy) -> float:
    """Return the number of moves that went as intended though logged as errors, or elsewhere though logged as none."""
    moves = study.moves[study.moves["executed"].notna()]
    return ((moves["executed"] == moves["intended"]) == moves["error"]).sum()


# Responsibility


def off_path(study: RetracedStudy) -> float:
    """Return the number of targets that do not point to the path's pending tile."""
    return study.moves["off_path"].sum()


def conflicts(study: RetracedStudy, *, scenario: str) -> float:
    """Return the number of moves that contradict the owners of their block."""
    blocks = study.blocks[study.blocks["scenario"] == scenario]
    return blocks["conflicts"].sum()


def direction_pairs(study: RetracedStudy) -> float:
    """Return how well chance explains the spread of the human's directions over the six pairs."""
    names = ["".join(way for way in STEPS if way in pair) for pair in DIRECTION_PAIRS]
    return chance(study.blocks["directions"].value_counts().reindex(names, fill_value=0))


def diagonal_exceptions(study: RetracedStudy) -> float:
    """Return the number of iC's diagonals on which not the owner acted, or the robot left its own component."""
    moves = study.moves[_diagonal(study.moves) & study.moves["owner"].notna()]
    actor = moves["owner"].replace("split", "robot")
    return (moves["actor"] != actor).sum() + _left_own(moves[moves["owner"] == "split"], study)


def _left_own(moves: pd.DataFrame, study: RetracedStudy) -> int:
    plans = zip(moves["intended"], moves["target"], _human_directions(moves, study), strict=True)
    return sum(plan not in target or plan in directions for plan, target, directions in plans)


def _human_directions(moves: pd.DataFrame, study: RetracedStudy) -> list[str]:
    """Return the human's two directions in the block of each move, ``""`` where the block does not show them."""
    keys = ["subject", "practice", "block"]
    known = moves[keys].merge(study.blocks[[*keys, "directions"]], on=keys, how="left")["directions"]
    return known.fillna("").tolist()


def foreign_keys(study: RetracedStudy) -> float:
    """Return the number of keys in iC that command one of the robot's directions."""
    moves = study.moves[(study.moves["actor"] == "human") & (study.moves["scenario"] == "iC")]
    keys = zip(moves["intended"], _human_directions(moves, study), strict=True)
    return sum(directions != "" and key not in directions for key, directions in keys)


def areas_too_large(study: RetracedStudy) -> float:
    """Return the number of sC's areas that are not in one piece or have more than 30 tiles, as far as entered."""
    blocks = study.blocks[study.blocks["scenario"] == "sC"]
    return (blocks["torn"] | (blocks[["human_tiles", "robot_tiles"]].max(axis=1) > 30)).sum()


def robot_exceptions(study: RetracedStudy) -> float:
    """Return the number of free diagonals on which the robot did not go its fixed way."""
    moves = _free_diagonals(study, "robot")
    moves = moves[~moves["error"]]
    return (moves["executed"] != moves["target"].map(ROBOT_CHOICE)).sum()


def vertical_share(study: RetracedStudy) -> float:
    """Return the share of free diagonals on which the human went north or south first."""
    moves = _free_diagonals(study, "human")
    return moves["intended"][~moves["key_wrong"]].isin(["N", "S"]).mean()


def undo_share(study: RetracedStudy) -> float:
    """Return the share of the human's right keys on free diagonals that take back the error just made, if one can."""
    before = study.moves.groupby(["subject", *EPISODE], sort=False)["executed"].shift()
    moves = _free_diagonals(study, "human")
    back = before.map(OPPOSITE)[moves.index]
    keys = zip(back, moves["target"], moves["intended"], moves["prev_error"] & ~moves["key_wrong"], strict=True)
    undone = [key == way for way, target, key, counts in keys if counts and isinstance(way, str) and way in target]
    return float(np.mean(undone)) if undone else float("nan")


def _free_diagonals(study: RetracedStudy, actor: str) -> pd.DataFrame:
    moves = study.moves
    free = (moves["scenario"] == "sC") | (moves["owner"] == actor)
    return moves[_diagonal(moves) & free & (moves["actor"] == actor)]


def wrong_keys(study: RetracedStudy) -> float:
    """Return the share of the human's keys outside the target direction, over all subjects."""
    return study.moves["key_wrong"][study.moves["actor"] == "human"].mean()


def most_wrong_keys(study: RetracedStudy) -> float:
    """Return the largest such share of a subject."""
    human = study.moves[study.moves["actor"] == "human"]
    return human.groupby("subject")["key_wrong"].mean().max()


def wrong_first_keys(study: RetracedStudy) -> float:
    """Return the number of wrong keys on an episode's first move."""
    return (study.moves["key_wrong"] & (study.moves["trial"] == 0)).sum()


def later_wrong_keys(study: RetracedStudy) -> float:
    """Return the share of wrong keys that are not their episode's first: they come in runs, in a few episodes."""
    wrong = study.moves[study.moves["key_wrong"]]
    return wrong.duplicated(["subject", *EPISODE]).mean()


def _diagonal(moves: pd.DataFrame) -> pd.Series:
    return moves["target"].str.len() == 2


# Episodes


def not_arrived(study: RetracedStudy) -> float:
    """Return the number of episodes that end elsewhere than on the last tile that their targets show."""
    return (~study.episodes["arrived"]).sum()


def moves_per_episode(study: RetracedStudy) -> float:
    """Return the mean number of moves of a main episode."""
    return study.episodes["moves"][~study.episodes["practice"]].mean()


def sd_moves_per_episode(study: RetracedStudy) -> float:
    """Return its standard deviation."""
    return study.episodes["moves"][~study.episodes["practice"]].std()


def fewest_moves(study: RetracedStudy) -> float:
    """Return the number of moves of the shortest episode."""
    return study.episodes["moves"].min()


def clamped_share(study: RetracedStudy) -> float:
    """Return the share of moves that the grid's edge stopped."""
    return study.moves["executed"].isna().mean()


def border_share(study: RetracedStudy) -> float:
    """Return the share of moves that end on the border ring."""
    return 1 - (study.moves["row"].isin(INNER) & study.moves["col"].isin(INNER)).mean()


# Pairs and times


def pairs(study: RetracedStudy, *, scenario: str, case: str) -> float:
    """Return the mean number a subject of pairs that count."""
    return int(count_pairs(study.moves)[case].to_dict()[scenario]) / study.subjects


def after_error(study: RetracedStudy, *, scenario: str, case: str) -> float:
    """Return the share of a case's tr−1 that follow an error."""
    moves = study.moves
    return moves["prev_error"][(moves["scenario"] == scenario) & (moves["condition_before"] == case)].mean()


def _soa(study: RetracedStudy, scenario: str) -> pd.Series:
    moves = main_moves(study)
    return moves["soa_s"][moves["scenario"] == scenario].dropna()


def mean_soa(study: RetracedStudy, *, scenario: str) -> float:
    """Return the mean time from onset to onset within an episode, in seconds."""
    return _soa(study, scenario).mean()


def sd_soa(study: RetracedStudy, *, scenario: str) -> float:
    """Return its standard deviation over all moves of all subjects."""
    return _soa(study, scenario).std()


def least_soa(study: RetracedStudy) -> float:
    """Return the shortest time from onset to onset."""
    return study.moves["soa_s"].min()


def travel_outside(study: RetracedStudy) -> float:
    """Return the number of moves whose t_f lies outside 0.6 to 1.2 s."""
    return (~study.moves["t_f_s"].between(*T_F_S)).sum()


def onsets_out_of_order(study: RetracedStudy) -> float:
    """Return the number of onsets that do not come after the one before."""
    onset = study.moves["onset_s"].to_numpy(dtype=float)
    same = study.moves["subject"].to_numpy()
    return int(((np.diff(onset) <= 0) & (same[1:] == same[:-1])).sum())
