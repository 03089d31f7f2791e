"""The pictures of decoding, drawn from tables of scores that are known."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex

from hrcneuro.analyses import decode_group
from hrcneuro.contract import Inputs
from hrcneuro.drawings import confound, decode
from hrcneuro.figures import confound as figure_of
from hrcneuro.io.tables import read_table, write_table
from hrcneuro.tables.decode import EXTRA, SCORES, STRATA

DECODERS = ("rlda", "rlda_600")
UNITS = [f"s{i:02d}" for i in range(11)]
NOTHING = SimpleNamespace()


def scores_of(rng: np.random.Generator) -> pd.DataFrame:
    """Return the scores of eleven subjects, one of whom lacks a stratum."""
    rows = [
        {"subject": unit, "scenario": scenario, "problem": "RRvsRH", "decoder": decoder, "note": ""}
        | {"class1": "RR_before", "class2": "RH_before", "n1": 236, "n2": 153, "n_folds": 10, "n_repeats": 10}
        | {name: rng.normal(55, 3) for name in ("tnr", "tpr", "acc", "bacc", "auc", "chance", *EXTRA)}
        | {"bacc_se": 2.5, "permutation_bacc": rng.normal(55, 3), "p": 0.5}
        for unit in UNITS
        for scenario in ("iC", "sC")
        for decoder in DECODERS
    ]
    scores = pd.DataFrame(rows)[["subject", *SCORES.columns]]
    scores.loc[scores["subject"] == "s03", "prev_error_yes_bacc"] = np.nan
    return scores


@pytest.fixture
def entries(tmp_path):
    """Return a function that writes the group's tables of scores, and a subject's strata; and returns the files."""

    def write(scores: pd.DataFrame, *, strata: bool = True) -> Inputs:
        folders = {name: tmp_path / name for name in ("group", *(UNITS if strata else ()))}
        for name, folder in folders.items():
            folder.mkdir()
            if name == "group":
                for file, (schema, frame) in decode_group.tables(scores, DECODERS, 1).items():
                    write_table(frame, folder / file, schema)
                continue
            rows = [
                (scenario, "RRvsRH", decoder, cue, value, 40 + value, 30, 55.0)
                for scenario in ("iC", "sC")
                for decoder in DECODERS
                for cue in ("prev_error", "turn")
                for value in (False, True)
            ]
            write_table(pd.DataFrame(rows, columns=list(STRATA.columns)), folder / "strata.parquet", STRATA)
        return Inputs.of("group", decode=folders)

    return write


def draw(drawing, files, tmp_path):
    """Return the names of the pictures that a drawing makes."""
    out = tmp_path / "out"
    out.mkdir()
    drawing.draw(NOTHING, files, out)
    return {p.name for p in out.iterdir()}


@pytest.mark.parametrize("drawing", [decode, confound])
@pytest.mark.parametrize("strata", [True, False])
def test_a_drawing_makes_the_pictures_that_it_names(entries, tmp_path, drawing, strata):
    found = draw(drawing, entries(scores_of(np.random.default_rng(5)), strata=strata), tmp_path)
    (name,) = drawing.DRAWINGS.group.captions
    assert found == {name, name.replace(".png", ".pdf")}


@pytest.mark.parametrize("drawing", [decode, confound])
def test_nothing_decoded_is_no_picture(entries, tmp_path, drawing):
    scores = scores_of(np.random.default_rng(5))
    scores["bacc"] = np.nan
    assert draw(drawing, entries(scores), tmp_path) == set()


@pytest.mark.parametrize("drawing", [decode, confound])
def test_no_problem_at_all_is_no_picture(entries, tmp_path, drawing):
    assert draw(drawing, entries(scores_of(np.random.default_rng(5)).iloc[:0]), tmp_path) == set()


def test_trials_without_a_cue_have_no_confound_panel(entries, tmp_path):
    scores = scores_of(np.random.default_rng(5))
    scores[figure_of.QUALIFIERS] = np.nan
    assert draw(confound, entries(scores), tmp_path) == set()


def test_the_confound_panel_tells_retrained_decoders_from_strata_and_shows_what_could_be_detected(entries):
    files = entries(scores_of(np.random.default_rng(5)))
    scores, table2 = (read_table(files.path("decode", f"{name}.parquet")) for name in ("subjects", "table2"))
    scores = scores[scores["decoder"] == DECODERS[0]]
    figure = figure_of.figure(scores, table2, read_table(files.path("decode", "strata.parquet", unit="s01")))
    at = table2[table2["decoder"] == DECODERS[0]].set_index(["scenario", "measure"])
    for axes, scenario in zip(figure.axes, ("iC", "sC"), strict=True):
        labels = {round(-place): text for place, text in zip(axes.get_yticks(), figure_of._ticks()[1], strict=True)}
        marks = {m: {} for m in "D^"}
        for line in axes.lines:
            if line.get_marker() in marks:
                marks[line.get_marker()][labels[int(-line.get_ydata()[0])]] = line
        colour = {name: to_hex(line.get_color()) for name, line in marks["D"].items()}
        assert colour["after no error"] == colour["turn ahead"] != colour["retrained after no error"]
        assert marks["D"]["turn ahead"].get_xdata()[0] == pytest.approx(at.loc[(scenario, "turn_yes_bacc"), "mean"])
        detected = marks["^"]["retrained after no error"].get_xdata()[0]
        assert detected == pytest.approx(at.loc[(scenario, "matched_bacc"), "detectable"])
        assert not any(name.startswith("no EEG") for name in marks["^"])
        assert {"40 : 30", "41 : 30"} <= {text.get_text() for text in axes.texts}
