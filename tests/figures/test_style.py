import re
import zlib
from io import BytesIO

import matplotlib
import numpy as np
import pytest
from fontTools.subset import Options
from fontTools.ttLib import TTFont
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


@pytest.mark.parametrize("style", [STYLE, PLACED])
def test_the_files_are_those_of_savefig_without_its_trial_drawing(picture, tmp_path, style, monkeypatch):
    """The same pixels; of the PDF, the same but for what its fonts hold."""
    monkeypatch.setattr("hrcneuro.figures.style._RULES", ())
    found = picture(tmp_path / "one.png", style)
    monkeypatch.setattr(f"{__name__}.save", by_savefig)
    assert picture(tmp_path / "two.png", style) == found


def by_savefig(figure, path):
    with rc_context(STYLE):
        figure.savefig(path, dpi=DPI, metadata={"Software": None}, pil_kwargs={"compress_level": 3})
        figure.set_layout_engine("none")
        nothing = {"CreationDate": None, "Creator": None, "Producer": None}
        figure.savefig(path.with_suffix(".pdf"), dpi=DPI, metadata=nothing)


def test_a_pdfs_fonts_hold_outlines_and_no_rules_of_scripts(picture, tmp_path):
    _, pdf = picture(tmp_path / "one.png")
    streams = [
        zlib.decompressobj().decompress(part) for part in re.findall(rb"stream\n(x.*?)endstream", pdf, re.DOTALL)
    ]
    fonts = [TTFont(BytesIO(stream)) for stream in streams if stream.startswith(b"\x00\x01\x00\x00")]
    assert fonts
    for font in fonts:
        assert "glyf" in font
        assert not {"GSUB", "GPOS", "GDEF", "MATH", "kern"} & set(font.keys())
    assert not {"GSUB", "GPOS"} & set(Options().drop_tables), "what others draw keeps them"
