"""The pictures of rerp: what they show of the tables."""

import numpy as np
import pytest
from epoch_factory import trial_table

from hrcneuro.figures import rerp as figure_of
from hrcneuro.io.tables import read_lists, read_table
from hrcneuro.stages import rerp
from hrcneuro.tables.rerp import PLAIN, REST, read_parts, read_tested

pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword")

CONTRASTS = {"RH-RR_before": ("RH_before", "RR_before")}
SMALL = rerp.Config(formula="takeover + prev_error", overlap="keep", contrasts=CONTRASTS)


def table():
    rng = np.random.default_rng(7)
    return trial_table(rng, 100).assign(actor="robot", practice=False)


@pytest.fixture(scope="module")
def five(tmp_path_factory, study):
    """The folders of five subjects and their group."""
    return study(tmp_path_factory.mktemp("five"), rerp, SMALL, 5, table=table())


@pytest.fixture
def kept(figures, monkeypatch):
    monkeypatch.setattr(figure_of, "save", lambda figure, path: figures.update({path.name: figure}))
    return figures


def test_every_picture_is_drawn_and_the_same_table_gives_the_same_bytes(five, draw, tmp_path):
    for name in ("a", "b"):
        assert draw("rerp", "group", tmp_path / name, {"rerp": SMALL}, rerp=five["group"]) == {"rerp", "rerp_parts"}
        assert draw("rerp", "s01", tmp_path / name / "s01", {"rerp": SMALL}, rerp=five["s01"]) == {"rerp_subject"}
    files = [path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*.*")]
    assert len(files) == 6
    for name in files:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_a_coefficient_has_the_interval_of_students_t(five, draw, kept, foot, tmp_path):
    from scipy.stats import t

    draw("rerp", "group", tmp_path, {"rerp": SMALL}, rerp=five["group"])
    stats = five["group"] / "rerp_stats.parquet"
    rows = read_table(stats)
    at = int(np.flatnonzero((rows["coefficient"] == "takeover") & (rows["channel"] == "Cz"))[0])
    mean, sd = (read_lists(stats, name)[at] for name in ("difference_uv", "sd_uv"))
    drawn = (axes for axes in kept["rerp.png"].axes if axes.get_legend())
    axes = next(axes for axes in drawn if "takeover" in str(axes.get_legend().get_texts()[0]))
    wave = next(line.get_ydata() for line in axes.lines if len(line.get_xdata()) > 2)
    np.testing.assert_allclose(wave, mean, atol=1e-4)
    band = axes.collections[-1].get_paths()[0].vertices[:, 1]
    half = t.ppf(0.975, 4) * sd / np.sqrt(5)
    assert band.max() == pytest.approx((mean + half).max(), abs=1e-3)
    assert "95% intervals" in foot(kept["rerp.png"])


def test_no_picture_has_the_intercept(five, draw, kept, foot, tmp_path):
    draw("rerp", "group", tmp_path, {"rerp": SMALL}, rerp=five["group"])
    titles = foot(kept["rerp.png"])
    assert "takeover" in titles
    assert "Intercept" not in titles
    assert ("all", "Intercept") in {("all", name) for _, name in read_tested(five["group"] / "rerp_stats.parquet").maps}


def test_the_lines_of_parts_add_up_to_the_black_one(five, draw, kept, tmp_path):
    draw("rerp", "group", tmp_path, {"rerp": SMALL}, rerp=five["group"])
    parts = read_parts(five["group"] / "rerp_parts.parquet", ["Cz"])
    shown = [axes for axes in kept["rerp_parts.png"].axes if axes.get_visible()]
    assert [axes.get_title(loc="left") for axes in shown] == ["iC: RH-RR_before", "sC: RH-RR_before"]
    for axes in shown:
        lines = {line.get_label(): line.get_ydata() for line in axes.lines if len(line.get_xdata()) > 2}
        plain = lines.pop("plain difference")
        np.testing.assert_allclose(sum(lines.values()), plain, atol=1e-4)
        assert set(lines) == {"takeover", "prev_error", "rest: overlap and misfit"}
    assert {part.name for part in parts} == {PLAIN, REST, "takeover", "prev_error"}


def test_a_study_without_contrasts_has_no_picture_of_parts(study, draw, tmp_path):
    config = rerp.Config(formula="takeover", overlap="keep", contrasts={}, split="")
    folders = study(tmp_path / "study", rerp, config, 2, table=table())
    assert draw("rerp", "group", tmp_path / "out", {"rerp": config}, rerp=folders["group"]) == {"rerp"}
