"""A session's protocol, columns and size; the same seed gives the same table."""

import time

import numpy as np
import pandas as pd
import pytest

from hrcneuro.paradigm.session import SessionParams, simulate_session

COLUMNS = {
    "scenario", "practice", "block", "episode", "trial", "actor", "intended", "executed", "target", "error", "row",
    "col", "key_wrong", "onset_s", "case", "condition_before", "condition_after", "prev_error", "turn", "soa_s",
    "event", "t_f_s",
}  # fmt: skip


def session(params=None, seed=0):
    return simulate_session(params or SessionParams(), rng=np.random.default_rng(seed))


def test_the_studys_session_has_its_columns_blocks_and_episodes():
    trials = session()
    assert set(trials) == COLUMNS
    blocks = trials.groupby(["practice", "block"], sort=False).agg(
        scenario=("scenario", "unique"), episodes=("episode", "max")
    )
    assert list(blocks.index) == [(True, 1), (True, 2)] + [(False, n) for n in range(1, 13)]
    assert [s[0] for s in blocks["scenario"]] == ["iC", "sC"] * 7
    assert all(len(s) == 1 for s in blocks["scenario"])
    assert blocks["episodes"].tolist() == [5, 5] + [13] * 12
    assert (trials["event"] == "move").all()
    assert trials["executed"].isna().any()
    assert trials["executed"].map(lambda way: way is None or way in "NESW").all()


def test_a_small_session_for_the_smoke_study():
    trials = session(SessionParams(practice_episodes=1, blocks=2, episodes_per_block=3))
    assert trials[["practice", "block", "episode"]].drop_duplicates().shape[0] == 2 + 6
    assert not session(SessionParams(practice_episodes=0, blocks=1, episodes_per_block=1))["practice"].any()


def test_one_seed_gives_one_table_and_another_seed_another():
    pd.testing.assert_frame_equal(session(seed=3), session(seed=3))
    assert not session(seed=3)["actor"].equals(session(seed=4)["actor"])


def test_given_rates_replace_the_drawn_ones():
    assert not session(SessionParams(wrong_key_rate=0.0))["key_wrong"].any()
    assert not session(SessionParams(error_rate=0.0, practice_error_rate=0.0))["error"].any()


@pytest.mark.parametrize(("rate", "low", "high"), [(0.022, 0.015, 0.026), (0.2, 0.11, 0.17)])
def test_a_rate_of_wrong_keys_is_about_their_share_and_a_high_one_falls_short(rate, low, high):
    tables = [session(SessionParams(wrong_key_rate=rate, blocks=6), seed=seed) for seed in range(16)]
    keys = pd.concat(t.loc[t.actor == "human", "key_wrong"] for t in tables)
    assert low < keys.mean() < high


def test_a_subject_takes_less_than_half_a_second():
    def seconds():
        start = time.process_time()
        session()
        return time.process_time() - start

    assert min(seconds() for _ in range(3)) < 0.5


@pytest.mark.parametrize("column", ["practice", "error", "key_wrong", "prev_error", "turn"])
def test_flags_are_plain_booleans(column):
    assert session(SessionParams(1, 1, 1))[column].dtype == bool
