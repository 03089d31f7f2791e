"""The first use of a word is marked, once, where a link may stand; nothing else of the page changes."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.report.glossary import TERMS, mark, terms

ALL = terms(of_task=True)
FORMS = [form for term in TERMS for form in (term.name, *term.forms)]


@pytest.mark.parametrize("form", FORMS)
def test_the_first_use_of_a_word_leads_to_its_meaning_and_the_second_does_not(form):
    html = mark(f"<p>{form} and {form}</p>", ALL)
    assert html.count("<a ") == 1
    assert html.index("<a ") < html.index(" and ")
    (target,) = re.findall("href='#(term-[a-z0-9_-]+)'", html)
    (term,) = [one for one in TERMS if form in (one.name, *one.forms)]
    assert target == term.anchor


def test_anchors_and_words_are_unique():
    assert len({term.anchor for term in TERMS}) == len(TERMS)
    assert len(set(FORMS)) == len(FORMS)


@pytest.mark.parametrize("tag", ["a", "svg", "pre", "summary"])
def test_nothing_is_marked_inside_links_pictures_and_titles(tag):
    html = f"<{tag}>TNR</{tag}>"
    assert mark(html, ALL) == html
    assert mark(f"{html} TNR", ALL).startswith(html)


@pytest.mark.parametrize("text", ["RH-RR_before", "xTNR", "TNRs", "HR_after", "the.tr"])
def test_a_word_within_another_is_not_marked(text):
    assert mark(text, ALL) == text


def test_attributes_are_left_alone():
    html = "<td data-l='TNR (%)'><img alt='ERP of RH'></td>"
    assert mark(html, ALL) == html


@given(st.lists(st.sampled_from([*FORMS, "<b>", "</b>", "&amp;", " ", "word", "<br>"]), max_size=12))
def test_marking_adds_links_and_changes_no_text(parts):
    html = " ".join(parts)
    assert re.sub(r"</?a[^>]*>", "", mark(html, ALL)) == html


def test_another_study_has_no_words_of_the_task():
    names = {term.name for term in terms(of_task=False)}
    assert not names & {"sC", "iC", "HH", "RH", "tr"}
    assert {"TNR", "TPR", "ERP", "LOBO"} <= names
