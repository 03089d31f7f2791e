"""Closed blocks from the lines of their logs: steps, episodes, and the same numbers as where they were simulated."""

import json

import numpy as np
import pandas as pd
import pytest

from hrcneuro.analyses.loop_rows import loop_tables
from hrcneuro.analyses.loop_sessions import STAGES, causes, deadlines, latencies, loop_sessions
from hrcneuro.io.tables import read_table, write_table
from hrcneuro.learning import loop_scores
from hrcneuro.learning.loop import STEPS
from hrcneuro.learning.loop_decoders import anticipation
from hrcneuro.learning.rates import Rates
from hrcneuro.paradigm.params import ClosedParams
from hrcneuro.paradigm.partners import Human
from hrcneuro.tables.loop import LOOP_EPISODES, LOOP_STEPS
from tests.helpers.loop_lines import PlayedLogs, moves_of

PARAMS = ClosedParams(blocks=2, episodes_per_block=4)


SEVENTY = anticipation(Rates.level(70))


def played(seed=0, **how):
    return PlayedLogs(SEVENTY, PARAMS, rng=np.random.default_rng(seed), **how)


def joined(parts):
    return [pd.concat(tables) for tables in zip(*parts, strict=True)]


def tables_of(logs, session="a"):
    return loop_tables(logs.experiment, logs.decisions, subject="s01", session=session)


@pytest.fixture(scope="module")
def logs():
    return played(late=0.1, human=Human(wrong_key=0.3))


@pytest.fixture(scope="module")
def tables(logs):
    return tables_of(logs)


def test_the_tables_are_as_declared_and_come_back(tables, tmp_path):
    for data, table in zip(tables, (LOOP_STEPS, LOOP_EPISODES), strict=True):
        write_table(data, tmp_path / "table.parquet", table)
        assert len(read_table(tmp_path / "table.parquet")) == len(data) > 0


def test_every_step_stands_with_its_move_and_with_the_decision_before(logs, tables):
    steps, _ = tables
    moves = list(moves_of(logs.experiment))
    assert steps["actor"].tolist() == [move["actor"] for move in moves]
    first = steps["trial"] == 0
    assert (
        steps.loc[first, ["before", "predicted", "score", "in_time_for_tr", "onset_to_sent_ms"]].isna().all(axis=None)
    )
    assert (steps.loc[~first, "before"] == steps["actor"].shift()[~first]).all()
    assert (steps.loc[~first, "score"].notna()).all()
    diagonal = steps["step"].str.len() == 2
    assert diagonal.any()
    assert (steps.loc[diagonal & ~first, "cause"].isin(["diagonal", "late"])).all()
    assert steps.loc[diagonal, ["drawn", "expected_case"]].isna().all(axis=None)
    straight = steps[~first & ~diagonal]
    letters = straight["before"].str[0].str.upper() + straight["owner"].str[0].str.upper()
    assert (straight["expected_case"] == letters).all()


def test_times_are_from_the_onset_of_the_move_before(tables):
    steps, _ = tables
    times = np.array([[*one] for one in steps[[f"onset_to_{name}_ms" for name in STAGES]].dropna().to_numpy(float)])
    assert (np.diff(times, axis=1) > 0).all()
    np.testing.assert_allclose(times[:, 3] - times[:, 2], 2.0, atol=1e-6)
    assert {name: len(values) for name, values in latencies(steps).items()} == dict.fromkeys(STAGES, len(times))


def test_episodes_hold_what_was_learned_when_they_ended(logs, tables):
    _, episodes = tables
    assert episodes["number"].tolist() == list(range(1, 9))
    assert episodes["arrived"].all()
    assert (
        episodes["updates"].iloc[-1] == logs.learner.updates == sum(one.get("update", False) for one in logs.decisions)
    )
    assert dict(logs.learner.policy()) == {s: episodes[f"human_{s}"].iloc[-1] for s in "NESW"}
    owned = {s for s in "NESW" if episodes[f"owner_{s}"].iloc[0] == "human"}
    assert owned == set(logs.experiment[1]["human_directions"])


def test_counts_of_deadlines_and_causes_add_up(tables):
    steps, _ = tables
    counted, why = deadlines(steps), causes(steps)
    after = int(steps["before"].notna().sum())
    assert counted["update"][0] + sum(why.values()) == after == counted["decided"][1]
    assert counted["deadline_met"][0] == after - why["late"]
    assert set(why) == {"late", "diagonal"}


def test_sessions_of_tables_are_those_that_were_played():
    both = [played(seed) for seed in (1, 2)]
    sessions = loop_sessions(*joined([tables_of(one, str(k)) for k, one in enumerate(both)]))
    assert sessions.policies.shape == (2, 8, 4)
    for k, one in enumerate(both):
        assert sessions.policies[k, -1].tolist() == list(one.learner.policy().values())
        assert sessions.updates[k, -1] == one.learner.updates == sessions.decisions[k].sum()
        moves = list(moves_of(one.experiment))
        assert sessions.steps[k].sum() == len(moves)
        human = sessions.steps[k][:, STEPS.index("human")].sum()
        assert human == sum(move["actor"] == "human" for move in moves)
    assert loop_scores.pooled_rates(sessions).tnr_hh == pytest.approx(70, abs=20)


def test_a_session_that_was_broken_off_is_as_long_as_it_is():
    whole, cut = played(1), played(2)
    end = next(k for k, line in enumerate(cut.experiment) if line["kind"] == "choice" and line["episode"] == 3)
    short = loop_tables(cut.experiment[: end + 1], cut.decisions, subject="s01", session="b")
    assert short[1]["arrived"].tolist() == [True, True, False]
    sessions = loop_sessions(*joined([tables_of(whole), short]))
    curve = loop_scores.accuracy(sessions)
    assert np.isfinite(curve[0]).all()
    assert np.isfinite(curve[1]).tolist() == [True] * 3 + [False] * 5


def test_a_step_that_was_never_made_does_not_count():
    logs = played()
    lines = list(logs.experiment)
    last = max(at for at, line in enumerate(lines) if line["kind"] == "move")
    whole, _ = tables_of(logs)
    cut, _ = loop_tables(lines[:last] + lines[last + 1 :], logs.decisions, subject="s01", session="a")
    pd.testing.assert_frame_equal(cut, whole.iloc[:-1])


def test_lines_go_through_json_and_what_tells_of_nothing_here_is_passed_over():
    logs = played(3)
    noise = [{"kind": "note", "s": 0, "text": "x"}, {"kind": "move", "practice": True, "block": 1}]
    again = [json.loads(json.dumps(line)) for line in logs.experiment]
    steps, episodes = loop_tables(noise + again, logs.decisions, subject="s01", session="a")
    expected = tables_of(logs)
    assert steps.equals(expected[0])
    assert episodes.equals(expected[1])


def test_without_decisions_nothing_is_known_and_nothing_was_learned():
    steps, episodes = loop_tables(played(4).experiment, [], subject="s01", session="a")
    assert steps["predicted"].isna().all()
    assert (episodes[[f"human_{s}" for s in "NESW"]] == 0.5).all(axis=None)
    assert deadlines(steps)["decided"][0] == 0
    assert loop_sessions(steps, episodes).decisions.sum() == 0
