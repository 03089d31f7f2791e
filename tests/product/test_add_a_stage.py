"""The page "add a stage", followed to the letter on a copy of the package."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tiny_study import ROOT, Copy

PAGE = (ROOT / "docs" / "extend" / "stage.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(python|diff)\n# (\S+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
GIVEN = ("--config", "tiny.toml", "--executor", "serial")


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    copy = Copy(tmp_path_factory.mktemp("stage"))
    for kind, name, text in BLOCK.findall(PAGE):
        path = copy.package.parent / name
        if kind == "python":
            assert not path.exists()
            path.write_text(text, encoding="utf-8")
            continue
        lines = text.splitlines()
        old = [line[1:] for line in lines if line.startswith("-")]
        new = [line[1:] for line in lines if line.startswith("+")]
        copy.edit(name.removeprefix("hrcneuro/"), "\n".join(old), "\n".join(new))
    return copy


def states(items, stage):
    return {name.split()[0]: item["state"] for name, item in items.items() if name.split()[0].startswith(stage)}


def test_the_page_makes_the_files_that_it_names():
    kinds = [kind for kind, *_ in BLOCK.findall(PAGE)]
    assert (kinds.count("python"), kinds.count("diff")) == (4, 3)


def test_the_new_stage_is_planned_run_cached_and_drawn(copy):
    planned = copy.items("pace", "s01", "--dry-run", *GIVEN)
    assert states(planned, "pace") == {"pace": "would-run", "pace.figures": "would-run"}
    first, second = copy.items("pace", "s01", *GIVEN), copy.items("pace", "s01", *GIVEN)
    assert states(first, "pace") == {"pace": "ran", "pace.figures": "ran"}
    assert states(second, "pace") == {"pace": "hit", "pace.figures": "hit"}
    assert 0.5 < first["pace s01"]["summary"]["median_s"] < 1.5
    again = copy.items("pace", "s01", "--set", "pace.bars=20", *GIVEN)
    assert states(again, "pace") == {"pace": "hit", "pace.figures": "ran"}
    given = ("--set", "pace.bars=20", *GIVEN, "--workdir", "study")
    picture = Path(copy.python("-m", "hrcneuro", "path", "pace", "s01", "pace.png", *given).strip())
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert picture.with_suffix(".pdf").is_file()


def test_the_new_stage_has_a_chapter_in_the_report(copy):
    copy.items("pace", *GIVEN)
    copy.python("-m", "hrcneuro", "report", "--workdir", "study", *GIVEN)
    page = (copy.work / "study" / "results" / "report.html").read_text(encoding="utf-8")
    assert re.search(r"<h2>\s*Pace\s*</h2>", page)
    assert "From one onset to the next, by who made the first move" in page
    assert len(list((copy.work / "study" / "results" / "reports").glob("*/figures/s01/pace_pace.png"))) == 1


def test_the_new_stage_has_options_and_help(copy):
    assert "longest_s" in copy.python("-m", "hrcneuro", "config", "show", "pace")
    assert "hrcneuro pace s01" in copy.python("-m", "hrcneuro", "pace", "--help")


def test_the_new_stage_keeps_the_house_s_arrows(copy):
    shutil.copy(ROOT / "pyproject.toml", copy.package.parent)
    command = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]
    env = {"PYTHONPATH": str(copy.package.parent), "PATH": "/usr/bin:/bin", "COLUMNS": "200"}
    done = subprocess.run(command, cwd=copy.package.parent, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
