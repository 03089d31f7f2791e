"""The tables of decoding, from a finished study and from scores that are known."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hrcneuro.analyses import decode_group
from hrcneuro.config import settings as config
from hrcneuro.io.tables import write_table
from hrcneuro.pipeline.item import Item, State
from hrcneuro.report import chapters
from hrcneuro.report.results import Results
from hrcneuro.tables.decode import EXTRA, SCORES

ROOT = Path(__file__).parents[2]
SETTINGS = config.load(ROOT / "configs/smoke.toml")
DECODERS = SETTINGS.sections["decode"].decoders


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """The group's artifacts of eleven subjects whose scores are drawn, one of whom lacks a stratum."""
    out, rng = tmp_path_factory.mktemp("decoded"), np.random.default_rng(5)
    rows = [
        {"subject": f"s{i:02d}", "scenario": scenario, "problem": "RRvsRH", "decoder": decoder, "note": ""}
        | {"class1": "RR_before", "class2": "RH_before", "n1": 236, "n2": 153, "n_folds": 10, "n_repeats": 10}
        | {name: rng.normal(55, 3) for name in ("tnr", "tpr", "acc", "bacc", "auc", "bacc_se", "chance", *EXTRA)}
        | {"permutation_bacc": rng.normal(55, 3), "p": 0.5}
        for i in range(11)
        for scenario in ("iC", "sC")
        for decoder in DECODERS
    ]
    scores = pd.DataFrame(rows)[["subject", *SCORES.columns]]
    scores.loc[scores["subject"] == "s03", "prev_error_yes_bacc"] = np.nan
    for name, (schema, frame) in decode_group.tables(scores, DECODERS, 1).items():
        write_table(frame, out / name, schema)
    found = {path.name: str(path) for path in out.glob("*.parquet")}
    return Results(SETTINGS, [Item("decode", "group", state=State.HIT, artifacts=found)])


def cells(html, first):
    """Return the cells of the row that begins so."""
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall("<tr>(.*?)</tr>", html)]
    (found,) = [row for row in rows if row and row[: len(first)] == list(first)]
    return found


@pytest.mark.parametrize("decoder", DECODERS)
def test_the_chapter_prints_auc_blocks_strata_and_what_could_be_detected_of_each_decoder(known, decoder):
    table2 = known.table("decode", "group", "table2.parquet")
    at = table2[table2["decoder"] == decoder].set_index(["scenario", "measure"])
    html = chapters.tables(known, "decode")
    own = html[: html.index("<details>")]
    if decoder != DECODERS[0]:
        own = html[html.index(f"strata of {decoder}") : html.index("Every subject")]
    plain = cells(own, ["iC", "RRvsRH", "this run"])
    head = re.findall("<th>(.*?)</th>", own[: own.index("</tr>")])
    for measure, name in (("auc", "AUC (%)"), ("lobo_bacc", "LOBO (%)")):
        assert plain[head.index(name)].startswith(f"{at.loc[('iC', measure), 'mean']:.1f} ± ")
    for measure, label in (("matched_bacc", "retrained after no error"), ("turn_yes_bacc", "turn ahead")):
        row = at.loc[("sC", measure)]
        expected = f"{row['mean']:.1f} ± {row['sd']:.1f}<small>detectable {row['detectable']:.1f}</small>"
        assert cells(own, [label])[2] == expected
    assert "n = 10" in cells(own, ["after an error"])[1]
    assert "detectable" not in cells(own, ["no EEG: turn ahead"])[1]


def test_every_subject_has_auc_and_blocks_and_the_page_says_what_p_tests(known):
    html = chapters.tables(known, "decode")
    html = html[html.index("Every subject") :]
    first = known.table("decode", "group", "subjects.parquet").query("subject == 's04' and scenario == 'iC'").iloc[0]
    row = cells(html, ["iC", "RRvsRH", first["decoder"], "s04"])
    head = re.findall("<th>(.*?)</th>", html)
    assert row[head.index("AUC")] == f"{first['auc']:.1f}"
    assert row[head.index("LOBO")] == f"{first['lobo_bacc']:.1f}"
    assert row[head.index("balanced, one repeat")] == f"{first['permutation_bacc']:.1f}"
    assert "of one repeat" in html[: html.index("<table>")]


def test_a_study_without_cues_has_no_table_of_strata(known):
    table2 = known.table("decode", "group", "table2.parquet")
    names = ("matched_bacc", "prev_error", "turn")
    table2.loc[table2["measure"].astype(str).str.startswith(names), ["mean", "sd", "detectable"]] = np.nan
    assert chapters._strata(table2[table2["decoder"] == DECODERS[0]].assign(mean=50.0)) is not None
    assert chapters._strata(table2[table2["decoder"] == DECODERS[0]]) is None


def test_a_difference_of_one_subject_has_no_spread():
    row = {"scenario": "all", "problem": "AvsB", "decoder": "rlda_600", "difference": -4.1, "sd": np.nan, "p_holm": 1.0}
    table = chapters._compared(pd.DataFrame([row, row | {"sd": 2.0}]), "rlda")
    assert [line[3] for line in table.rows] == ["-4.1", "-4.1 ± 2.0"]
