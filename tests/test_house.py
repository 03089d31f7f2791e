"""The house's rules: each import contract holds, and each fails when it is broken, on a copy of the package."""

import ast
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PLANTED = {
    "layers": ("paradigm/grid.py", "import hrcneuro.stages"),
    "numbers": ("eeg/filters.py", "import pathlib"),
    "stages": ("stages/erp.py", "import hrcneuro.stages.epoch"),
    "drawings": ("drawings/erp.py", "import hrcneuro.drawings.ersp"),
    "leaves": ("stages/epoch.py", "import hrcneuro.figures.style"),
    "figures": ("figures/style.py", "import hrcneuro.io.tables"),
    "cache": ("cache/why.py", "import hrcneuro.contract"),
    "ur10": ("ur10/arm.py", "import hrcneuro.paradigm.grid"),
    "edges": ("arms/clock.py", "import hrcneuro.io.tables"),
}
CONTRACTS = [
    contract["id"]
    for contract in tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
]


@pytest.fixture
def copy(tmp_path):
    shutil.copytree(ROOT / "hrcneuro", tmp_path / "hrcneuro", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def judged(folder, contract):
    """Return the exit code and the words of one contract's judgement."""
    done = subprocess.run(
        [str(Path(sys.executable).with_name("lint-imports")), "--contract", contract, "--no-cache"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout


def test_every_contract_has_its_planted_violation():
    assert set(PLANTED) == set(CONTRACTS)


@pytest.mark.parametrize("contract", CONTRACTS)
def test_a_contract_holds_and_fails_where_it_is_broken(copy, contract):
    assert judged(copy, contract)[0] == 0
    name, line = PLANTED[contract]
    module = copy / "hrcneuro" / name
    text = module.read_text()
    assert "\nfrom __future__ import annotations\n" in text
    module.write_text(
        text.replace("\nfrom __future__ import annotations\n", f"\nfrom __future__ import annotations\n{line}\n")
    )
    code, words = judged(copy, contract)
    assert (code, "BROKEN" in words) == (1, True)
    assert name.removesuffix(".py").replace("/", ".") in words


def test_a_module_on_no_floor_is_refused(copy):
    (copy / "hrcneuro" / "attic.py").write_text("")
    code, words = judged(copy, "layers")
    assert code != 0
    assert "attic" in words


def test_nobody_starts_the_command_line_from_below():
    """A package below the command line calls functions; the simulated controller has an entry of its own."""
    below = [p for p in (ROOT / "hrcneuro").rglob("*.py") if p.relative_to(ROOT / "hrcneuro").parts[0] != "cli"]
    assert len(below) > 100
    for path in below:
        for node in ast.walk(ast.parse(path.read_text())):
            words = [e.value for e in getattr(node, "elts", ()) if isinstance(e, ast.Constant)]
            assert "hrcneuro" not in words or "-m" not in words, path


def test_the_name_of_the_group_is_written_once():
    for path in (ROOT / "hrcneuro").rglob("*.py"):
        names = [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Constant) and n.value == "group"]
        assert not names or path.parent.name == "contract", path


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_says_how_long_it_takes_before_it_begins():
    done = subprocess.run(["make", "-n", "-B", "all"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.index("20 minutes") < done.stdout.index("pip install") < done.stdout.index("hrcneuro run")


def names_of(place):
    """Return what a module makes at its top level, in branches too."""
    found = set()
    for node in ast.walk(ast.parse(place.read_text())):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found |= {(one.asname or one.name).partition(".")[0] for one in node.names}
    return found


def test_scripts_that_no_test_runs_import_what_is_there():
    rooms = [ROOT, *(ROOT / one for one in ("benchmarks", "tests/helpers", "tests/product", "tests/chaos"))]
    scripts = [one for room in rooms[1:] for one in room.glob("*.py")]
    seen, missing = 0, []
    for script in scripts:
        for node in ast.walk(ast.parse(script.read_text())):
            if not isinstance(node, ast.ImportFrom) or node.level or not node.module:
                continue
            path = Path(*node.module.split("."))
            modules = [p for room in (script.parent, *rooms) if (p := room / path.with_suffix(".py")).is_file()]
            there = set[str]().union(*map(names_of, modules))
            package = ROOT / path / "__init__.py"
            if package.is_file():
                there |= names_of(package) | {one.stem for one in package.parent.iterdir()}
            if not there:
                continue
            seen += 1
            missing += [f"{script.name}: {node.module}.{one.name}" for one in node.names if one.name not in there]
    assert seen > 300
    assert not missing
