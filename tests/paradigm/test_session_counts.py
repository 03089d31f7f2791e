"""One session beside the study's: simulated ones lie inside, others do not."""

import numpy as np
import pytest

from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.paradigm.session import simulate_session
from hrcneuro.paradigm.session_counts import session_counts


def counts(seed=0, timing=TimingParams(), **params):
    table = simulate_session(SessionParams(**params), rng=np.random.default_rng(seed), timing=timing)
    return session_counts(table).set_index("quantity")


@pytest.mark.parametrize("blocks", [2, 4, 12])
def test_simulated_sessions_lie_inside(blocks):
    outside = [(~counts(seed, blocks=blocks)["ok"].astype(bool)).sum() for seed in range(6)]
    assert np.mean(outside) <= 1


def test_other_sessions_lie_outside():
    assert not counts(error_rate=0.6)["ok"]["share of errors after no error"]
    assert not counts(timing=TimingParams(t_f_mean_s=1.1))["ok"]["sC: onset to onset, mean, ms"]
    assert not counts(error_rate=0.0)["ok"]["moves of an episode, mean"]


def test_a_scenario_without_blocks_has_no_rows_and_practice_none_at_all():
    assert not any(name.startswith("sC") for name in counts(blocks=1).index)
    table = simulate_session(SessionParams(blocks=1), rng=np.random.default_rng(0))
    assert session_counts(table[table["practice"]]).empty
