"""The truth of a synthetic recording as files: units by the names' ends, single values in one JSON."""

import json

import numpy as np
import pandas as pd

from hrcneuro.io.tables import describe, read_table
from hrcneuro.tables.truth import write_truth


def test_tables_and_single_values_are_kept_apart(tmp_path):
    truth = {
        "blinks": pd.DataFrame({"peak_s": [1.0, 2.0], "amplitude_uv": [150.0, 180.0]}),
        "topographies": pd.DataFrame({"blink": [1.0, 0.5]}, index=pd.Index(["Fp1", "Cz"], name="channel")),
        "sources": pd.DataFrame({"time_s": [0.0, 0.1], "blink": np.float32([0.25, 0.5])}),
        "subject": {"effect": "turn", "alpha_hz": np.float64(10.5)},
    }
    write_truth(truth, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "truth.json", "truth_blinks.parquet", "truth_sources.parquet", "truth_topographies.parquet",
    ]  # fmt: skip
    assert json.loads((tmp_path / "truth.json").read_text()) == {"subject": {"alpha_hz": 10.5, "effect": "turn"}}
    assert read_table(tmp_path / "truth_topographies.parquet")["channel"].tolist() == ["Fp1", "Cz"]
    columns = describe(tmp_path / "truth_blinks.parquet").columns
    assert (columns["peak_s"].unit, columns["amplitude_uv"].unit) == ("s", "uV")
    course = describe(tmp_path / "truth_sources.parquet").columns["blink"]
    assert (course.type, course.unit) == ("float", "uV")
