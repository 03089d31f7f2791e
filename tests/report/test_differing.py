"""The count of rows that were expected to differ comes from the table of verdicts itself."""

from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.report.claims import PublishedRow
from hrcneuro.report.differing import differing
from hrcneuro.report.verdicts import DIFFERS, VERDICTS

GROUNDS = ("", "eeg", "behaviour", "model", "arm")


def row(verdict, simulated):
    return PublishedRow("3.1", "a peak", "4", "5", "result", verdict, "", "erp", "", simulated)


@given(st.lists(st.builds(row, st.sampled_from(list(VERDICTS)), st.sampled_from(GROUNDS))))
def test_every_row_that_differs_is_counted_once_expected_or_named(rows):
    found = differing(rows)
    number = sum(one.verdict == DIFFERS for one in rows)
    if not number:
        assert found is None
        return
    assert found["number"] == number == found["expected"] + len(found["others"])
    assert found["expected"] == sum(one["number"] for one in found["reasons"])
    assert len(found["others"]) == sum(one.verdict == DIFFERS and not one.simulated for one in rows)


def test_each_ground_has_its_reason():
    found = differing([row(DIFFERS, ground) for ground in ("eeg", "eeg", "arm", "")])
    assert [one["number"] for one in found["reasons"]] == [2, 1]
    assert "planted" in found["reasons"][0]["why"]
    assert found["others"] == ["3.1: a peak"]
