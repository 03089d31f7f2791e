"""One report a configuration, and never one replaced by less."""

import dataclasses
import json
from pathlib import Path

import pytest

from hrcneuro.config import settings as config
from hrcneuro.pipeline.item import Item, State
from hrcneuro.report import shelf

ROOT = Path(__file__).parents[2]
SMOKE = ROOT / "configs/smoke.toml"


@pytest.fixture(scope="module")
def settings():
    return config.load(SMOKE)


@pytest.fixture(scope="module")
def small(smoke_items):
    """Few items, and no pictures: a page that is quickly made."""
    return [item for item in smoke_items if item.stage in ("acquire", "epoch")]


def failed(items, stage, unit):
    return [
        Item(stage, unit, state=State.FAILED, why=["the disk is gone"]) if (i.stage, i.unit) == (stage, unit) else i
        for i in items
    ]


def test_every_setting_that_decides_results_has_a_report_of_its_own(settings):
    again = config.load(SMOKE)
    given = [["preprocess.l_freq=0.5"], ["decode.repeats=3"], ["study.name=other"]]
    given += [["acquire.source=dataset", f"acquire.path={place}"] for place in ("here", "there")]
    others = [config.load(SMOKE, one) for one in given]
    assert shelf.name(settings) == shelf.name(again)
    assert shelf.name(settings).startswith("smoke-")
    assert len({shelf.name(one) for one in (settings, *others)}) == 6


@pytest.mark.parametrize("study", ["a/b", "..", "", "é ü", "x" * 300])
def test_a_study_of_any_name_has_a_plain_folder(settings, study):
    named = dataclasses.replace(settings, study=dataclasses.replace(settings.study, name=study))
    folder = shelf.name(named)
    assert Path(folder).name == folder
    assert not folder.startswith(".")
    assert len(folder) < 60


def test_a_report_of_less_leaves_the_one_that_is_there(settings, small, tmp_path):
    placed = shelf.place(settings, small, tmp_path)
    own = shelf.folder(tmp_path, settings) / "report.html"
    before = own.read_bytes()
    assert placed == shelf.Placed(tmp_path / "report.html", None, None)
    assert placed.path.read_bytes() == before
    less = shelf.place(settings, failed(small, "epoch", "s02"), tmp_path)
    assert own.read_bytes() == placed.path.read_bytes() == before
    assert less.kept == own
    assert "the disk is gone" in less.path.read_text(encoding="utf-8")
    assert "its report" in (tmp_path / "reports/index.html").read_text(encoding="utf-8")
    assert shelf.place(settings, small, tmp_path).kept is None
    assert not less.path.exists()


def test_a_report_of_more_replaces_the_one_that_is_there(settings, small, tmp_path):
    fewer = [item for item in small if item.stage == "acquire"]
    first = shelf.place(settings, fewer, tmp_path).path.read_bytes()
    assert shelf.place(settings, small, tmp_path).kept is None
    assert (tmp_path / "report.html").read_bytes() != first


def test_another_configuration_leaves_the_report_and_both_are_listed(settings, small, tmp_path):
    shelf.place(settings, small, tmp_path)
    before = (shelf.folder(tmp_path, settings) / "report.html").read_bytes()
    other = config.load(SMOKE, ["decode.repeats=3"])
    placed = shelf.place(other, small, tmp_path)
    assert (shelf.folder(tmp_path, settings) / "report.html").read_bytes() == before
    assert placed.others == tmp_path / "reports/index.html"
    listed = placed.others.read_text(encoding="utf-8")
    for one in (settings, other):
        assert f"{shelf.name(one)}/report.html" in listed
    assert listed.count("shown as results/report.html") == 1


def test_a_whole_report_stays_in_front_of_a_lesser_one_of_another_configuration(settings, small, tmp_path):
    shelf.place(settings, small, tmp_path)
    mark = shelf.folder(tmp_path, settings) / "report.json"
    assert json.loads(mark.read_text())["whole"] is False
    mark.write_text(json.dumps({**json.loads(mark.read_text()), "whole": True}))
    front = (tmp_path / "report.html").read_bytes()
    other = config.load(SMOKE, ["decode.repeats=3"])
    placed = shelf.place(other, small, tmp_path)
    assert placed.path == shelf.folder(tmp_path, other) / "report.html"
    assert (tmp_path / "report.html").read_bytes() == front


def test_a_study_is_whole_when_every_stage_has_run_for_everyone(settings, smoke_items, small):
    assert shelf.is_whole(settings, smoke_items)
    assert not shelf.is_whole(settings, small)
    assert not shelf.is_whole(settings, failed(smoke_items, "erp.figures", "s01"))


def test_what_another_version_called_otherwise_is_no_loss(small, tmp_path):
    mark = tmp_path / "report.json"
    mark.write_text(json.dumps({"done": ["polish s01", *shelf.done(small)]}))
    assert not shelf.is_less(small, mark)
    assert shelf.is_less(small[1:], mark)
