"""The pictures of erp: what they show of the tables."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

from hrcneuro import drawings
from hrcneuro.eeg.evoked import subtract_baseline
from hrcneuro.figures import erp_panels
from hrcneuro.io.fif import read_epochs, read_evokeds
from hrcneuro.io.tables import read_lists, read_table
from hrcneuro.stages import erp

pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword")

SMALL = erp.Config(contrasts={"RH-RR_before": ("RH_before", "RR_before")}, min_stratum=2)
FOREIGN = erp.Config(conditions={"square": "event == 'square'", "rt": "event == 'rt'"}, contrasts={}, split="")


@pytest.fixture(scope="module")
def five(tmp_path_factory, study):
    """The folders of five subjects and their group."""
    return study(tmp_path_factory.mktemp("five"), erp, SMALL, 5, n=60)


def foreign(folder, study):
    table = pd.DataFrame({"event": ["square", "rt"] * 15, "scenario": None, "condition_before": None, "soa_s": np.nan})
    return study(folder, erp, FOREIGN, 1, table=table, channels=("E1", "E2", "Oz"))


def panel(figure, number=0):
    """Return the wave of a panel's difference, and the lowest and highest point of its band."""
    axes = [a for a in figure.axes if a.get_xlim()[0] < 0 and len(a.lines) and not a.get_legend()][number]
    band = axes.collections[0].get_paths()[0].vertices[:, 1]
    return next(line.get_ydata() for line in axes.lines if len(line.get_xdata()) > 2), band.min(), band.max()


def test_the_group_shows_the_mean_difference_with_its_interval(five, draw, figures, foot, tmp_path):
    from scipy.stats import ttest_1samp

    draw("erp", "group", tmp_path, {"erp": SMALL}, erp=five["group"])
    waves = []
    for unit in set(five) - {"group"}:
        evokeds = {e.comment: e for e in read_evokeds(five[unit] / f"{unit}_ave.fif")}
        row = evokeds["all/RH_before"].ch_names.index("Cz")
        waves.append(1e6 * (evokeds["all/RH_before"].data[row] - evokeds["all/RR_before"].data[row]))
    interval = ttest_1samp(waves, 0).confidence_interval(0.95)
    wave, low, high = panel(figures["erp.png"])
    np.testing.assert_allclose(wave, np.mean(waves, axis=0), atol=1e-4)
    assert (low, high) == pytest.approx((interval.low.min(), interval.high.max()), abs=1e-4)
    assert "nothing shown is significant (p < 0.05 by sign flips over subjects, extreme" in foot(figures["erp.png"])
    assert "its 95% interval" in foot(figures["erp.png"])


def test_a_subject_shows_the_difference_with_welchs_interval(five, draw, figures, tmp_path):
    from scipy.stats import ttest_ind

    draw("erp", "s01", tmp_path, {"erp": SMALL}, erp=five["s01"])
    epochs = read_epochs(five["s01"].parents[1] / "epoch" / "s01" / "s01_epo.fif")
    data = epochs.get_data(copy=True)[:, epochs.ch_names.index("Cz")] * 1e6
    data = subtract_baseline(data, epochs.times, (-0.2, 0.0))
    case = epochs.metadata["condition_before"].to_numpy()
    plus, minus = data[case == "RH"], data[case == "RR"]
    interval = ttest_ind(plus, minus, equal_var=False).confidence_interval(0.95)
    wave, low, high = panel(figures["erp_subject.png"])
    np.testing.assert_allclose(wave, plus.mean(axis=0) - minus.mean(axis=0), atol=1e-4)
    assert (low, high) == pytest.approx((interval.low.min(), interval.high.max()), abs=1e-4)


def test_every_picture_is_drawn_and_the_same_table_gives_the_same_bytes(five, draw, tmp_path):
    for name in ("a", "b"):
        drawn = draw("erp", "group", tmp_path / name, {"erp": SMALL}, erp=five["group"])
        assert drawn == {"erp", "erp_scenarios", "erp_strata"}
        entries = {"erp": five["s01"], "epoch": five["s01"].parents[1] / "epoch" / "s01"}
        drawn = draw("erp", "s01", tmp_path / name / "s01", {"erp": SMALL}, **entries)
        assert drawn == {"erp_subject", "erp_image"}
    files = [path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*.*")]
    assert len(files) == 11
    for path in files:
        assert (tmp_path / "a" / path).read_bytes() == (tmp_path / "b" / path).read_bytes(), path


def test_a_channel_that_is_not_there_gives_way_to_the_nearest_and_the_foot_says_so(five, draw, figures, foot, tmp_path):
    config = dataclasses.replace(SMALL, channel="Fp9", map_times_s=(0.3,))
    for unit, picture in (("group", "erp.png"), ("s01", "erp_subject.png")):
        draw("erp", unit, tmp_path, {"erp": config}, erp=five[unit])
        assert "no channel Fp9, so here is Cz" in foot(figures[picture])
        assert any("Cz (µV)" in axes.get_ylabel() for axes in figures[picture].axes)
        # One map a panel, at the wanted time.
        texts = {text.get_text() for axes in figures[picture].axes for text in axes.texts}
        assert {text for text in texts if text.endswith(" ms")} == {"297 ms"}


def test_a_foreign_study_without_contrasts_shows_its_conditions_alone(study, draw, figures, foot, tmp_path):
    folders = foreign(tmp_path, study)
    draw("erp", "s01", tmp_path / "drawn", {"erp": FOREIGN}, erp=folders["s01"])
    draw("erp", "group", tmp_path / "drawn", {"erp": FOREIGN}, erp=folders["group"])
    assert set(figures) == {"erp_subject.png"}
    figure = figures["erp_subject.png"]
    assert "no channel Cz, so here is Oz" in foot(figure)
    assert [text for text in ("square", "rt") if text in foot(figure)] == ["square", "rt"]


def test_a_foreign_study_is_drawn(study, draw, tmp_path):
    folders = foreign(tmp_path, study)
    assert draw("erp", "s01", tmp_path / "drawn", {"erp": FOREIGN}, erp=folders["s01"]) == {"erp_subject"}
    assert (tmp_path / "drawn" / "erp_subject.png").stat().st_size > 10_000


def test_regressed_averages_and_single_subjects_have_no_bands(study, draw, figures, foot, tmp_path):
    config = dataclasses.replace(SMALL, strata=())
    folders = study(tmp_path, erp, config, 1)
    draw("erp", "group", tmp_path / "drawn", {"erp": config}, erp=folders["group"])
    assert "one subject: not tested" in foot(figures["erp.png"])
    waves = [axes for axes in figures["erp.png"].axes if axes.get_xlim()[0] < 0 and len(axes.lines) > 2]
    assert len(waves) == 2
    assert not any(axes.collections for axes in waves)
    assert "bands" not in foot(figures["erp.png"])


def test_the_erp_image_holds_the_trials_in_the_order_of_the_next_onset(five, draw, figures, tmp_path):
    entries = {"erp": five["s01"], "epoch": five["s01"].parents[1] / "epoch" / "s01"}
    draw("erp", "s01", tmp_path, {"erp": SMALL}, **entries)
    epochs = read_epochs(entries["epoch"] / "s01_epo.fif")
    data = subtract_baseline(epochs.get_data(copy=True)[:, epochs.ch_names.index("Cz")] * 1e6, epochs.times, (-0.2, 0))
    own = (epochs.metadata["condition_before"] == "RH").to_numpy()
    order = np.argsort(epochs.metadata["soa_s"].to_numpy()[own], kind="stable")
    image = figures["erp_image.png"].axes[0]
    table = read_table(tmp_path / "erp_image.parquet", ["contrast", "condition", "channel", "n", "gap_s"])
    lines = read_lists(tmp_path / "erp_image.parquet", "mean_uv")
    rows = (table["condition"] == "RH_before").to_numpy()
    # So few trials are a line each.
    assert set(table["n"]) == {1}
    np.testing.assert_allclose(lines[rows], data[own][order], atol=1e-3)
    np.testing.assert_allclose(image.images[0].get_array(), lines[rows], atol=1e-4)
    np.testing.assert_allclose(image.lines[1].get_xdata(), 1000 * np.sort(epochs.metadata["soa_s"].to_numpy()[own]))
    assert set(table["contrast"]) == {"RH-RR_before"}


def test_without_epochs_the_erp_image_is_left_out(five, draw, figures, tmp_path):
    draw("erp", "s01", tmp_path, {"erp": SMALL}, erp=five["s01"])
    assert set(figures) == {"erp_subject.png"}


def test_the_largest_difference_has_a_map_even_after_the_shortest_gap():
    times = np.arange(-20, 121) / 100
    bumps = [(0.1, 3.0), (0.2, 4.0), (0.3, 5.0), (0.45, 2.0), (0.9, 9.0), (1.1, 8.0)]
    values = sum(size * np.exp(-(((times - at) / 0.02) ** 2)) for at, size in bumps) * np.array([[1.0], [-1.0]])
    shown = erp_panels.PanelSettings(("Cz", "Oz"), times, 0, 0.6, (), 0.95)
    found = [one.time for one in erp_panels._maps(values, None, shown, 0.6)]
    # The largest of all, then the three largest of those before the next onset may fall.
    assert found == pytest.approx([0.1, 0.2, 0.3, 0.9])
    found = [one.time for one in erp_panels._maps(values, None, shown, float("nan"))]
    assert found == pytest.approx([0.2, 0.3, 0.9, 1.1])


def test_the_shown_waves_largest_point_has_a_map_too():
    times = np.arange(-20, 121) / 100
    waves = [(0, 0.8, 6.0), (1, 0.1, 20.0), (1, 0.2, 15.0), (1, 0.3, 12.0), (1, 0.4, 10.0)]
    values = np.zeros((2, len(times)))
    for channel, at, size in waves:
        values[channel] += size * np.exp(-(((times - at) / 0.02) ** 2))
    shown = erp_panels.PanelSettings(("Cz", "Oz"), times, 0, 0.6, (), 0.95)
    assert [m.time for m in erp_panels._maps(values, None, shown, 0.6)] == pytest.approx([0.1, 0.2, 0.3, 0.8])


@pytest.mark.parametrize("at", [-0.15, 0.0, 0.34, 1.0])
def test_one_map_is_at_the_largest_value_of_all_wherever_it_lies_and_names_its_channel(at):
    times = np.arange(-20, 121) / 100
    rng = np.random.default_rng(3)
    values = rng.normal(size=(8, len(times)))
    # A single channel's narrow peak: the SD over channels is largest elsewhere.
    values[:, 50:52] *= 3
    values[5, np.argmin(abs(times - at))] = -12
    shown = erp_panels.PanelSettings(tuple("ABCDEFGH"), times, 0, 0.6, (), 0.95)
    titled = [one for one in erp_panels._maps(values, None, shown, 0.6) if one.title]
    assert [one.time for one in titled] == pytest.approx([at])
    assert titled[0].title == f"{1000 * at:.0f} ms, F".replace("-", "−")
    assert titled[0].values[5] == -12


def test_maps_at_wanted_times_are_at_no_other():
    times = np.arange(-20, 121) / 100
    values = np.exp(-(((times - 0.3) / 0.02) ** 2))[None] * np.array([[1.0], [-2.0]])
    shown = erp_panels.PanelSettings(("Cz", "Oz"), times, 0, 0.6, (0.1, 0.5), 0.95)
    assert [one.time for one in erp_panels._maps(values, None, shown, 0.6)] == pytest.approx([0.1, 0.5])


def test_a_long_foot_goes_on_in_the_next_line_and_stays_within_the_picture(five, draw, figures, tmp_path):
    draw("erp", "group", tmp_path, {"erp": SMALL}, erp=five["group"])
    figure = figures["erp.png"]
    figure.canvas.draw()
    (foot,) = [text for text in figure.texts if "sign flips" in text.get_text()]
    assert "\n" in foot.get_text()
    assert foot.get_window_extent().x1 < figure.bbox.x1
    assert not any(foot.get_window_extent().overlaps(one.get_window_extent()) for one in figure.legends)


def test_an_interval_of_two_subjects_leaves_the_difference_to_be_seen():
    from hrcneuro.figures import erp as figure_of

    wave = np.sin(np.arange(50) / 5)
    for error, cut in ((wave + 0.1, False), (np.full(50, 40.0), True)):
        trace = figure_of.Trace("difference", wave, abs(error), "k")
        panel = figure_of.Panel("x", [figure_of.Trace("a", wave, abs(error), "k")], (), difference=trace)
        assert figure_of.bands([panel])["cut"] == cut
        low, high = figure_of._difference_range([trace])
        assert -3 < low < -1
        assert 1 < high < 3


def test_where_no_channel_has_a_place_there_is_no_line_at_a_maps_time(study, draw, figures, tmp_path):
    config = dataclasses.replace(SMALL, strata=())
    folders = study(tmp_path, erp, config, 2, channels=("E1", "E2", "E3", "E4"))
    draw("erp", "group", tmp_path / "drawn", {"erp": config}, erp=folders["group"])
    upright = [
        line
        for axes in figures["erp.png"].axes
        for line in axes.lines
        if len(line.get_xdata()) == 2 and line.get_xdata()[0] == line.get_xdata()[1] != 0
    ]
    assert not upright


def test_what_people_are_told_of_the_pictures_is_what_is_drawn():
    drawn = drawings.load("erp")
    assert set(drawn.subject.captions) == {"erp_subject.png", "erp_image.png"}
    assert list(drawn.group.captions) == ["erp.png", "erp_scenarios.png", "erp_strata.png"]
