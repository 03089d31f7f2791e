"""docs/extend/decoder.md, followed to the letter in a folder of one's own."""

import re

import pandas as pd
from tiny_study import ROOT, TINY
from transcripts import printed, steps

PAGE = (ROOT / "docs" / "extend" / "decoder.md").read_text()


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, flags=re.M | re.S)


def test_the_decoders_of_the_page_decode_and_a_changed_file_is_named(hrcneuro, tmp_path):
    decoders = re.search(r"With `(decoders = \[.*\])`", PAGE)[1]
    recipes = "\n".join(blocks("toml")).replace('decoders = ["rlda", "svm"]', decoders)
    study = TINY.replace("episodes_per_block = 1", "episodes_per_block = 6")
    (tmp_path / "hrcneuro.toml").write_text(f"{study}\n{recipes}")
    (own,) = blocks("python")
    (tmp_path / "my_decoders.py").write_text(own)
    checked = hrcneuro("config", "check", cwd=tmp_path)
    assert checked.code == 0, checked.err
    done = hrcneuro("decode", "s01", "--no-figures", "-j", "1", cwd=tmp_path)
    assert done.code == 0, done.err
    shown = hrcneuro("show", "decode", "s01", cwd=tmp_path).out
    (typed,) = blocks("console")
    lines = dict(steps(typed))["hrcneuro show decode s01"]
    assert len(lines) == 6
    assert [line for line in lines if not printed(line, shown)] == []
    place = hrcneuro("path", "decode", "s01", "scores.parquet", cwd=tmp_path).out.strip()
    scores = pd.read_parquet(place).dropna(subset=["acc"])
    assert set(scores["decoder"]) == {"rlda", "svm", "late", "mine"}
    (tmp_path / "my_decoders.py").write_text(own.replace("C=1.0", "C=2.0"))
    planned = hrcneuro("decode", "s01", "--dry-run", "--no-figures", cwd=tmp_path)
    assert "decode  s01  stale      sources: mine/my_decoders.py" in planned.out
    assert "3 fresh, 1 stale" in planned.out
