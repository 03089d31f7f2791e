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
from hrcneuro.figures import decode as forest
from hrcneuro.io.tables import read_table, write_table
from hrcneuro.tables.contrasts import CHANNELS
from hrcneuro.tables.decode import EXTRA, PATTERNS, SCORES, STRATA

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
    rows = figure_of.places(list(figure_of.ROWS))
    names = {round(height, 3): name for name, height in rows.items()}
    for axes, scenario in zip(figure.axes, ("iC", "sC"), strict=True):
        marks = {m: {} for m in "D^"}
        for line in axes.lines:
            if line.get_marker() in marks:
                height = line.get_ydata()[0] + (0.32 if line.get_marker() == "^" else 0)
                marks[line.get_marker()][names[round(height, 3)]] = line
        colour = {name: to_hex(line.get_color()) for name, line in marks["D"].items()}
        assert colour["prev_error_no_bacc"] == colour["turn_yes_bacc"] != colour["matched_bacc"]
        mean = at.loc[(scenario, "turn_yes_bacc"), "mean"]
        assert marks["D"]["turn_yes_bacc"].get_xdata()[0] == pytest.approx(mean)
        detected = marks["^"]["matched_bacc"].get_xdata()[0]
        assert detected == pytest.approx(at.loc[(scenario, "matched_bacc"), "detectable"])
        assert not any(name.endswith("fitted_bacc") for name in marks["^"])
        assert {"40 : 30", "41 : 30"} <= {text.get_text() for text in axes.texts}
    (legend,) = figure.legends
    told = {handle.get_label(): to_hex(handle.get_color()) for handle in legend.legend_handles}
    assert {told[kind] for kind in ("trained on all, scored within", "trained and scored within")} == {
        colour["turn_yes_bacc"],
        colour["matched_bacc"],
    }
    assert {"a subject", "smallest mean found with 80 % power"} <= set(told)


def test_a_measure_that_nobody_has_takes_no_row_of_the_confound_panel(entries):
    frame = scores_of(np.random.default_rng(5))
    frame["matched_bacc"] = np.nan
    files = entries(frame)
    scores, table2 = (read_table(files.path("decode", f"{name}.parquet")) for name in ("subjects", "table2"))
    figure = figure_of.figure(scores[scores["decoder"] == DECODERS[0]], table2, None)
    assert len(figure.axes[0].get_yticks()) == len(figure_of.ROWS) - 1
    assert not any("trained and scored" in text.get_text() for text in figure.legends[0].get_texts())


def test_the_forest_plot_and_the_confound_panel_show_different_things_of_the_group():
    shared = set(forest._BELOW) & set(figure_of.ROWS)
    assert shared == {"bacc"}, "the plain mean alone, to compare with"


def few(entries, *, problems: tuple[str, ...], mean: float = 55.0) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the rows of two subjects and the group, whose scores lie 20 apart around a mean."""
    scores = scores_of(np.random.default_rng(5))
    scores = scores[scores["subject"].isin(UNITS[:2]) & scores["scenario"].isin(problems)].copy()
    scores["bacc"] = np.where(scores["subject"] == UNITS[0], mean - 10, mean + 10)
    files = entries(scores)
    subjects, table2 = (read_table(files.path("decode", f"{name}.parquet")) for name in ("subjects", "table2"))
    return subjects[subjects["decoder"] == DECODERS[0]], table2[table2["decoder"] == DECODERS[0]]


@pytest.mark.parametrize("problems", [("iC",), ("iC", "sC")])
@pytest.mark.parametrize("figure", [forest._figure, lambda scores, table2: figure_of.figure(scores, table2, None)])
def test_legends_lie_within_the_picture(entries, problems, figure):
    drawn = figure(*few(entries, problems=problems))
    drawn.canvas.draw()
    (legend,) = drawn.legends
    box = legend.get_window_extent()
    assert drawn.bbox.x0 <= box.x0 < box.x1 <= drawn.bbox.x1
    assert drawn.bbox.y0 <= box.y0


@pytest.mark.parametrize("figure", [forest._figure, lambda scores, table2: figure_of.figure(scores, table2, None)])
@pytest.mark.parametrize("mean", [11.0, 50.0])
def test_an_interval_beyond_all_rates_ends_in_arrows_within_the_axis(entries, figure, mean):
    # Of two subjects 20 apart the interval reaches 127 to either side.
    drawn = figure(*few(entries, problems=("iC",), mean=mean))
    axes = drawn.axes[0]
    marks = {line.get_marker() for line in axes.lines if line.get_xdata()[0] in (0, 100)}
    assert {"<", ">"} <= marks
    low, high = axes.get_xlim()
    assert low < 0 < 100 < high
    assert "goes on beyond" in " ".join(text.get_text() for text in drawn.legends[0].get_texts())


def test_an_interval_among_the_rates_has_no_arrow(entries):
    files = entries(scores_of(np.random.default_rng(5)))
    scores, table2 = (read_table(files.path("decode", f"{name}.parquet")) for name in ("subjects", "table2"))
    drawn = forest._figure(scores[scores["decoder"] == DECODERS[0]], table2[table2["decoder"] == DECODERS[0]])
    assert "beyond" not in " ".join(text.get_text() for text in drawn.legends[0].get_texts())


def test_a_subject_that_was_not_decoded_in_a_panel_is_told_there(entries):
    scores, table2 = few(entries, problems=("iC", "sC"))
    drawn = forest._figure(scores[(scores["subject"] != UNITS[1]) | (scores["scenario"] != "sC")], table2)
    said = [[text.get_text() for text in axes.texts] for axes in drawn.axes]
    assert said == [[], ["too few trials"]]


def test_dots_of_subjects_and_numbers_of_trials_lie_on_no_bar(entries):
    files = entries(scores_of(np.random.default_rng(5)))
    scores, table2 = (read_table(files.path("decode", f"{name}.parquet")) for name in ("subjects", "table2"))
    strata = read_table(files.path("decode", "strata.parquet", unit="s01"))
    drawn = figure_of.figure(scores[scores["decoder"] == DECODERS[0]], table2, strata)
    bars = {y for axes in drawn.axes for line in axes.lines if len(line.get_xdata()) == 2 for y in line.get_ydata()}
    dots = {y for axes in drawn.axes for line in axes.lines if line.get_marker() == "o" for y in line.get_ydata()}
    assert dots
    assert not dots & bars
    drawn.canvas.draw()
    for axes in drawn.axes:
        counts = [text for text in axes.texts if " : " in text.get_text()]
        assert counts
        assert all(text.get_window_extent().x0 > axes.bbox.x1 for text in counts)


def test_what_is_not_published_is_no_mark_of_the_forest_plot(entries, monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr(forest, "save", lambda figure, path: drawn.append(figure))
    files = entries(scores_of(np.random.default_rng(5)))
    scores, table2 = (read_table(files.path("decode", f"{name}.parquet")) for name in ("subjects", "table2"))
    scores = scores[scores["decoder"] == DECODERS[0]]
    table2 = table2[table2["decoder"] == DECODERS[0]]
    for printed in (table2, table2.assign(published_mean=np.nan)):
        forest.draw(scores, printed, tmp_path / "x.png")
    texts = [[text.get_text() for text in figure.legends[0].get_texts()] for figure in drawn]
    assert ["published mean" in one for one in texts] == [True, False]


@pytest.fixture
def subject(tmp_path):
    """Return the folder of a subject's decode entry, of six channels of which the third holds an effect."""
    import epoch_factory

    from hrcneuro.stages import decode as stage

    epoch_factory.write_subject(tmp_path / "epoch", "s01", seed=3, n=160, sfreq=64.0, effect_uv=20)
    (tmp_path / "decode").mkdir()
    config = stage.Config(decoders=("rlda", "rlda_bands"), repeats=2, permutations=0)
    stage.run(config, Inputs.of("s01", epoch=tmp_path / "epoch"), tmp_path / "decode")
    return tmp_path / "decode"


@pytest.mark.filterwarnings("ignore:The inplace keyword")
def test_a_subjects_curves_and_patterns_are_drawn_the_same_twice(subject, tmp_path):
    folders = [tmp_path / name for name in ("a", "b")]
    for folder in folders:
        folder.mkdir()
        decode.draw_subject(NOTHING, Inputs.of("s01", decode=subject), folder)
        assert {path.name for path in folder.glob("*.png")} == set(decode.DRAWINGS.subject.captions)
    for path in folders[0].iterdir():
        assert path.read_bytes() == (folders[1] / path.name).read_bytes(), path.name


@pytest.mark.filterwarnings("ignore:The inplace keyword")
def test_curves_and_patterns_are_those_of_the_tables(subject, monkeypatch, tmp_path):
    from hrcneuro.figures import patterns, roc

    drawn, rows = [], []
    monkeypatch.setattr(roc, "save", lambda figure, path: drawn.append(figure))
    monkeypatch.setattr(patterns, "draw", lambda shown, *_, **__: rows.extend(shown))
    decode.draw_subject(NOTHING, Inputs.of("s01", decode=subject), tmp_path)
    scores = read_table(subject / "scores.parquet").set_index(["scenario", "problem", "decoder"])
    curves = read_table(subject / "roc.parquet").groupby(["scenario", "problem", "decoder"])
    assert len(curves) == 8
    for key, curve in curves:
        area = np.trapezoid(curve["tpr"], curve["fpr"]) / 100
        assert area == pytest.approx(scores.loc[key, "auc"], abs=0.5)
    texts = {text.get_text() for text in drawn[0].axes[0].texts}
    assert f"AUC {scores.loc[('iC', 'HHvsHR', 'rlda'), 'auc']:.0f} %" in texts
    best = next(row for row in rows if row.title.startswith("iC: RH_before against RR_before"))
    np.testing.assert_allclose(best.spans_s, [(i / 10, i / 10 + 0.1) for i in range(6)])
    window, channel = np.unravel_index(best.values.argmax(), best.values.shape)
    assert (best.spans_s[window][0], channel) == (pytest.approx(0.5, abs=0.11), 0)


@pytest.mark.filterwarnings("ignore:The inplace keyword")
def test_decoders_without_patterns_and_channels_without_a_place_have_no_maps(subject, tmp_path):
    table = read_table(subject / "patterns.parquet")
    for name, change in (("none", table.iloc[:0]), ("elsewhere", table)):
        folder = tmp_path / name
        folder.mkdir()
        for path in subject.iterdir():
            (folder / path.name).write_bytes(path.read_bytes())
        write_table(change, folder / "patterns.parquet", PATTERNS)
        if name == "elsewhere":
            places = read_table(folder / "channels.parquet")
            places[["x_m", "y_m", "z_m"]] = np.nan
            write_table(places, folder / "channels.parquet", CHANNELS)
        out = tmp_path / f"out_{name}"
        out.mkdir()
        decode.draw_subject(NOTHING, Inputs.of("s01", decode=folder), out)
        assert {path.name for path in out.glob("*.png")} == {"roc.png"}


def test_maps_are_of_windows_side_by_side():
    from hrcneuro.decoding.features import layout
    from hrcneuro.figures.patterns import side_by_side

    spans = [one.span_s for one in layout("windows")[0]]
    assert [spans[i][0] for i in side_by_side(spans, 6)] == pytest.approx([0, 0.1, 0.2, 0.3, 0.4, 0.5])
    steps = [one.span_s for one in layout("steps")[0]]
    assert side_by_side(steps, 6) == [0, 2, 4, 7, 9, 11]
