"""What a plan and a status say: one vocabulary, a line a task, the first cause and a count of the rest."""

import io
import sys

import pytest

from hrcneuro.cli import plan
from hrcneuro.cli.console import Console
from hrcneuro.errors import DataError
from hrcneuro.pipeline.item import Item, State, Word


def item(stage, unit, state, *why, before=False, draws=False):
    return Item(stage, unit, draws, state=state, why=list(why), before=before)


ITEMS = [
    item("acquire", "s01", State.HIT, before=True),
    item("acquire", "s02", State.FAILED, "no such file"),
    item("epoch", "s01", State.WOULD_RUN, "params: a 1 -> 2", "code: x", "code: y", before=True),
    item("epoch", "s02", State.BLOCKED, "inputs: acquire of s02 failed"),
    item("erp", "s01", State.WOULD_RUN, "inputs: epoch of s01 would run"),
    item("erp.figures", "s01", State.WOULD_RUN, "inputs: erp of s01 would run", draws=True),
    item("acquire.figures", "s01", State.WOULD_RUN, "never run", draws=True),
]


@pytest.mark.parametrize("state", State)
@pytest.mark.parametrize("before", [False, True])
def test_every_state_has_one_word_of_the_vocabulary(state, before):
    assert item("epoch", "s01", state, before=before).word in Word


def test_a_task_is_a_line_with_its_first_cause_and_a_count_of_the_rest():
    assert [text for text, _ in plan.lines(ITEMS)] == [
        # What it failed of is told behind, with its cure.
        "acquire          s02  failed",
        "epoch            s01  stale      params: a 1 -> 2 (and 2 more)",
        "epoch            s02  never run  inputs: acquire of s02 failed",
        "erp              s01  never run  inputs: epoch of s01 is not fresh",
        # Its numbers are fresh: that it is drawn would else be a surprise.
        "acquire.figures  s01  never run",
    ]


def test_who_asks_for_more_is_told_every_task_and_every_cause():
    told = [text for text, _ in plan.lines(ITEMS, verbose=True)]
    assert len(told) == len(ITEMS)
    assert any("params: a 1 -> 2; code: x; code: y" in text for text in told)


def test_a_status_has_one_line_for_all_units_that_stand_alike():
    units = [f"s{i:02d}" for i in range(1, 13)]
    items = [item("erp", unit, State.WOULD_RUN, f"inputs: epoch of {unit} would run") for unit in units]
    assert [text for text, _ in plan.merged(items)] == [
        "erp  s01 … s12, 12 units  never run  inputs: epoch of each is not fresh"
    ]


def test_what_failed_is_told_once_by_a_status_and_by_a_plan(capsys):
    items = [failed(f"s{i:02d}", "no such folder") for i in range(1, 4)]
    for tell in (Console().status, Console().planned):
        tell(items)
        assert Console().finish("status", items, planned=True) == 3
        said = capsys.readouterr()
        assert (said.out + said.err).count("no such folder") == 1
        assert said.out.count("failed") == 4  # a word a task, and the count


def test_the_table_has_the_same_words_and_fits_a_narrow_terminal():
    wide = plan.table(ITEMS)
    assert wide[0].split() == ["unit", "acquire", "epoch", "erp"]
    assert wide[1].split() == ["s01", "fresh*", "stale", "never", "run"]
    assert "pictures" in wide[-1]
    narrow = plan.table(ITEMS, width=30)
    assert narrow[0].split() == ["s01", "fresh*:", "acquire"]
    assert sum("epoch" in line for line in narrow) == 2


def test_counts_add_up_to_all_tasks():
    assert plan.counted(ITEMS) == "1 fresh, 1 stale, 2 never run, 1 failed; pictures: 2 never run"
    assert plan.counted([]) == "nothing to do"


def failed(unit, text):
    one = item("acquire", unit, State.FAILED)
    one.fail(DataError(text, cure="look there"))
    return one


def test_twelve_subjects_that_fail_of_one_cause_get_one_message(capsys):
    items = [failed(f"s{i:02d}", f"no recording of s{i:02d} in data/s{i:02d}") for i in range(1, 13)]
    assert Console().finish("acquire", items) == 3
    told = capsys.readouterr().err
    assert told.count("error:") == 1
    assert "s01 … s12, 12 units (this is of s01): no recording of s01 in data/s01" in told


def test_another_cause_is_another_message(capsys):
    Console().finish("acquire", [failed("s01", "no recording of s01"), failed("s02", "no log of s02")])
    assert capsys.readouterr().err.count("error:") == 2


def test_a_plan_is_on_standard_output_and_beside_json_it_is_talk(capsys):
    Console().planned(ITEMS)
    assert Console().finish("epoch", ITEMS[:1], planned=True) == 0
    told = capsys.readouterr()
    assert "epoch: 1 fresh" in told.out
    assert told.err == ""
    Console(as_json=True).planned(ITEMS)
    told = capsys.readouterr()
    assert told.out == ""
    assert "stale" in told.err


class Screen(io.StringIO):
    def isatty(self):
        return True

    def fileno(self):
        return 1


def test_what_a_terminal_is_too_narrow_for_goes_on_further_in(monkeypatch):
    monkeypatch.setattr(sys, "stdout", Screen())
    monkeypatch.setattr("os.get_terminal_size", lambda number: type("Size", (), {"columns": 40}))
    Console().results(["  " + "word " * 20])
    lines = sys.stdout.getvalue().splitlines()
    assert len(lines) > 1
    assert max(map(len, lines)) <= 40
    assert all(line.startswith("      word") for line in lines[1:])
    monkeypatch.setattr(sys, "stdout", Screen())
    Console().results(["12.5 % " * 20])
    assert all(line.strip().endswith("%") for line in sys.stdout.getvalue().splitlines())


def test_what_was_sent_to_a_worker_again_is_named_in_the_end_and_what_is_missing_among_the_errors(capsys):
    late = item("erp", "s01", State.RAN)
    late.lost = ("its 10 min ran out", "its node failed")
    gone = item("erp", "s02", State.FAILED)
    gone.lost, gone.error = ("its node failed",), DataError("erp of s02 is missing: its node failed")
    others = [item("erp", "s03", State.RAN), item("erp", "s04", State.HIT)]
    assert Console().finish("erp", [late, gone, *others]) == 3
    said = capsys.readouterr().err.splitlines()
    assert said[0] == ("note: sent to a worker again, and complete: erp of s01 (its 10 min ran out; its node failed)")
    assert [line for line in said if "s02" in line] == ["error: erp of s02: erp of s02 is missing: its node failed"]
    assert plan.sent_again(others) == ""
