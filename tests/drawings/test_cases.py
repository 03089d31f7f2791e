"""Figs 2 and 3: what they show of erp's and ersp's tables, and where the next onset may fall."""

import dataclasses
import re

import numpy as np
import pytest

from hrcneuro.eeg.selection import shortest_gap_s
from hrcneuro.io.fif import read_epochs
from hrcneuro.io.tables import read_lists, read_table
from hrcneuro.stages import erp, ersp

pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword")

SECTIONS = {"erp": erp.Config(strata=()), "ersp": ersp.Config(strata=(), high_hz=8.0)}


@pytest.fixture(scope="module")
def groups(tmp_path_factory, study):
    """The group's folders of erp and of ersp, over three subjects."""
    folder, options = tmp_path_factory.mktemp("cases"), dict(n=120, sfreq=64.0, effect_uv=30)
    return {stage.STAGE.name: study(folder, stage, SECTIONS[stage.STAGE.name], 3, **options) for stage in (erp, ersp)}


@pytest.fixture
def fig2(groups, draw, figures, tmp_path):
    draw("cases", "group", tmp_path, SECTIONS, **{name: folders["group"] for name, folders in groups.items()})
    assert set(figures) == {"fig2.png", "fig3.png"}
    return figures["fig2.png"]


def waves(figure):
    return [axes for axes in figure.axes if "µV)" in axes.get_ylabel()]


def test_fig_2_hatches_potentials_and_rhythms_from_the_shortest_gap_on(fig2, groups):
    folder = groups["erp"]["group"].parents[1] / "epoch"
    shortest = min(shortest_gap_s(read_epochs(path).metadata) for path in folder.rglob("*_epo.fif"))
    assert 0.5 < shortest < 1
    shaded = [*waves(fig2), *(axes for axes in fig2.axes if axes.get_xlabel().startswith("time"))]
    assert len(shaded) == 8
    for axes in shaded:
        (patch,) = [p for p in axes.patches if p.get_hatch()]
        spans = patch.get_path().vertices[:, 0]
        assert spans.min() == pytest.approx(1000 * shortest, abs=1)
        assert spans.max() == pytest.approx(axes.get_xlim()[1], abs=1)
    (legend,) = fig2.legends
    assert f"{1000 * shortest:.0f} ms" in " ".join(text.get_text() for text in legend.get_texts())


def test_fig_2_shows_a_channels_means_over_the_contrasts_own_subjects(fig2, groups):
    stats = groups["erp"]["group"] / "erp_stats.parquet"
    keys = read_table(stats, ["scenario", "contrast", "channel"])
    (at,) = (i for i, key in enumerate(keys.itertuples(index=False)) if key == ("all", "RH-RR_before", "Cz"))
    axes = waves(fig2)[2]
    by_label = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(by_label["RH"], read_lists(stats, "plus_uv")[at])
    np.testing.assert_allclose(by_label["RR"], read_lists(stats, "minus_uv")[at])
    assert axes.get_legend().get_title().get_text() == "n = 3"


def test_the_foot_names_the_tests_of_potentials_and_rhythms_where_they_differ(
    fig2, groups, draw, figures, foot, tmp_path
):
    assert "extreme statistics" in foot(fig2)
    assert "rhythms" not in foot(fig2)
    sections = SECTIONS | {"ersp": dataclasses.replace(SECTIONS["ersp"], correction="cluster")}
    draw("cases", "group", tmp_path, sections, **{name: folders["group"] for name, folders in groups.items()})
    assert re.search("potentials: .*extreme statistics.*; rhythms: .*clusters", foot(figures["fig3.png"]))


def test_without_ersp_the_potentials_stand_alone(groups, draw, figures, foot, tmp_path):
    sections = SECTIONS | {"erp": dataclasses.replace(SECTIONS["erp"], channel="Fp9")}
    draw("cases", "group", tmp_path, sections, erp=groups["erp"]["group"])
    texts = [text.get_text() for axes in figures["fig3.png"].axes for text in axes.texts]
    assert texts.count("ersp has not run") == 2
    assert "no channel Fp9, so here is Cz" in foot(figures["fig3.png"])


def test_a_study_of_other_contrasts_has_neither_figure(study, draw, figures, tmp_path):
    config = dataclasses.replace(SECTIONS["erp"], contrasts={"x": ("RH_before", "RR_before")})
    folders = study(tmp_path, erp, config, 2, sfreq=64.0)
    draw("cases", "group", tmp_path / "drawn", SECTIONS, erp=folders["group"])
    assert figures == {}
