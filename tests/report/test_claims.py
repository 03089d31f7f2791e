"""Every number of the paper has a place, a class and, where it is a result, a measure and a verdict."""

import re
import string
from pathlib import Path

import pytest

from hrcneuro.config import settings as config
from hrcneuro.pipeline.item import Item, State
from hrcneuro.published import CHANCE, TABLE_2
from hrcneuro.report import facts
from hrcneuro.report.claims import CLAIMS, measure, rows
from hrcneuro.report.parameters import BY_DESIGN, PARAMETERS, SETUP
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import AGREES, CHOSEN, DIFFERS, MISSING, OPEN, PLANTED, VERDICTS

ROOT = Path(__file__).parents[2]
PAPER = ROOT.parent / "shared/paper/ehrlich2023.md"
SUBJECTS = [f"s{i:02d}" for i in range(1, 13)]
# The excluded one keeps its name.
SHUFFLED = ["s02", "s03", "s04", "s05", "s06", "s01", "s07", *(f"s{i:02d}" for i in range(12, 7, -1))]


def item(stage, unit, summary):
    return Item(stage, unit, key="k", state=State.HIT, summary=summary)


def decoded(acc=None, chance=CHANCE.value):
    """Return decode summaries that hold Table 2's means, or another accuracy for RR against RH in iC."""
    cells = {}
    for (scenario, problem), printed in TABLE_2.items():
        rates = {name: rate.value.mean for name, rate in printed.items()} | {"bacc": 50.0, "chance": chance}
        if acc is not None and (scenario, problem) == ("iC", "RRvsRH"):
            rates |= {"tnr": acc, "tpr": acc, "acc": acc}
        cells.setdefault(scenario, {})[problem] = rates
    return cells


def by_group(acc=None):
    """Return the summary of decode's group: the printed means, and p values that fit them."""
    cells = decoded(acc)
    for one in (cell for problems in cells.values() for cell in problems.values()):
        one["p_above_chance"] = {rate: 0.01 if one[rate] > CHANCE.value else 0.6 for rate in ("tnr", "tpr", "acc")}
    return cells


def kind(real):
    return "real" if real else "synthetic"


def study(*, eeg=False, behaviour=False, logs="", acc=None, chance=CHANCE.value, subjects=SUBJECTS, assignments=()):
    settings = config.load(None, [f"study.subjects={subjects}", *assignments])
    included = [s for s in subjects if s != "s07"]
    named = dict(zip(subjects, logs or [""] * len(subjects), strict=True))
    items = [
        item("acquire", s, {"origin": {"eeg": kind(eeg), "behaviour": kind(behaviour), "log": log}})
        for s, log in named.items()
    ]
    items += [item("decode", s, decoded(acc, chance)) for s in included] + [item("decode", "group", by_group(acc))]
    return {row.quantity: row for row in rows(Results(settings, items)) if row.kind == "result"}


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_every_row_has_place_quantity_and_class():
    found = rows(Results(config.load(None), []))
    assert {row.kind for row in found} == {"result", "parameter", "setup"}
    assert all(row.place and row.quantity and row.published for row in found)
    assert all((row.verdict in VERDICTS) == (row.kind == "result") for row in found)
    assert len({claim.key for claim in CLAIMS}) == len(CLAIMS)


def test_every_parameter_that_can_be_read_has_a_value_of_this_run():
    settings = config.load(None)
    about = facts.gather(Results(settings, []))
    for given in (*SETUP, *PARAMETERS):
        for _, name, _, _ in string.Formatter().parse(given.ours):
            assert name is None or name.split(".")[0] in {"run", *settings.sections}, given
            if name and name.startswith("run."):
                assert hasattr(about, name.removeprefix("run.")), given


def test_what_no_run_measures_does_not_look_measured():
    for given in (*SETUP, *PARAMETERS):
        parsed = list(string.Formatter().parse(given.ours))
        if not any(name for _, name, _, _ in parsed):
            assert given.ours == "" or given.ours.startswith(BY_DESIGN), given


def test_the_numbers_of_the_paper_are_all_there():
    if not PAPER.is_file():
        pytest.skip("the paper's text is not at hand")
    text = PAPER.read_text(encoding="utf-8")
    text = text[text.index("## Abstract") : text.index("## Supporting information")]
    # What is no number of the study: citations, links, and names of sections, figures and equations.
    text = re.sub(r"<[^>]+>|https?://\S+|\[[\d–,\s]+\]|\(?#[\w-]+\)?", "", text)
    text = re.sub(r"[Ss]ections? [\d.]+|Figs? \d[A-D]?( and \d?[A-D])*|Table \d|Eqs? ?\[?\\?\(?\d\)?", "", text)
    text = re.sub(r"SIM\d(–\d)?|S\d Appendix|P300|^#+ .*$|^\*\*[\d.]+ [^*]*\*\*", "", text, flags=re.M)
    ours = " ".join(f"{one.printed.text} {one.printed.quantity}" for one in (*SETUP, *PARAMETERS, *CLAIMS))
    numbers = re.compile(r"\d+(?:\.\d+)?")
    assert set(numbers.findall(text)) - set(numbers.findall(ours)) == set()


def test_nothing_is_claimed_before_anything_has_run():
    found = rows(Results(config.load(None), []))
    assert {row.verdict for row in found if row.kind == "result"} == {MISSING}


@pytest.mark.parametrize(
    ("real", "acc", "expected"),
    [
        (dict(eeg=True, behaviour=True), None, AGREES),
        (dict(eeg=True, behaviour=True), 50.0, DIFFERS),
        (dict(eeg=False, behaviour=True), None, PLANTED),
        (dict(eeg=False, behaviour=False), None, PLANTED),
        (dict(eeg=False, behaviour=False), 50.0, DIFFERS),
    ],
)
def test_table_2_on_each_kind_of_data(real, acc, expected):
    found = study(**real, acc=acc)
    assert found["ACC, RRvsRH, iC"].verdict == expected
    for rate in ("ACC", "TNR", "TPR"):
        assert found[f"RRvsRH, iC, {rate}"].verdict == expected


def test_above_chance_is_what_the_test_over_subjects_finds_not_what_a_mean_exceeds():
    cells = by_group()
    cells["iC"]["RRvsRH"]["p_above_chance"]["tpr"] = 0.2  # 56.1 %, but not of every subject
    items = [item("acquire", s, {"origin": {"eeg": "real", "behaviour": "real"}}) for s in SUBJECTS]
    settings = config.load(None, [f"study.subjects={SUBJECTS}"])
    found = {row.quantity: row for row in rows(Results(settings, [*items, item("decode", "group", cells)]))}
    assert found["RRvsRH, iC, TPR"].verdict == DIFFERS
    assert found["RRvsRH, iC, TNR"].verdict == AGREES
    assert "56.1 %, chance 54.3 %, p = 0.2" in found["RRvsRH, iC, TPR"].ours


def test_a_row_says_where_guessing_would_agree_with_it_and_where_its_reading_was_chosen():
    found = study(eeg=True, behaviour=True)
    named = {(scenario, problem, name) for (scenario, problem), rates in TABLE_2.items() for name in rates}
    guessed = {one for one in named if "guessing" in found[f"{one[2].upper()}, {one[1]}, {one[0]}"].why}
    assert len(named) == 12
    assert len(guessed) == 7
    assert ("iC", "RRvsRH", "acc") not in guessed
    chosen = {row.quantity for row in found.values() if row.verdict == CHOSEN}
    assert chosen == {"chance level", *(f"{rate}, HHvsHR, sC" for rate in ("TNR", "TPR", "ACC"))}


@pytest.mark.parametrize("nothing", ["acquire.eeg.effect=none", "acquire.eeg.effect_uv=0"])
@pytest.mark.parametrize("acc", [None, 50.0])
def test_a_simulation_without_effect_cannot_tell_of_the_effect(nothing, acc):
    found = study(eeg=False, behaviour=True, acc=acc, assignments=[nothing])
    for what in ("ACC, RRvsRH, iC", "TPR, RRvsRH, iC", "RRvsRH, iC, ACC", "ACC, RRvsRH, sC"):
        assert found[what].verdict == OPEN
        assert "no such effect" in found[what].why
    assert found["RRvsRH, sC, ACC"].verdict == PLANTED
    assert found["ACC, HHvsHR, iC"].verdict == PLANTED
    assert study(eeg=True, behaviour=True, assignments=[nothing])["ACC, RRvsRH, iC"].verdict == AGREES


def test_an_effect_in_ic_alone_is_planted_there_alone():
    found = study(eeg=False, behaviour=True, assignments=["acquire.eeg.sequential_share=0"])
    assert found["ACC, RRvsRH, iC"].verdict == PLANTED
    assert found["ACC, RRvsRH, sC"].verdict == OPEN


def test_the_chance_level_rests_on_the_logs_not_on_the_eeg():
    assert study(eeg=False, behaviour=True)["chance level"].verdict == CHOSEN
    assert study(eeg=False, behaviour=False)["chance level"].verdict == PLANTED


@pytest.mark.parametrize(
    ("logs", "chance", "expected"),
    [
        (SUBJECTS, 54.27, CHOSEN),
        (SUBJECTS, 54.0, DIFFERS),
        (SHUFFLED, 54.0, DIFFERS),  # the same logs under other names
        (["s01"] * 12, 54.0, CHOSEN),
        ("", 54.0, CHOSEN),
        ("", 53.0, DIFFERS),
    ],
)
def test_the_papers_own_logs_must_give_the_printed_chance_level_to_the_digit(logs, chance, expected):
    found = study(eeg=True, behaviour=True, logs=logs, chance=chance)
    assert found["chance level"].verdict == expected


def test_a_stage_that_ran_is_told_from_one_that_did_not():
    found = study(eeg=True, behaviour=True)
    assert found["steps from start to goal"].verdict == OPEN  # acquired, without trials
    assert found["epochs of the others excluded for their amplitude"].verdict == MISSING
    assert found["SIM2: a decoder of 50 %"].verdict == MISSING


def test_a_short_study_claims_nothing():
    found = study(eeg=True, behaviour=True, subjects=["s01", "s02", "s03"])
    assert found["ACC, RRvsRH, iC"].verdict == OPEN
    assert "3 subjects" in found["ACC, RRvsRH, iC"].why


def test_a_study_of_something_else_has_no_published_table():
    other = ['study.split=""', 'problems.other=["HH_before", "RH_before"]']
    assert rows(Results(config.load(None, other), [])) == []


def test_every_claim_has_a_measure_and_every_measure_a_claim(smoke_items):
    results = Results(config.load(ROOT / "configs/smoke.toml"), smoke_items)
    assert set(measure(results)) == {claim.key for claim in CLAIMS}
