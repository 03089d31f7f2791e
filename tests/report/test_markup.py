"""Templates escape what they are given, and say where they are given too little."""

import pytest
from jinja2 import UndefinedError

from hrcneuro.report.markup import NotedCell, PageTable, minus, render

HOSTILE = """<script>alert("it's me")</script>&"""


def test_text_that_is_data_is_escaped_in_cells_and_in_attributes():
    table = PageTable([HOSTILE], [[HOSTILE], [NotedCell(HOSTILE, HOSTILE)]])
    html = render("chapters/acquire.html", recordings=table)
    assert "<script" not in html
    assert html.count("&lt;script&gt;") == 1 + 2 + 3  # the head, the label of either cell, their texts and the note
    assert "it's" not in html  # it would end an attribute


def test_a_chapter_within_the_page_is_not_escaped_twice():
    inner = render("chapters/acquire.html", recordings=PageTable(["a & b"], [["1 < 2"]]))
    assert "<th>a &amp; b</th>" in inner
    assert "1 &lt; 2" in inner
    assert inner == inner.__html__()


def test_a_table_without_rows_is_nothing_and_what_unfolds_to_nothing_is_left_out():
    assert render("chapters/preprocess.html", replaced=PageTable(["a"], [])).strip() == ""
    assert "<details>" in render("chapters/preprocess.html", replaced=PageTable(["a"], [["b"]]))


def test_a_value_that_a_template_lacks_is_an_error():
    with pytest.raises(UndefinedError, match="replaced"):
        render("chapters/preprocess.html")


def test_a_row_must_fit_its_head():
    with pytest.raises(ValueError, match="2 cells under a head of 1"):
        PageTable(["a"], [["b", "c"]])


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("-0.3 ± 0.4 ms", "−0.3 ± 0.4 ms"),
        ("marker -0.3 ms", "marker −0.3 ms"),
        ("[-39.6, -90.0]", "[−39.6, −90.0]"),
        ("-200 to 0 ms", "−200 to 0 ms"),
        ("trials HH, tr-1 and tr", "trials HH, tr-1 and tr"),
        ("1-40 Hz, 2026-11-30, smoke-9eb5", "1-40 Hz, 2026-11-30, smoke-9eb5"),
        ("--set x.y=-1", "--set x.y=-1"),
        ("-", "-"),
        (-1, -1),
    ],
)
def test_a_negative_number_has_a_minus_and_nothing_else_has(text, shown):
    assert minus(text) == shown
