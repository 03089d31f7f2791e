"""conditions.parquet: a column for every reason for which an epoch is rejected."""

import pandas as pd

from hrcneuro.eeg.epochs import REASONS
from hrcneuro.io.tables import read_table
from hrcneuro.tables.epoch import CONDITIONS, write_conditions


def test_every_reason_has_a_column_of_its_own(tmp_path):
    row = {"scenario": "iC", "case": "RH", "position": "before", "kept": 3, "rejected": len(REASONS)}
    write_conditions(pd.DataFrame([row | dict.fromkeys(REASONS, 1)]), tmp_path)
    table = read_table(tmp_path / "conditions.parquet")
    assert list(table) == list(CONDITIONS.columns)
    assert "no_onset" in table
    assert (table.iloc[0, 5:] == 1).all()
    assert len(CONDITIONS.columns) == 5 + len(REASONS)
