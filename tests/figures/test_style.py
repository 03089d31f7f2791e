import matplotlib
import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.figure import Figure
from PIL import Image

from hrcneuro.figures.style import DPI, PLACED, STYLE, save


@pytest.fixture
def picture():
    """Return a function that draws the same figure anew: lines, letters, pixels and hatches."""

    def draw(path, style=STYLE):
        with rc_context(style):
            figure = Figure(figsize=(3.0, 2.0))
            axes = figure.subplots()
            axes.plot([0, 1], [0, 1], label="µV")
            axes.pcolormesh(np.arange(12.0).reshape(3, 4) / 10, rasterized=True)
            axes.axvspan(0.2, 0.4, facecolor="none", edgecolor="0.5", hatch="////")
            axes.legend()
            axes.set_title("a figure")
            save(figure, path)
        return path.read_bytes(), path.with_suffix(".pdf").read_bytes()

    return draw


def test_a_figure_is_a_png_of_200_dpi_and_a_pdf_that_name_no_date_and_no_tool(picture, tmp_path):
    _, pdf = picture(tmp_path / "one.png")
    with Image.open(tmp_path / "one.png") as image:
        assert image.size == (3 * DPI, 2 * DPI)
        assert image.info["dpi"] == pytest.approx((200, 200), abs=0.1)
        assert "Software" not in image.info
    assert pdf.startswith(b"%PDF")
    for word in (b"Date", b"Creator", b"Producer", matplotlib.__version__.encode()):
        assert word not in pdf
    assert b"/Type3" not in pdf


@pytest.mark.parametrize("style", [STYLE, PLACED])
def test_a_second_drawing_has_the_same_bytes_whatever_the_readers_own_settings(picture, tmp_path, style, monkeypatch):
    first = picture(tmp_path / "one.png", style)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1")
    own = {"axes.grid": True, "lines.linewidth": 7, "savefig.dpi": 30, "savefig.bbox": "tight", "pdf.fonttype": 3}
    with rc_context({**own, "font.family": "serif", "pdf.compression": 0, "savefig.transparent": True}):
        assert picture(tmp_path / "two.png", style) == first
