"""The pictures of ersp: what they show of the tables."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

from hrcneuro.io.tables import read_lists, read_table
from hrcneuro.stages import ersp

pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword")

SMALL = ersp.Config(
    contrasts={"RH-RR_before": ("RH_before", "RR_before")}, high_hz=16.0, channels=("Fz", "Cz"), min_stratum=2
)


@pytest.fixture(scope="module")
def five(tmp_path_factory, study):
    """The folders of five subjects and their group."""
    return study(tmp_path_factory.mktemp("five"), ersp, SMALL, 5, sfreq=64.0)


def images(figure):
    return [image.get_array() for axes in figure.axes for image in axes.images]


def test_the_group_shows_the_tested_differences_of_the_chosen_channels(five, draw, figures, foot, tmp_path):
    draw("ersp", "group", tmp_path, {"ersp": SMALL}, ersp=five["group"])
    stats = five["group"] / "ersp_stats.parquet"
    table = read_table(stats, ["scenario", "channel"])
    rows = np.flatnonzero((table["scenario"] == "all") & (table["channel"] == "Fz"))
    (shown,) = images(figures["ersp.png"])
    width = read_lists(stats, "difference_uv").shape[1]
    np.testing.assert_allclose(shown[:, :width], read_lists(stats, "difference_uv")[rows])
    # Five subjects have 32 sign flips: no p is below 0.06.
    assert "nothing shown is significant (p < 0.05 by sign flips over subjects" in foot(figures["ersp.png"])
    assert len(images(figures["ersp_scenarios.png"])) == 2


def test_titles_of_rows_stand_above_the_channels_names_and_use_words(five, draw, figures, tmp_path):
    draw("ersp", "group", tmp_path, {"ersp": SMALL}, ersp=five["group"])
    figure = figures["ersp_strata.png"]
    figure.canvas.draw()
    titles = [text for text in figure.texts if ", n = " in text.get_text()]
    names = set(read_table(five["group"] / "ersp_strata.parquet", ["channel"])["channel"])
    words = [text for axes in figure.axes for text in axes.texts]
    channels = [text for text in words if text.get_text() in names]
    # Two that were asked for, and the one of the largest difference.
    assert len(channels) == 3 * len(titles)
    assert {text.get_text().split(":")[0] for text in titles} <= {
        f"{place}, {words}"
        for place in ("iC", "sC")
        for words in ("after no error", "after an error", "no turn ahead", "turn ahead")
    }
    boxes = [text.get_window_extent() for text in (*titles, *channels)]
    assert not [(a, b) for i, a in enumerate(boxes) for b in boxes[:i] if a.overlaps(b)]


@pytest.mark.parametrize("found", [True, False])
def test_colours_fade_only_where_something_else_is_significant(found, figures, tmp_path):
    from hrcneuro.figures import ersp as figure_of

    rng = np.random.default_rng(0)
    values, significant = rng.normal(size=(2, 1, 5, 20)), np.zeros((2, 1, 5, 20), bool)
    significant[0, 0, 2, 3:8] = found
    rows = [figure_of.MapRow(f"row {i}", ("Cz",), values[i], significant[i]) for i in range(2)]
    shown = figure_of.MapSettings(np.arange(4.0, 9.0), np.arange(20) / 20, 0.7)
    figure_of.draw(rows, shown, tmp_path / "x.png", unit="µV", note="")
    alphas = [np.unique(image.get_alpha()) for axes in figures["x.png"].axes[:2] for image in axes.images]
    assert [len(alpha) for alpha in alphas] == ([2, 1] if found else [1, 1])
    assert (alphas[1][0] < 1) == found


@pytest.mark.parametrize(("largest", "shown"), [("Oz", ["Fz", "Cz", "Oz"]), ("Cz", ["Fz", "Cz"])])
def test_a_cross_marks_the_largest_difference_and_its_channel_is_shown(largest, shown):
    from hrcneuro.figures import ersp as figure_of

    names = ["Cz", "Oz", "Fz"]
    values = np.random.default_rng(0).normal(size=(3, 5, 20))
    values[names.index(largest), 2, 7] = -30
    maps = {("all", "a"): values, ("all", "b"): 0 * values}
    rows, unit = figure_of.of_subject(maps, {"a-b": ("a", "b")}, names, ["Fz", "Cz"])
    assert unit == "µV"
    assert list(rows[0].channels) == shown
    assert rows[0].values[rows[0].peak] == -30


def test_a_subject_shows_its_differences(five, draw, figures, tmp_path):
    draw("ersp", "s02", tmp_path, {"ersp": SMALL}, ersp=five["s02"])
    path = five["s02"] / "ersp.parquet"
    table = read_table(path, ["scenario", "condition", "channel"])
    values = read_lists(path, "magnitude_uv").astype(float)
    plus, minus = (
        values[(table["scenario"] == "all") & (table["channel"] == "Fz") & (table["condition"] == name)]
        for name in ("RH_before", "RR_before")
    )
    (shown,) = images(figures["ersp_subject.png"])
    np.testing.assert_allclose(shown[:, : values.shape[1]], plus - minus)


def test_every_picture_is_drawn_and_the_same_table_gives_the_same_bytes(five, draw, tmp_path):
    for name in ("a", "b"):
        drawn = draw("ersp", "group", tmp_path / name, {"ersp": SMALL}, ersp=five["group"])
        assert drawn == {"ersp", "ersp_scenarios", "ersp_strata"}
        assert draw("ersp", "s01", tmp_path / name / "s01", {"ersp": SMALL}, ersp=five["s01"]) == {"ersp_subject"}
    for path in (tmp_path / "a").rglob("*.*"):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes(), path


def test_channels_that_are_not_there_are_said_at_the_foot(five, draw, figures, foot, tmp_path):
    for wanted, sentence in (
        (("Fz", "Fp9"), "no channel Fp9, so here is Fz"),
        (("Fp9", "AF9"), "no channel Fp9, AF9, so here is Cz"),
    ):
        config = dataclasses.replace(SMALL, channels=wanted)
        for unit, picture in (("group", "ersp.png"), ("s01", "ersp_subject.png")):
            draw("ersp", unit, tmp_path, {"ersp": config}, ersp=five[unit])
            assert sentence in foot(figures[picture])


def test_a_foreign_study_shows_its_conditions_over_their_mean(study, draw, figures, foot, tmp_path):
    table = pd.DataFrame({"event": ["square", "rt"] * 12, "scenario": None, "soa_s": np.nan})
    config = dataclasses.replace(SMALL, conditions={"square": "event == 'square'"}, contrasts={}, split="")
    folders = study(tmp_path, ersp, config, 1, sfreq=64.0, table=table, channels=("E1", "E2"))
    draw("ersp", "s01", tmp_path / "drawn", {"ersp": config}, ersp=folders["s01"])
    draw("ersp", "group", tmp_path / "drawn", {"ersp": config}, ersp=folders["group"])
    assert set(figures) == {"ersp_subject.png"}
    assert "mean magnitude over its mean in time" in foot(figures["ersp_subject.png"])
    (shown,) = images(figures["ersp_subject.png"])
    np.testing.assert_allclose(shown.mean(axis=1), 0, atol=1e-4)
