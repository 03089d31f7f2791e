"""The pictures of a calibration, drawn from tables that are known."""

from types import SimpleNamespace

import mne
import numpy as np
import pandas as pd
import pytest

from hrcneuro.contract import Inputs
from hrcneuro.decoding.features import WINDOWS_S
from hrcneuro.drawings import calibrate
from hrcneuro.figures import calibrate as figure_of
from hrcneuro.io.tables import write_table
from hrcneuro.tables.calibrate import BASELINES, BLOCKS, PATTERNS, SCORES, TRIALS
from hrcneuro.tables.contrasts import CHANNELS

NAMES = ["Fp1", "Fp2", "F3", "Fz", "F4", "C3", "Cz", "C4", "P3", "Pz", "P4", "O1", "O2"]
KNOWN = mne.channels.make_standard_montage("biosemi64").get_positions()["ch_pos"]
PLACES = {name: KNOWN[name] for name in NAMES}


def rows(table, n, **values):
    """Return ``n`` rows of a table: given columns, zeros and empty texts elsewhere."""
    blank = {name: 0 if one.type in ("int", "float", "bool") else "" for name, one in table.columns.items()}
    return pd.DataFrame({**blank, **values}, index=range(n)).assign(problem="RRvsRH")


@pytest.fixture
def files(tmp_path):
    rng = np.random.default_rng(0)
    n = len(PLACES) * len(WINDOWS_S)
    tables = {
        "scores": (SCORES, rows(SCORES, 1, class1="RR", class2="RH", n1=40, n2=20, bacc=58.0, bacc_se=3.0, slope=0.1)),
        "blocks": (BLOCKS, rows(BLOCKS, 3, block=[1, 2, 3], scenario=["iC", "sC", "iC"], bacc=[60.0, np.nan, 55.0])),
        "baselines": (BASELINES, rows(BASELINES, 2, rule=["stays", "turn"], bacc=[50.0, 88.0])),
        "trials": (TRIALS, rows(TRIALS, 60, label=np.arange(60) % 3 == 0, score=rng.normal(0, 5, 60))),
        "patterns": (
            PATTERNS,
            rows(
                PATTERNS,
                n,
                channel=np.repeat(list(PLACES), len(WINDOWS_S)),
                start_s=[start for start, _ in WINDOWS_S] * len(PLACES),
                end_s=[end for _, end in WINDOWS_S] * len(PLACES),
                pattern=rng.normal(size=n),
            ),
        ),
        "channels": (
            CHANNELS,
            pd.DataFrame(list(PLACES.values()), columns=["x_m", "y_m", "z_m"]).assign(channel=list(PLACES)),
        ),
    }  # fmt: skip

    def write(**changed):
        for name, (schema, frame) in tables.items():
            write_table(changed.get(name, frame), tmp_path / f"{name}.parquet", schema)
        return Inputs.of("s01", calibrate=tmp_path)

    return write


def test_blocks_rules_and_scores_are_in_the_picture(files, tmp_path, monkeypatch):
    figures = {}
    monkeypatch.setattr(figure_of, "save", lambda figure, path: figures.update({path.name: figure}))
    calibrate.draw(SimpleNamespace(), files(), tmp_path)
    left, right, _ = figures["calibration.png"].axes
    assert left.get_title() == "RH against RR (20 : 40 trials)"
    labels = [text.get_text() for text in left.get_legend().get_texts()]
    assert labels == ["all held-out trials, 95 %", "blocks, iC", "blocks, sC", "no EEG: before a turn"]
    points = {line.get_label(): line.get_xydata().tolist() for line in left.lines}
    assert points["blocks, iC"] == [[1, 60], [3, 55]]
    assert points["no EEG: before a turn"][0][1] == 88
    assert [text.get_text() for text in right.get_legend().get_texts()] == ["RR (40)", "RH (20)"]


def test_both_pictures_are_files_and_an_empty_study_has_none(files, draw, tmp_path):
    folder = files().path("calibrate", "scores.parquet").parent
    assert draw("calibrate", "s01", tmp_path / "out", {}, calibrate=folder) == {"calibration", "patterns"}
    assert (tmp_path / "out" / "calibration.pdf").is_file()
    files(scores=rows(SCORES, 0))
    assert draw("calibrate", "s01", tmp_path / "none", {}, calibrate=folder) == set()


def test_scores_that_are_all_alike_are_drawn(files, draw, tmp_path):
    folder = files(trials=rows(TRIALS, 6, label=[0, 1] * 3)).path("calibrate", "scores.parquet").parent
    assert "calibration" in draw("calibrate", "s01", tmp_path / "out", {}, calibrate=folder)
