"""The drop log: which trials it shows, and what it says of them."""

import numpy as np
import pandas as pd
import pytest

from hrcneuro.contract import Inputs, chosen
from hrcneuro.drawings import epoch as drawing
from hrcneuro.eeg.epochs import tally
from hrcneuro.figures import drop_log as figure_of
from hrcneuro.stages import epoch
from hrcneuro.tables.epoch import write_conditions, write_drop_log

REASONS = ["", "", "amplitude", "marked", "no onset", "outside", "amplitude", "boundary"]
PEAKS = [20.0, 35.0, 1500.0, 90.0, np.nan, np.nan, 4000.0, 30.0]


@pytest.fixture
def entry(tmp_path):
    """The folder of a subject's epoch entry: eight trials, six of them rejected."""
    trials = pd.DataFrame(
        {
            "scenario": None, "event": ["square", "rt"] * 4, "block": None, "episode": None, "trial": None,
            "onset_s": [1.0, 2.0, 3.0, 4.0, np.nan, 6.0, 7.0, 8.0],
        }
    )  # fmt: skip
    reasons = np.array(REASONS, object)
    rows = np.array([0, 1, 1, 0, -1, -1, 1, 0])
    folder = tmp_path / "epoch"
    folder.mkdir()
    write_drop_log(trials, list(trials["event"]), reasons, (np.array(PEAKS), rows), ["Oz", "Fp1"], folder)
    write_conditions(tally(trials, reasons), folder)
    return folder


def draw(entry, out):
    out.mkdir(exist_ok=True)
    config = chosen({"epoch": epoch.Config()}, drawing.DRAWINGS.subject.options)
    drawing.draw(config, Inputs.of("s01", epoch=entry), out)


def test_every_trial_with_an_amplitude_is_a_mark_and_the_worst_channel_is_named(entry, monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr(figure_of, "save", lambda figure, path: drawn.append(figure))
    draw(entry, tmp_path / "out")
    upper, lower = drawn[0].axes
    marks = np.concatenate([line.get_xydata() for line in upper.lines if line.get_marker() in "ox"])
    assert sorted(marks[:, 1]) == sorted(peak for peak in PEAKS if np.isfinite(peak))
    assert marks[np.argmax(marks[:, 1]), 0] == pytest.approx(7 / 60)
    assert upper.get_title(loc="left") == "2 of 8 epochs kept; too large at Fp1 (2)"
    assert upper.get_ylim()[1] > 4000
    assert sum(bar.get_width() for bar in lower.patches) == 8
    assert {text.get_text() for text in drawn[0].legends[0].get_texts()} == {
        "an epoch", "kept", "amplitude", "marked", "boundary", "outside", "no onset",
    }  # fmt: skip
    assert [text.get_text() for text in lower.get_yticklabels()] == ["rt", "square"]


def test_it_is_the_same_picture_twice(entry, tmp_path):
    for name in ("a", "b"):
        draw(entry, tmp_path / name)
    assert {path.name for path in (tmp_path / "a").iterdir()} == {"drop_log.png", "drop_log.pdf"}
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
