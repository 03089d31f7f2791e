"""The pictures of transfer: what they show of the tables."""

import numpy as np
import pandas as pd
import pytest

from hrcneuro.analyses import transfer_group
from hrcneuro.figures import transfer as figure_of
from hrcneuro.io.tables import write_table
from hrcneuro.stages import transfer
from hrcneuro.tables.transfer import SCORES

WAYS = {"own": ("2", "10", "all"), "pooled": ("none",), "recentred": ("none", "2", "10", "all"), "joint": ("2", "all")}
MINUTES = {"none": 0.0, "2": 0.8, "10": 4.0, "all": 21.0}


def written(folder, *, shuffled=False):
    """Write a group's tables of four subjects, and return the options."""
    rng = np.random.default_rng(0)
    rows = [
        {"signal": signal, "scenario": scenario, "problem": problem, "way": way, "calibration": size}
        | {"subject": f"s{i}", "bacc": rng.normal(56, 3), "minutes": MINUTES[size], "pairs": 1.0, "n1": 90, "n2": 60}
        | {"folds": 4}
        for signal in ("causal", "offline")
        for scenario in ("iC", "sC")
        for problem in ("HHvsHR", "RRvsRH")
        for way, sizes in WAYS.items()
        for size in sizes
        for i in range(4)
    ]
    scores = pd.DataFrame(rows).reindex(columns=list(SCORES.columns))
    folder.mkdir()
    for name, (schema, frame) in transfer_group.tables(scores, 1).items():
        write_table(frame, folder / name, schema)
    return {"transfer": transfer.Config(shuffled=shuffled)}


@pytest.fixture
def kept(figures, monkeypatch):
    monkeypatch.setattr(figure_of, "save", lambda figure, path: figures.update({path.name: figure}))
    return figures


def test_every_picture_is_drawn_and_the_same_table_gives_the_same_bytes(draw, tmp_path):
    options = written(tmp_path / "group")
    for name in ("a", "b"):
        drawn = draw("transfer", "group", tmp_path / name, options, transfer=tmp_path / "group")
        assert drawn == {"transfer", "transfer_offline", "transfer_causal"}
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes(), path.name


def test_curves_are_those_of_the_table_over_minutes(draw, kept, tmp_path):
    options = written(tmp_path / "group")
    draw("transfer", "group", tmp_path / "out", options, transfer=tmp_path / "group")
    figure = kept["transfer.png"]
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[:4] == ["iC: HHvsHR, causal", "iC: RRvsRH, causal", "sC: HHvsHR, causal", "sC: RRvsRH, causal"]
    lines = {line.get_label(): line for line in figure.axes[1].lines}
    np.testing.assert_allclose(lines["own trials"].get_xdata(), [0.8, 4.0, 21.0])
    np.testing.assert_allclose(lines["others recentred, own trials without labels"].get_xdata(), [0.0, 0.8, 4.0, 21.0])
    assert "others pooled" in lines


def test_each_subject_stands_in_its_row_with_every_way(draw, kept, tmp_path):
    options = written(tmp_path / "group")
    draw("transfer", "group", tmp_path / "out", options, transfer=tmp_path / "group")
    axes = kept["transfer_offline.png"].axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["s0", "s1", "s2", "s3", "means"]
    lines = {line.get_label(): line for line in axes.lines}
    for name, _, _ in figure_of.LOOKS.values():
        assert np.abs(np.round(lines[name].get_ydata()) - [4, 3, 2, 1]).max() == 0


def test_a_control_says_so(draw, kept, tmp_path):
    options = written(tmp_path / "group", shuffled=True)
    draw("transfer", "group", tmp_path / "out", options, transfer=tmp_path / "group")
    assert "a control, no result" in kept["transfer.png"].get_suptitle()


def test_nothing_decoded_draws_nothing(draw, tmp_path):
    (tmp_path / "group").mkdir()
    empty = pd.DataFrame(columns=list(SCORES.columns))
    for name, (schema, frame) in transfer_group.tables(empty, 1).items():
        write_table(frame, tmp_path / "group" / name, schema)
    options = {"transfer": transfer.Config()}
    assert draw("transfer", "group", tmp_path / "out", options, transfer=tmp_path / "group") == set()
