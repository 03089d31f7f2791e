"""The pictures of erp: what they show of the tables."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

from hrcneuro import drawings
from hrcneuro.eeg.evoked import subtract_baseline
from hrcneuro.io.fif import read_epochs, read_evokeds
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
    assert "p < 0.05 by sign flips over subjects, extreme statistics" in foot(figures["erp.png"])
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
        assert draw("erp", "s01", tmp_path / name / "s01", {"erp": SMALL}, erp=five["s01"]) == {"erp_subject"}
    files = [path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*.*")]
    assert len(files) == 8
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


def test_what_people_are_told_of_the_pictures_is_what_is_drawn():
    drawn = drawings.load("erp")
    assert set(drawn.subject.captions) == {"erp_subject.png"}
    assert list(drawn.group.captions) == ["erp.png", "erp_scenarios.png", "erp_strata.png"]
