"""The table of the faults that were tried: what broke off, said nothing or was skipped does not pass for survived."""

import importlib.util
import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

CHAOS = Path(__file__).parents[1] / "chaos"


@pytest.fixture
def chaos(monkeypatch):
    """The script that runs all others."""
    monkeypatch.syspath_prepend(str(CHAOS))
    monkeypatch.setenv("KILLS", "10")
    spec = importlib.util.spec_from_file_location("chaos_of_all", CHAOS / "__main__.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    sys.modules.pop("table", None)


@pytest.fixture
def script(chaos, monkeypatch, tmp_path):
    """Let one script, ``kills``, be a program that leaves these rows and ends with this code."""

    def put(code, *rows):
        path = tmp_path / "kills.py"
        text = "".join(json.dumps(asdict(row)) + "\n" for row in rows)
        path.write_text(f"import os, pathlib, sys\nfile = pathlib.Path(os.environ[{chaos.PLACE!r}])\n")
        with path.open("a") as file:
            file.write(f"file.write_text({text!r})\n" if rows else "")
            file.write(f"sys.exit({code})\n")
        monkeypatch.setattr(chaos, "SCRIPTS", {"kills": [path]})
        return chaos.main("kills")

    return put


def test_all_kills_and_nothing_lost_is_a_success(chaos, script, capfd):
    kills = chaos.Fault("kill -9, executor serial", tried=10, survived=10)
    assert script(0, kills) == 0
    assert "10 trials, 10 kills of runs, 0 lost" in capfd.readouterr().out


def test_a_script_that_says_nothing_has_broken_off(script, capfd):
    assert script(0) == 1
    assert "broke off with exit code 0" in capfd.readouterr().out


def test_a_script_that_fails_and_lost_nothing_by_its_rows_has_broken_off(chaos, script):
    assert script(3, chaos.Fault("kill -9, executor serial", tried=10, survived=10)) == 1


def test_what_was_skipped_counts_as_nothing_and_runs_that_were_not_killed_are_no_kills(chaos, script, capfd):
    kills = chaos.Fault("kill -9, executor serial", tried=9, survived=9)
    again = chaos.Fault("begun again after kills, executor serial", tried=1, survived=1)
    assert script(0, kills, again, chaos.Fault("kill -9, executor slurm").skip("not here")) == 1
    out = capfd.readouterr().out
    assert "skipped: not here" in out
    assert "only 9 of 10 kills were tried" in out


def test_a_script_that_breaks_off_in_the_middle_is_one_lost(chaos):
    def script():
        raise SystemExit("no")

    fault = chaos.Fault("a fault").count(script)
    assert (fault.tried, fault.survived, fault.lost) == (1, 0, 1)
    assert chaos.Fault("a fault").count(lambda: 7).survived == 7


@pytest.mark.parametrize("number", [0, 1, 7, 10, 500])
@pytest.mark.parametrize("absent", [(), ("slurm",), ("dask", "slurm")])
def test_the_kills_of_an_executor_that_is_not_here_go_to_the_others(chaos, number, absent):
    import table

    shares = {"serial": 0.5, "processes": 0.28, "dask": 0.16, "slurm": 0.06}
    numbers = table.shared_out(number, {name: share for name, share in shares.items() if name not in absent})
    assert sum(numbers.values()) == number
    assert min(numbers.values()) >= 0


def test_a_script_of_the_live_side_is_named_that_is_there():
    """Every script that the table is made of can be found; the live side's by the name of a module."""
    done = subprocess.run(
        [sys.executable, CHAOS / "of_the_live_side.py", "no_such"], capture_output=True, text=True, check=False
    )
    assert "KeyError: 'no_such'" in done.stderr
    for path in ("experiment_kills", "experiment_subjects", "loop_kills"):
        assert (CHAOS.parent / "product" / f"{path}.py").is_file()


def test_a_command_of_the_scripts_starts_and_ends_as_it_does_by_itself(tmp_path):
    code = (
        "import sys, pathlib; from study import RUN; from quick import Quick; "
        "run = Quick(pathlib.Path(sys.argv[1]), '--version'); "
        "assert run.wait(60) == 0, run.said(); "
        "run = Quick(pathlib.Path(sys.argv[1]), 'no-such-command'); "
        "assert run.wait(60) == 2, run.code"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], cwd=CHAOS, check=True)
