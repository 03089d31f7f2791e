"""The chapter on decoders without calibration, of scores that are known."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hrcneuro.analyses import transfer_group
from hrcneuro.config import settings as config
from hrcneuro.io.tables import write_table
from hrcneuro.pipeline.item import Item, State
from hrcneuro.report import chapters
from hrcneuro.report.results import Results
from hrcneuro.tables.transfer import SCORES

SETTINGS = config.load(Path(__file__).parents[2] / "configs/smoke.toml")
SIZES = {("own", "2"): 1.0, ("own", "all"): 20.0, ("pooled", "none"): 0.0, ("recentred", "none"): 0.0}


def results(folder, *, shuffled):
    rng = np.random.default_rng(3)
    rows = [
        {"signal": "causal", "scenario": "iC", "problem": "RRvsRH", "way": way, "calibration": size, "subject": f"s{i}"}
        | {"bacc": rng.normal(57, 2), "minutes": minutes, "pairs": 2.0}
        for (way, size), minutes in SIZES.items()
        for i in range(5)
    ]
    made = transfer_group.tables(pd.DataFrame(rows).reindex(columns=list(SCORES.columns)), 1)
    for name, (schema, frame) in made.items():
        write_table(frame, folder / name, schema)
    files = {path.name: str(path) for path in folder.glob("*.parquet")}
    summary = {"shuffled": shuffled}
    item = Item("transfer", "group", state=State.HIT, artifacts=files, summary=summary)
    return Results(SETTINGS, [item]), {name: frame for name, (_, frame) in made.items()}


def rows_of(html):
    return [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall("<tr>(.*?)</tr>", html)]


@pytest.mark.parametrize("shuffled", [False, True])
def test_the_chapter_prints_each_way_beside_own_and_says_what_is_a_control(tmp_path, shuffled):
    known, tables = results(tmp_path, shuffled=shuffled)
    html = chapters.tables(known, "transfer")
    assert ("a control that must come out at chance" in html) == shuffled
    own = tables["tests.parquet"].set_index("way").loc["own"]
    cells = [row for row in rows_of(html) if row[:5] == ["iC", "RRvsRH", "causal", "own", "all"]]
    assert cells[0][5:8] == ["5", "20.0", f"{own['bacc']:.1f} ± {own['half_width']:.1f}"]
    compared = tables["compared.parquet"].set_index("way")
    beside = html[html.index("Beside the subjects") :]
    pooled = next(row for row in rows_of(beside) if row[3:5] == ["pooled", "none"])
    assert pooled[6].startswith(f"{compared.loc['pooled', 'difference']:+.1f}".replace("-", "−"))
    assert html.index("Learning curves as numbers") > html.index("Beside the subjects")


def test_without_a_group_there_is_no_chapter():
    assert chapters.tables(Results(SETTINGS, []), "transfer") == ""
