"""The trial table: its rows are made of moves or of markers, and every column is there."""

import numpy as np
import pandas as pd
import pytest

from hrcneuro.io.tables import describe, read_table
from hrcneuro.paradigm.session import SessionParams, simulate_session
from hrcneuro.tables.trials import TRIALS, event_trials, study_trials, write_trials


@pytest.fixture
def moves():
    params = SessionParams(practice_episodes=0, blocks=1, episodes_per_block=1)
    return simulate_session(params, rng=np.random.default_rng(8))


def test_a_move_gets_the_nearest_sample_and_one_without_a_marker_none(moves, tmp_path):
    moves.loc[moves.index[1], "onset_s"] = np.nan
    write_trials(study_trials(moves, "s01", 512.0), tmp_path)
    table = read_table(tmp_path / "trials.parquet")
    assert list(table) == list(TRIALS.columns)
    assert table["onset_sample"].isna().tolist() == [i == 1 for i in range(len(table))]
    known = table.dropna(subset="onset_sample")
    assert (known["onset_sample"] - 512 * known["onset_s"]).abs().max() <= 0.5
    assert set(table["subject"]) == {"s01"}
    assert set(table["event"]) == {"move"}


def test_markers_of_another_study_leave_the_paradigms_columns_null(tmp_path):
    markers = pd.DataFrame({"onset_s": [1.0, 2.5, 2.75], "event": ["a", "b", "a"]})
    write_trials(event_trials(markers, "x", 100.0), tmp_path)
    table = read_table(tmp_path / "trials.parquet")
    assert table["onset_sample"].tolist() == [100, 250, 275]
    assert table["soa_s"].tolist()[:2] == [1.5, 0.25]
    assert np.isnan(table["soa_s"].iloc[2])
    assert table["scenario"].isna().all()
    assert describe(tmp_path / "trials.parquet").columns["onset_s"].unit == "s"


def test_a_recording_may_have_no_marker_at_all():
    assert event_trials(pd.DataFrame({"onset_s": [], "event": []}), "x", 100.0).empty
