"""The tables, pictures and page of a multiverse, from verdicts that were planted."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from hrcneuro.analyses import multiverse as many
from hrcneuro.config import settings
from hrcneuro.contract import GROUP
from hrcneuro.io.tables import describe
from hrcneuro.report import multiverse as told_of
from hrcneuro.report import multiverse_files as files
from hrcneuro.report.claims import rows as published_rows
from hrcneuro.report.results import Results
from hrcneuro.tables import multiverse as tables

ACC, ERP, WORD = "iC RRvsRH acc", "erp C", "sim2"
EVERY = many.universes({"filter": ["zero-phase", "causal <b>"]}, {"λ": ["0.9", "0.5"], "baseline": ["200", "100"]})


def rows(number):
    value = 57.0 + 2 * number

    def row(finding, fits, value, unit):
        told = dict(ours=f"{value} {unit}", value=value, unit=unit, fits=fits, verdict="by construction", why="w")
        return dict(finding=finding, **told)

    erp = {0: many.FITS, 1: many.DIFFERS}.get(number, many.OPEN)
    return [row(ERP, erp, -0.1 * number, "µV"), row(ACC, many.FITS, value, "%"), row(WORD, many.DIFFERS, None, "")]


@pytest.fixture
def every():
    return [told_of.Judged(n, n % 2, chosen, rows(n)) for n, chosen in enumerate(EVERY)]


def write(out, every, **more):
    given = dict(study="lab", reality="SYNTHETIC.", what="4 universes.", notes=["a < b"], failed=[])
    given["choices"] = [("λ", "alone", "0.9; 0.5")]
    return files.write(out, every, own=EVERY[0], curves=told_of.CURVES, **{**given, **more})


def test_every_universe_is_in_the_tables_with_what_it_chose(tmp_path, every):
    written = write(tmp_path / "out", every)
    verdicts = pd.read_parquet(written.files["verdicts"])
    assert len(verdicts) == 3 * len(EVERY)
    # In the paper's order.
    assert list(dict.fromkeys(verdicts["finding"])) == [ERP, ACC, WORD]
    own = verdicts[verdicts["finding"] == ACC].set_index("universe")
    assert own["choices"].tolist() == ["as in the study", "filter: causal <b>", "λ: 0.5", "baseline: 100"]
    assert own["value"].tolist() == [57.0, 59.0, 61.0, 63.0]
    assert own["published"].tolist()[0] == "57.1 ± 3.7 %"
    for name, table in (
        *(("verdicts", tables.VERDICTS), ("universes", tables.UNIVERSES)),
        *(("summary", tables.SUMMARY), ("influence", tables.INFLUENCE)),
    ):
        assert list(describe(written.files[name]).columns) == list(table.columns)
    universes = pd.read_parquet(written.files["universes"])
    assert len(universes) == 3 * len(EVERY)
    assert universes.groupby("universe")["own"].sum().tolist() == [3, 2, 2, 2]


def test_the_summary_counts_and_names_what_moves_a_finding(tmp_path, every):
    written = write(tmp_path, every)
    by_finding = {row["finding"]: row for row in written.summary}
    erp = by_finding[ERP]
    assert (erp["fits"], erp["differs"], erp["open"], erp["share"], erp["choice"]) == (1, 1, 2, 0.5, "filter")
    assert by_finding[WORD]["choice"] is None
    assert json.loads(json.dumps(written.summary)) == written.summary
    text = "\n".join(written.lines)
    assert "ERP, RH against RR before: fits in 1 of 2 (50 %); the study's own fits; moved most by filter" in text
    assert "1 of 3 findings fit in every analysis that can judge them" in text
    assert "0 of 3 findings are reached by no choice" in text


def test_universes_that_differ_after_a_finding_are_one_analysis_of_it(tmp_path):
    """Filter and baseline decide the potentials, which the decoders' choice comes after."""
    deep = [{"erp": str(n % 3 == 0), "decode": str(n), "simulate": "the same"} for n in range(len(EVERY))]
    every = [told_of.Judged(n, 0, chosen, rows(3 * (n % 3 == 0)), deep[n]) for n, chosen in enumerate(EVERY)]
    written = write(tmp_path, every)
    by_finding = {row["finding"]: row for row in written.summary}
    assert [by_finding[name]["analyses"] for name in (ERP, ACC, WORD)] == [2, 4, 1]
    told = pd.read_parquet(written.files["verdicts"]).set_index(["finding", "universe"])["analysis"]
    assert told[ERP].tolist() == [0, 1, 1, 0]
    assert told[ACC].tolist() == [0, 1, 2, 3]
    assert "1 of 3 findings are reached by no choice: there is one analysis of them" in written.lines
    assert "one analysis" in written.page.read_text()


def test_the_page_shows_pictures_that_are_there_and_escapes_what_it_is_given(tmp_path, every):
    written = write(tmp_path, every)
    page = written.page.read_text()
    for name in ("curve_iC_RRvsRH_acc.png", "findings.png"):
        assert f"src='{name}'" in page
        assert (tmp_path / name).read_bytes()[:4] == b"\x89PNG"
    assert "causal <b>" not in page.replace("causal &lt;b&gt;", "")
    assert "SYNTHETIC." in page
    assert "a &lt; b" in page
    # A finding that no universe has is not drawn, and what an earlier one drew is gone.
    (tmp_path / "curve_old.png").touch()
    write(tmp_path, [told_of.Judged(0, 0, EVERY[0], rows(0)[1:])])
    assert not (tmp_path / "curve_old.png").exists()
    assert not (tmp_path / "findings.png").exists()


def test_where_the_study_s_own_universe_failed_the_others_are_told(tmp_path, every):
    lost = told_of.Judged(0, 0, EVERY[0], ())
    written = write(tmp_path, every[1:], failed=[lost])
    assert all(row["study"] == "" and row["value"] is None for row in written.summary)
    universes = pd.read_parquet(written.files["universes"])
    assert not universes.loc[universes["universe"] == 0, "judged"].any()
    assert universes.loc[universes["universe"] == 1, "judged"].all()


def test_the_same_verdicts_give_the_same_bytes(tmp_path, every):
    one, two = write(tmp_path / "one", every), write(tmp_path / "two", every)
    assert one.files.keys() == two.files.keys()
    for name, path in one.files.items():
        assert path.read_bytes() == two.files[name].read_bytes(), name


def test_what_was_kept_is_read_back_and_what_is_no_such_thing_is_not(tmp_path):
    place = tmp_path / "judged" / "a.json"
    told_of.keep_judged(place, rows(1))
    assert told_of.read_judged(place) == rows(1)
    for text in ("", "{}", "[]", "[1]", json.dumps([{**rows(0)[0], "finding": "of another version"}])):
        place.write_text(text)
        assert told_of.read_judged(place) is None
    assert told_of.read_judged(tmp_path / "none.json") is None


def test_a_finished_study_is_judged_as_its_report_does(smoke_items):
    study = settings.load(Path("smoke"))
    judged = {row["finding"]: row for row in told_of.judge(study, smoke_items)}
    shown = [row for row in published_rows(Results(study, smoke_items)) if row.kind == "result"]
    assert len(judged) > 40
    for finding, row in judged.items():
        about = told_of.FINDINGS[finding].printed
        words = (about.place, about.quantity, row["ours"])
        same = [one for one in shown if (one.place, one.quantity, one.ours) == words]
        assert same, finding
        assert (same[0].verdict, same[0].why) == (row["verdict"], row["why"])
    numbers = [row["value"] for row in judged.values() if row["value"] is not None]
    assert len(numbers) > 35
    assert all(map(math.isfinite, numbers))
    # A small study can tell nothing, and what its figures meet is told all the same.
    assert {row["verdict"] for row in judged.values()} >= {"not testable"}
    assert {row["fits"] for row in judged.values()} >= {many.FITS, many.DIFFERS}


def test_verdicts_are_passed_anew_from_what_a_multiverse_keeps(smoke_items):
    """In a study of the paper's size all signals are dropped, and of the group all of erp and ersp but the tests."""
    study = settings.load(Path("smoke"))

    def stays(item, name):
        large = item.unit == GROUP and item.stage in ("erp", "ersp") and name != "channels.parquet"
        return name.endswith("_stats.parquet") if large else not name.endswith(".fif")

    kept = [
        replace(item, artifacts={name: path for name, path in item.artifacts.items() if stays(item, name)})
        for item in smoke_items
    ]
    assert sum(len(item.artifacts) for item in kept) < sum(len(item.artifacts) for item in smoke_items)
    assert told_of.judge(study, kept) == told_of.judge(study, smoke_items)
