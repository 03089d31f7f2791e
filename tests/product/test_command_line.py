"""Every command as a user meets it: help, examples, exit codes, errors with a cure."""

import json
import os
import re
import shlex
from pathlib import Path

import pandas as pd
import pytest
from commands import COMMANDS
from tiny_study import ROOT

from hrcneuro import stages


def examples(text):
    return re.findall(r"^ +hrcneuro (.+)$", text.partition("Examples:")[2], flags=re.M)


def test_no_command_is_forgotten_here():
    from typer.main import get_command

    from hrcneuro.cli.app import app

    def walk(command, words):
        inner = getattr(command, "commands", None)
        return [words] if inner is None else [w for name, one in inner.items() for w in walk(one, [*words, name])]

    assert sorted(walk(get_command(app), [])) == sorted(COMMANDS)


# Exit codes of the examples where nothing sends and nothing was recorded.
LIVE = {"amp": (0,), "record": (4,), "timing": (3, 4), "online": (3, 4)}


def test_help_lists_every_command(hrcneuro):
    text = hrcneuro("--help").out
    for words in COMMANDS:
        assert f"\n  {words[0]} " in text
    assert len(examples(text)) == 2


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_each_help_ends_with_two_examples_that_run(hrcneuro, smoke, tmp_path, words):
    if words in (["cache", "push"], ["cache", "pull"]):
        pytest.importorskip("fsspec", reason="needs the extra remote")
    # Outside the repository: who installed a wheel has no other files than the program's own.
    done = hrcneuro(*words, "--help")
    assert done.code == 0
    found = examples(done.out)
    assert len(found) == 2
    # They need nothing of the study, whose sweep is the one that was asked for last, and which has no session.
    work = tmp_path / "study" if words[0] in ("simulate", "experiment", "rehearse") else smoke
    for example in found:
        arguments = shlex.split(example)
        given = [] if words == ["run"] or "--config" in arguments else ["--config", "smoke"]
        if arguments[:1] == ["run"] and len(arguments) == 1:
            given = ["--dry-run"]
        if "ursim" in arguments or words == ["rehearse"]:
            # In real time, and on a machine that runs other tests: test_ur10_drivers.py drives it. test_rehearse.py
            # rehearses at small size.
            given.append("--dry-run")
        if words == ["simulate"]:
            # Long ones, whatever the study; what comes out of a sweep is tested in test_sweep_result.py.
            given += ["--no-figures", "--set", "simulate.episodes=20", "--set", "simulate.sweep_repetitions=2"]
        if words == ["ur10", "serve"]:
            # It ends with its standard input, which is closed here; the address is one that no other test uses.
            given += ["--until-stdin-closes", "--address", f"127.{1 + os.getpid() % 250}.0.2"]
        # A whole multiverse is run in test_multiverse.py.
        if words in (["cache", "gc"], ["cache", "slim"], ["multiverse"]) and "--dry-run" not in arguments:
            given.append("--dry-run")
        if "--workdir" not in arguments:
            given += ["--workdir", str(work)]
        else:
            arguments[arguments.index("--workdir") + 1] = str(work)
        env = None
        if words[0] in LIVE:
            # Streams of this test alone: there are none to record, and a recording there is none of.
            (tmp_path / "lsl_api.cfg").write_text(f"[lab]\nSessionID = {tmp_path.name}\n[log]\nlevel = -3\n")
            env = {"LSLAPICFG": str(tmp_path / "lsl_api.cfg")}
            given += ["--seconds", "0.5"] if words == ["amp"] else ["--set", "record.wait_s=1"]
        if words == ["cache", "pull"]:
            assert hrcneuro("cache", "push", "bucket", "--workdir", smoke, cwd=tmp_path).code == 0
        again = hrcneuro(*arguments, *given, cwd=tmp_path, env=env)
        assert again.code in LIVE.get(words[0], (0,)), f"{example}: {again.err}"


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["epoch", "s01"], 0, ["3 ran"]),
        (["epoch", "s01", "--set", "epoch.reject_uv=0.001"], 3, ["none of", "epoch.reject_uv"]),
        (["robot", "s01", "--backend", "ur", "--host", "127.0.0.9"], 4, ["no robot answers at 127.0.0.9", "cure"]),
    ],
)
def test_what_a_stage_meets_decides_the_exit_code(hrcneuro, tiny, arguments, code, words):
    # 1 (a worker died) and 130 (interrupted) are reached in test_crash.py, 2 below.
    done = hrcneuro(*arguments, "--config", tiny / "tiny.toml", "--workdir", tiny, "-j", "1")
    assert done.code == code, done.err
    for word in words:
        assert word in done.err


@pytest.mark.parametrize("arm", [["backend=ur", "host=127.0.0.9"], ["backend=ros", "at_the_robot=true"]])
@pytest.mark.parametrize("command", ["robot", "run"])
def test_one_arm_takes_one_subject_a_command(hrcneuro, tiny, command, arm):
    (tiny / "arm.toml").write_text('config = "tiny.toml"\nstages = ["robot"]\nreport = false\n')
    given = ["run", tiny / "arm.toml", "-j", "2"] if command == "run" else ["robot", "--config", tiny / "tiny.toml"]
    done = hrcneuro(*given, "--workdir", tiny, *(word for a in arm for word in ("--set", f"robot.{a}")))
    assert done.code == 2, done.err
    assert "one subject a command" in done.err
    assert "(s01, s02)" in done.err
    assert not (tiny / "cache" / "acquire").exists()


def test_the_timing_report_tells_latency_and_jitter(hrcneuro, smoke):
    """Paper 2.3.4; what the figures are is read from the table that they summarise."""
    given = ["robot", "s01", "--config", ROOT / "configs" / "smoke.toml", "--workdir", smoke]
    done = hrcneuro(*given, "--timing")
    assert done.code == 0, done.err
    (place,) = re.findall(r"^drawn in (.+)timing\.png$", done.out, flags=re.M)
    assert (Path(place) / "timing.png").is_file()
    rows = {line[:52].strip(): line[52:].split() for line in done.out.splitlines()}
    numbers = hrcneuro("path", *given[:2], "timing.parquet", *given[2:]).out.strip()
    table = pd.read_parquet(numbers).set_index("quantity")
    latency = table.loc["trigger_latency"]
    shown = rows["t = 0 to the onset of the motion (Eq 2 fitted)"]
    assert int(shown[0]) == latency["n"] > 10
    assert [float(v) for v in shown[1:]] == pytest.approx(
        [latency[f"{name}_ms"] for name in ("mean", "sd", "median", "low", "p1", "p99", "high")], abs=5e-4
    )
    assert {"t = 0 to the marker sent", "t = 0 to the first sample with it", "its jitter", "control cycle"} <= set(rows)


def test_the_timing_report_leaves_out_who_is_left_out(hrcneuro, smoke):
    given = ["robot", "--config", ROOT / "configs" / "smoke.toml", "--workdir", smoke, "--timing"]
    done = hrcneuro(*given, "--set", 'study.exclude=["s02"]')
    assert done.code == 0, done.err
    assert re.findall(r"^(\w+): timing in ms", done.out, flags=re.M) == ["s01", "s03"]


def test_the_version_is_printed(hrcneuro):
    assert re.fullmatch(r"hrcneuro \d+\.\d+\.\d+\n", hrcneuro("--version").out)


# Those that start workers, copies of their own, or none at all.
NO_WORKER = [
    [*words, "-j", "-3"]
    for words in (
        ["epoch"],
        ["run"],
        ["status"],
        ["cache", "push", "bucket"],
        ["cache", "pull", "bucket"],
        ["path", "epoch", "s01"],
    )
]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["epok"], 2, ["No such command"]),
        (["epoch", "--colour"], 2, ["No such option"]),
        (["epoch", "s1"], 2, ["unknown subject 's1'", "did you mean 's", "cure"]),
        *((words, 2, ["-j -3", "at least 1", "cure"]) for words in NO_WORKER),
        (["epoch", "-j", "0"], 2, ["-j 0", "at least 1"]),
        (["epoch", "--executor", "procesess"], 2, ["did you mean 'processes'"]),
        (["epoch", "--config", "nowhere.toml"], 2, ["nowhere.toml does not exist"]),
        (["epoch", "--config", "smok"], 2, ["no configuration has the name 'smok' (did you mean 'smoke'?)", "paper"]),
        (["run", "smoke.tml"], 2, ["smoke.tml does not exist"]),
        (["run", "papr"], 2, ["no pipeline has the name 'papr' (did you mean 'paper'?)"]),
        (["run", "nowhere.toml"], 2, ["nowhere.toml does not exist"]),
        (["path", "epok", "s01"], 2, ["did you mean 'epoch'"]),
        (["path", "epoch", "s01"], 3, ["has not run", "hrcneuro epoch s01"]),
        (["show", "epoch", "s1"], 2, ["unknown subject 's1'", "did you mean 's01'"]),
        (["config", "show", "epok"], 2, ["did you mean 'epoch'"]),
        (["simulate", "--set", "simulate.repetitons=3"], 2, ["did you mean 'repetitions'"]),
        (["epoch", "s01", "--set", "acquire.source=dataset", "--set", "acquire.path=nowhere"], 3, ["nowhere"]),
    ],
)
def test_a_mistake_gets_one_message_with_a_cure_and_the_right_code(hrcneuro, tmp_path, arguments, code, words):
    done = hrcneuro(*arguments, *(["--workdir", tmp_path] if "No such" not in words[0] else []))
    assert done.code == code, done.err
    for word in words:
        assert word in done.err
    assert "Traceback" not in done.err
    assert done.out == ""


def test_all_configuration_mistakes_come_at_once(hrcneuro, tmp_path):
    (tmp_path / "bad.toml").write_text("[preproces]\n[epoch]\ntmim = 1\n[decode]\nfolds = 1\nrepeats = 'x'\n")
    done = hrcneuro("config", "check", "--config", tmp_path / "bad.toml")
    assert done.code == 2
    for word in ("[preproces]", "'preprocess'", "epoch.tmim", "decode.folds = 1", "decode.repeats = 'x'"):
        assert word in done.err


def test_an_error_in_json_mode_is_json(hrcneuro, tmp_path):
    done = hrcneuro("epoch", "nobody", "--json", "--workdir", tmp_path)
    assert done.code == 2
    assert done.json["ok"] is False
    assert "nobody" in done.json["error"]["problem"]


def test_debug_shows_the_traceback(hrcneuro, tmp_path):
    assert "Traceback" in hrcneuro("epoch", "nobody", "--debug", "--workdir", tmp_path).err


@pytest.mark.parametrize("words", [["report"], ["path", "epoch", "s01"]], ids=" ".join)
def test_what_is_read_back_from_a_study_is_one_json_document(hrcneuro, smoke, words):
    done = hrcneuro(*words, "--json", "--config", "configs/smoke.toml", "--workdir", smoke)
    assert done.code == 0, done.err
    assert Path(done.json[words[0]]).exists()


def test_a_report_of_what_has_not_run_is_refused(hrcneuro, tmp_path):
    done = hrcneuro("report", "--json", "--config", "configs/smoke.toml", "--workdir", tmp_path)
    assert done.code == 3
    assert "nothing of this configuration (smoke-" in done.json["error"]["problem"]
    assert "hrcneuro run" in done.json["error"]["cure"]
    assert not (tmp_path / "results" / "report.html").exists()


def test_a_report_of_a_part_says_what_is_missing(hrcneuro, tiny):
    given = ("--config", tiny / "tiny.toml", "--workdir", tiny, "--executor", "serial")
    assert hrcneuro("acquire", "s01", *given).code == 0
    done = hrcneuro("report", "--no-figures", *given)
    assert done.code == 0, done.err
    assert "17 of 18 results of this configuration are missing: acquire s02; preprocess s01, s02; epoch" in done.err
    assert "hrcneuro run, with the same --config and --set, makes them" in done.err
    printed = hrcneuro("report", "--no-figures", "--json", *given).json
    assert printed["ok"] is True
    assert len(printed["missing"]) == 17
    assert printed["missing"][:2] == ["acquire s02", "preprocess s01"]


def test_path_prints_where_an_artifact_lies(hrcneuro, smoke):
    given = ("--config", "smoke", "--workdir", smoke)
    for words in (
        ["epoch", "s01", "conditions.parquet"],
        ["erp", "s01", "erp_subject.png"],
        ["cases", "group", "fig2.pdf"],
    ):
        done = hrcneuro("path", *words, *given)
        assert done.code == 0, done.err
        assert Path(done.out.strip()).is_file()
    assert hrcneuro("path", "epoch", "s01", "nothing.txt", *given).code == 3
    assert "erp_subject.png" in hrcneuro("path", "erp", "s01", "erp_subjet.png", *given).err


def test_path_answers_for_the_configuration_that_is_asked_whatever_ran_last(hrcneuro, tmp_path):
    given = ("--workdir", tmp_path, "--no-figures", "--set", "simulate.repetitions=2", "--set", "simulate.episodes=20")
    places = []
    for words in ((), ("--set", "simulate.seed=7")):
        assert hrcneuro("simulate", *given, *words).code == 0
        places.append(hrcneuro("path", "simulate", "group", *given, *words).out.strip())
    assert len(set(places)) == 2
    assert hrcneuro("path", "simulate", "group", *given).out.strip() == places[0]
    third = (*given, "--set", "simulate.seed=8")
    done = hrcneuro("path", "simulate", "group", *third)
    assert (done.code, done.out) == (3, "")
    assert "params: simulate.seed 7 -> 8" in done.err
    assert "--last" in done.err
    assert hrcneuro("path", "simulate", "group", "--last", *third).out.strip() == places[1]
    done = hrcneuro("path", "simulate", "group", "fig4.png", *given)
    assert done.code == 3
    assert "hrcneuro report" in done.err
    assert hrcneuro("path", "simulate", "sweep", *given).code == 3
    assert hrcneuro("path", "decode", "sweep", *given).code == 2


def test_path_says_where_it_cannot_know_what_is_asked(hrcneuro, smoke):
    given = (
        "--config",
        "smoke",
        "--workdir",
        smoke,
        "--set",
        "acquire.source=dataset",
        "--set",
        "acquire.path=/nowhere",
    )
    done = hrcneuro("path", "epoch", "s01", *given)
    assert (done.code, done.out) == (3, "")
    assert "whether epoch of s01 is there cannot be told: the data folder /nowhere does not exist" in done.err
    assert hrcneuro("path", "epoch", "s01", "--last", *given).code == 0


def test_show_alone_lists_what_there_is(hrcneuro, smoke, tmp_path):
    given = ("--config", "smoke", "--workdir", smoke)
    done = hrcneuro("show", *given)
    assert done.code == 0, done.err
    assert "epoch       s01, s02, s03\n" in done.out
    assert "decode      s01, s02, s03, group\n" in done.out
    assert hrcneuro("show", "--json", *given).json["stages"]["simulate"][0] == "group"
    other = hrcneuro("show", *given, "--set", "acquire.seed=5", "--set", "simulate.seed=5")
    assert (other.code, other.out) == (3, "")
    assert "with another one have: acquire s01" in other.err
    # Other tests may have run stages that are no part of this study.
    last = hrcneuro("show", "--last", *given, "--set", "acquire.seed=5").out.splitlines()
    assert set(done.out.splitlines()) <= set(last)
    assert hrcneuro("show", "--workdir", tmp_path).code == 3


def test_config_show_prints_values_ranges_and_origins(hrcneuro):
    done = hrcneuro("config", "show", "preprocess", "--config", "configs/smoke.toml", "--set", "preprocess.l_freq=0.5")
    line = next(x for x in done.out.splitlines() if x.startswith("l_freq"))
    assert line.startswith("l_freq = 0.5")
    assert "--set" in line
    assert "Hz" in line
    assert any("configs/smoke.toml" in x for x in done.out.splitlines() if x.startswith("sfreq"))


def test_what_config_show_prints_is_a_configuration(hrcneuro, tmp_path):
    (tmp_path / "all.toml").write_text(hrcneuro("config", "show", "--config", "configs/smoke.toml").out)
    done = hrcneuro("config", "show", "--config", tmp_path / "all.toml", "--json")
    assert done.code == 0, done.err
    again = hrcneuro("config", "show", "--config", "configs/smoke.toml", "--json")
    shown, asked = done.json["config"], again.json["config"]
    # A relative place is read from where its file lies.
    for section, place in (("robot", "rescue_folder"), ("record", "folder")):
        assert Path(shown[section].pop(place)) == tmp_path / asked[section].pop(place)
    assert shown == asked


def test_the_second_run_is_all_hits_and_prints_the_same_summaries(hrcneuro, smoke):
    first = json.loads((smoke / "done").read_text())
    done = hrcneuro("run", "pipelines/smoke.toml", "--workdir", smoke, "--json")
    assert set(done.states.values()) == {"hit"}
    default = {name for name in stages.NAMES if not stages.load(name).on_demand}
    assert {i["stage"] for i in done.json["items"] if i["kind"] == "numbers"} == default
    assert [i["summary"] for i in first["items"]] == [i["summary"] for i in done.json["items"]]
    assert (smoke / "results" / "report.html").is_file()


def test_status_names_the_parameter_and_says_fresh(hrcneuro, smoke):
    given = ("--config", "configs/smoke.toml", "--workdir", smoke)
    assert "stale" not in hrcneuro("status", *given).out
    done = hrcneuro("status", *given, "--set", "preprocess.l_freq=0.5")
    assert "params: preprocess.l_freq 1.0 -> 0.5" in done.out
    assert "stale" in done.out


@pytest.mark.parametrize("words", [[], *COMMANDS], ids=" ".join)
def test_h_is_short_for_help_and_no_summary_is_cut(hrcneuro, words):
    short = hrcneuro(*words, "-h")
    assert short.code == 0
    assert short.out == hrcneuro(*words, "--help").out
    assert not re.search(r"\.\.\.$", short.out.partition("Commands:")[2], flags=re.M)


def test_show_prints_the_numbers_of_every_stage_and_computes_nothing(hrcneuro, smoke):
    given = ("--config", "configs/smoke.toml", "--workdir", smoke)
    for (stage,) in COMMANDS[:8]:
        done = hrcneuro("show", stage, *given)
        assert done.code == 0, done.err
        assert done.out.startswith(f"{stage}, ")
        assert "None" not in done.out
        assert done.err == ""
    assert "trials by condition" in hrcneuro("show", "epoch", "s01", *given).out
    shown = hrcneuro("show", "decode", "group", "--json", *given).json
    assert set(shown["units"]["group"]) >= {"iC", "sC"}
    for words in (["epoch", "s01"], ["epoch"]):
        other = hrcneuro("show", *words, *given, "--set", "epoch.reject_uv=900")
        assert (other.code, other.out) == (3, "")
        assert "params: epoch.reject_uv 1000.0 -> 900.0" in other.err
        assert "--last" in other.err
        last = hrcneuro("show", *words, "--last", *given, "--set", "epoch.reject_uv=900")
        assert (last.code, last.err) == (0, "")
        assert last.out == hrcneuro("show", *words, *given).out


def test_show_answers_for_the_configuration_that_is_asked_whatever_ran_last(hrcneuro, tmp_path):
    given = ("--workdir", tmp_path, "--no-figures", "--set", "simulate.repetitions=2", "--set", "simulate.episodes=20")
    other = (*given, "--set", "simulate.seed=7")
    first = hrcneuro("simulate", *given).out
    second = hrcneuro("simulate", *other).out
    assert first != second
    shown = hrcneuro("show", "simulate", *given)
    assert first.startswith(shown.out.partition("\n")[0])
    assert shown.err == ""
    assert shown.out != hrcneuro("show", "simulate", *other).out
    # What has not been computed is not answered with something else, by any of the commands that read results.
    third = (*given, "--set", "simulate.seed=8")
    for words in (["show", "simulate"], ["path", "simulate", "group"]):
        assert hrcneuro(*words, "--json", *third).json["ok"] is False
        refused = hrcneuro(*words, *third)
        assert (refused.code, refused.out) == (3, "")
        assert "params: simulate.seed 7 -> 8" in refused.err
    assert hrcneuro("show", "simulate", "--last", *third).out == hrcneuro("show", "simulate", *other).out


def test_show_speaks_of_the_units_that_this_configuration_has(hrcneuro, tiny):
    given = ("--config", tiny / "tiny.toml", "--workdir", tiny, "--no-figures", "--executor", "serial")
    assert hrcneuro("epoch", *given).code == 0
    other = (*given, "--set", "epoch.reject_uv=900")
    assert hrcneuro("epoch", "s02", *other).code == 0
    done = hrcneuro("show", "epoch", *other)
    assert (done.code, done.err) == (0, "")
    assert re.findall(r"^epoch, (\w+)$", done.out, flags=re.M) == ["s02"]
    assert re.findall(r"^epoch, (\w+)$", hrcneuro("show", "epoch", *given).out, flags=re.M) == ["s01", "s02"]


def test_what_a_stage_ends_with_is_what_show_prints(hrcneuro, smoke):
    given = ("--config", "configs/smoke.toml", "--workdir", smoke)
    for words in (["epoch", "s01"], ["decode", "group"]):
        assert hrcneuro(*words, *given).out == hrcneuro("show", *words, *given).out
    assert hrcneuro("epoch", "s01", "-q", *given).out == ""


def test_show_of_what_has_never_run_names_the_cure(hrcneuro, tmp_path):
    for words, cure in ((["decode"], "hrcneuro decode SUBJECT"), (["decode", "s01"], "hrcneuro decode s01")):
        done = hrcneuro("show", *words, "--workdir", tmp_path)
        assert (done.code, done.out) == (3, "")
        assert "has not run" in done.err
        assert cure in done.err
    assert list(tmp_path.iterdir()) == []


def test_a_dry_run_and_a_status_are_what_was_asked_for(hrcneuro, tmp_path):
    for words in (["epoch", "s01", "--dry-run"], ["status"]):
        done = hrcneuro(*words, "--workdir", tmp_path)
        assert (done.code, done.err) == (0, "")
        assert "never run" in done.out


def test_a_dry_run_writes_nothing(hrcneuro, tmp_path):
    assert "would write" in hrcneuro("report", "--dry-run", "--workdir", str(tmp_path)).out
    damaged = tmp_path / "cache" / "acquire" / "s01" / ("0" * 16)
    damaged.mkdir(parents=True)
    assert hrcneuro("cache", "verify", "--dry-run", "--workdir", str(tmp_path)).code == 3
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["0" * 16, "acquire", "cache", "s01"]
