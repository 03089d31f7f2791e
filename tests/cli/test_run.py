"""What a run's report is made of: its own items, and what else of the study is up to date."""

from pathlib import Path

import pytest

from hrcneuro.cli import bring, run
from hrcneuro.cli.options import Options
from hrcneuro.config import settings as config


@pytest.fixture
def whole(smoke):
    settings = config.load(Path("smoke"))
    options = Options(workdir=smoke)
    return options, settings, bring.planned(options, settings)


def test_a_run_of_the_whole_study_is_not_planned_again(whole, monkeypatch):
    options, settings, items = whole
    monkeypatch.setattr(bring, "planned", lambda *_: pytest.fail("it is planned again"))
    assert run._all_of(options, settings, items) == items


def test_a_run_of_a_part_takes_nothing_away(whole):
    options, settings, items = whole
    part = [item for item in items if item.stage == "epoch"]
    places = [(item.stage, item.unit) for item in run._all_of(options, settings, part)]
    assert len(places) == len(set(places)) == len(items)
