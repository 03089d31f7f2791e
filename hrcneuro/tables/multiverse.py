"""The tables of a multiverse: what each universe has to say on each finding, what it chose, and what that comes to."""

from __future__ import annotations

from hrcneuro.io.tables import Column, Table

_FINDING = {
    "finding": Column("category", "", "of the paper, by a short name"),
    "place": Column("category", "", "where the paper prints it"),
    "quantity": Column("category", "", "what it is"),
    "published": Column("category", "", "what the paper prints"),
}
_UNIT = Column("category", "", "unit of value")
VERDICTS = Table(
    2,
    "one row a universe and finding",
    {
        "universe": Column("int", "", "number of the universe; 0 is the study's own"),
        "analysis": Column(
            "int", "", "the first universe that does the same for this finding; a row that names itself counts"
        ),
        "chain": Column(
            "int", "", "number of its preprocessing chain; universes of a chain share the clean recordings"
        ),
        "choices": Column("category", "", "what it chose otherwise than the study"),
        **_FINDING,
        "ours": Column("string", "", "this universe's figure, as the report has it"),
        "value": Column("float", "", "a number of it; null where it has none"),
        "unit": _UNIT,
        "fits": Column("category", "", "fits, differs or cannot tell: whether it meets the report's criterion"),
        "verdict": Column("category", "", "the report's verdict, which also asks what the data are worth"),
        "why": Column("category", "", "the criterion, or the reason"),
    },
)
UNIVERSES = Table(
    1,
    "one row a universe and choice",
    {
        "universe": Column("int", "", "number of the universe; 0 is the study's own"),
        "chain": Column("int", "", "number of its preprocessing chain"),
        "choice": Column("category", "", "what could have been chosen otherwise"),
        "value": Column("category", "", "name of the value that was taken"),
        "own": Column("bool", "", "it is the study's own"),
        "judged": Column("bool", "", "the universe came to an end"),
    },
)
SUMMARY = Table(
    2,
    "one row a finding",
    {
        **_FINDING,
        "unit": _UNIT,
        "study": Column("category", "", "what the study's own universe has to say: fits, differs or cannot tell"),
        "analyses": Column("int", "", "universes, those that do the same for this finding once"),
        "fits": Column("int", "", "analyses in which it fits"),
        "differs": Column("int", "", "analyses in which it differs"),
        "open": Column("int", "", "analyses that cannot tell"),
        "share": Column("float", "", "that fit, of those that fit or differ"),
        "value": Column("float", "", "the study's own value"),
        "low": Column("float", "", "least value of a universe"),
        "high": Column("float", "", "largest value of a universe"),
        "choice": Column("category", "", "that moves it most; null where none does"),
        "flips": Column(
            "float", "", "share of the pairs of analyses that differ in that choice alone in which one fits"
        ),
        "moved": Column("float", "", "mean absolute difference of their values"),
        "pairs": Column("int", "", "how many of these pairs there are"),
    },
)
INFLUENCE = Table(
    1,
    "one row a finding and choice",
    {
        "finding": _FINDING["finding"],
        "choice": Column("category", "", "what could have been chosen otherwise"),
        "pairs": Column("int", "", "pairs of analyses that differ in this choice alone"),
        "flips": Column("float", "", "share of them in which one fits and one differs"),
        "moved": Column("float", "", "mean absolute difference of their values"),
        "most": Column("float", "", "largest absolute difference"),
    },
)
