"""The words that a reader of the page may not know: what each means, and its first use in every chapter marked."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from markupsafe import Markup


class Term(NamedTuple):
    """A word or abbreviation.

    Attributes:
        name: As it stands in the page.
        meaning: In a sentence.
        of_task: Whether it belongs to the study's task, so that other studies do not use it.
        forms: Other spellings.
    """

    name: str
    meaning: str
    of_task: bool = False
    forms: tuple[str, ...] = ()

    @property
    def anchor(self) -> str:
        """Where the glossary explains it."""
        return "term-" + re.sub(r"\W+", "-", self.name.replace("−", "-")).strip("-").lower()


TERMS = (
    Term("sC", "sequential collaboration: who moves depends on the tile; each partner has an area of the grid.", True),
    Term("iC", "intermittent collaboration: who moves depends on the direction; each partner has two of four.", True),
    Term("HH", "a move of the human after a move of the human: no takeover.", True),
    Term("HR", "a move of the robot after a move of the human: the robot takes over.", True),
    Term("RR", "a move of the robot after a move of the robot: no takeover.", True),
    Term("RH", "a move of the human after a move of the robot: the human takes over.", True),
    Term(
        "tr−1",
        "the move before a takeover, or before none; EEG around it may show expectation.",
        True,
        ("tr-1",),
    ),
    Term("tr", "the move that is the takeover, or that goes on as before.", True),
    Term("HHvsHR", "the decoding problem that tells, from EEG around tr−1, HR from HH.", True),
    Term("RRvsRH", "the decoding problem that tells, from EEG around tr−1, RH from RR.", True),
    Term("prev_error", "whether the move before was a mistake: a cue that tells a takeover without EEG.", True),
    Term("SOA", "stimulus onset asynchrony: the time from the onset of one move to the onset of the next."),
    Term(
        "TNR",
        "true negative rate: the share of trials of class 1 (in the paper: without takeover) that a decoder calls so.",
    ),
    Term(
        "TPR",
        "true positive rate: the share of trials of class 2 (in the paper: with takeover) that a decoder calls so.",
    ),
    Term("ACC", "accuracy: the share of all trials that a decoder calls right; more trials of a class weigh more."),
    Term("balanced accuracy", "the mean of TNR and TPR; 50 % is guessing.", forms=("balanced", "Balanced")),
    Term("AUC", "area under the curve of TPR over false positives, in %: 50 is guessing, 100 is perfect."),
    Term("LOBO", "leave one block out: the decoder is tested on a block of trials of which it has learned nothing."),
    Term("chance", "the accuracy that guessing reaches in 5 % of all tries, from the number of trials alone."),
    Term("Holm", "a correction of p values for the number of tests made."),
    Term("sign flips", "a test that asks how often random signs of the subjects' values give as large a mean."),
    Term("permutation", "a test that asks how often shuffled labels are decoded as well."),
    Term("ERP", "event-related potential: the mean EEG after an event, in µV.", forms=("ERPs",)),
    Term("ERSP", "event-related spectral perturbation: how strong each rhythm is after an event.", forms=("ERSPs",)),
    Term("EOG", "electro-oculogram: electrodes beside the eyes, by which eye movements are removed from the EEG."),
    Term("kurtosis", "how heavy the tails of a channel's amplitudes are; jumps and jolts make it large."),
    Term("rlda", "regularised linear discriminant analysis: the decoder of the paper."),
)


def terms(*, of_task: bool) -> list[Term]:
    """Return the entries of a page's glossary; those of the task only where it is the study's task."""
    return [term for term in TERMS if of_task or not term.of_task]


_TAG = re.compile(r"(<[^>]*>)")
# Where no link may stand, or what is read letter by letter.
_CLOSED = ("a", "svg", "pre", "summary", "script", "style")


def mark(html: Markup | str, entries: Sequence[Term]) -> Markup:
    """Return HTML in which the first use of every term leads to the glossary, and says in a hint what it means."""
    from markupsafe import Markup

    left = {form: term for term in entries for form in (term.name, *term.forms)}
    inside: list[str] = []
    parts = []
    for part in _TAG.split(str(html)):
        if part.startswith("<"):
            _follow(part, inside)
        elif not inside:
            part = _marked(part, left)
        parts.append(part)
    return Markup("".join(parts))  # html is safe already, and what is added is escaped


def _follow(tag: str, inside: list[str]) -> None:
    """Note the start or end of an element in which nothing is marked."""
    name = re.split(r"[\s>/]", tag.lstrip("</"), maxsplit=1)[0]
    if name in _CLOSED:
        inside.pop() if tag.startswith("</") else inside.append(name)


def _marked(text: str, left: dict[str, Term]) -> str:
    from markupsafe import escape

    def link(found: re.Match[str]) -> str:
        term = left.get(found[0])
        if term is None:
            return found[0]
        for form in (term.name, *term.forms):
            del left[form]
        return f"<a class='term' href='#{term.anchor}' title='{escape(term.meaning)}'>{found[0]}</a>"

    if not left or not text.strip():
        return text
    known = "|".join(re.escape(form) for form in sorted(left, key=len, reverse=True))
    return re.sub(rf"(?<![\w.-])(?:{known})(?![\w-])", link, text)
