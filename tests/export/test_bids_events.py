"""Events as BIDS has them: what is not known of them stays unknown, there and back."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from bids_files import recording, table

from hrcneuro.contract import Inputs
from hrcneuro.export import bids as export
from hrcneuro.io.tables import read_table
from hrcneuro.sources.origin import UNKNOWN
from hrcneuro.stages import acquire

pytest.importorskip("mne_bids", reason="needs the extra bids")
NAME = "sub-01_task-odd"


def acquired(root, out):
    out.mkdir()
    acquire.run(acquire.Config(source="bids", path=str(root)), Inputs("01", {}), out)
    return read_table(out / "trials.parquet")


def exported(out, folder, trials=None):
    export.prepare(folder, ["01"])
    export.write_dataset(folder, [UNKNOWN], study="odd", paradigm=False)
    files = export.Subject("01", UNKNOWN, out / "01_raw.fif", out / "trials.parquet")
    export.write_subject(folder, files, task="odd", line_hz=None, clean_reference="")
    events = next(folder.rglob("*_events.tsv"))
    return pd.read_csv(events, sep="\t", keep_default_na=False, dtype=str)


@pytest.mark.parametrize("duration", ["n/a", 0.2])
def test_a_foreign_data_set_whose_durations_are_not_known_comes_back_so(tmp_path, duration):
    path = recording(tmp_path / "data", NAME, seconds=20)
    rows = [(1 + i, duration, "target" if i % 2 else "standard") for i in range(15)]
    table(path.with_name(f"{NAME}_events.tsv"), ["onset", "duration", "trial_type"], rows)
    before = acquired(tmp_path / "data", tmp_path / "one")
    assert before["t_f_s"].isna().all()
    written = exported(tmp_path / "one", tmp_path / "bids")
    assert written["duration"].tolist() == ["n/a"] * 15
    after = acquired(tmp_path / "bids", tmp_path / "two")
    pd.testing.assert_frame_equal(before, after)


def test_of_moves_some_of_which_have_a_duration_each_keeps_its_own(tmp_path):
    recording(tmp_path / "data", NAME, seconds=20)
    trials = acquired(tmp_path / "data", tmp_path / "one")
    trials["t_f_s"] = np.where(np.arange(len(trials)) % 3, 0.8, np.nan)
    from hrcneuro.tables.trials import write_trials

    write_trials(trials, tmp_path / "one")
    written = exported(tmp_path / "one", tmp_path / "bids")
    assert written["duration"].tolist() == ["0.8" if i % 3 else "n/a" for i in range(len(trials))]
    pd.testing.assert_frame_equal(trials, acquired(tmp_path / "bids", tmp_path / "two"))
