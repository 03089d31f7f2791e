"""Around a study: doctor, init, completion, and the log that every run leaves."""

import json
import os
import re
import stat

import pytest


def tab(line):
    """Return what a shell sets to ask what may follow ``line``."""
    return {"HRCNEURO_LINE": line, "_HRCNEURO_COMPLETE": "bash"}


def logs(workdir):
    """Return the log files of a working folder, oldest first, each as a list of objects."""
    return [
        [json.loads(line) for line in path.read_text().splitlines()]
        for path in sorted((workdir / "results" / "log").glob("*.jsonl"))
    ]


def test_doctor_finds_everything_needed_here(hrcneuro, tmp_path):
    done = hrcneuro("doctor", "--json", "--workdir", tmp_path)
    assert done.code == 0, done.out
    view = done.json
    assert view["problems"] == []
    assert {"numpy", "mne", "pyarrow"} <= set(view["libraries"])
    assert "absent" not in view["libraries"].values()
    assert set(view["cache_test"].values()) == {"ok"}
    assert view["cores"] >= 1
    assert view["memory_gb"] > 0.1
    assert view["disk_free_gb"] > 0
    assert view["blas"]
    assert "xdf" in view["extras"]
    assert list(tmp_path.iterdir()) == []


def test_doctor_says_how_much_disk_the_study_wants(hrcneuro, tmp_path):
    few, many = ("study.subjects=['s01']", "study.subjects=['s01', 's02', 's03']")
    wanted = [hrcneuro("doctor", "--json", "--workdir", tmp_path, "--set", given).json for given in (few, many)]
    small, large = (one["disk_wanted_gb"] for one in wanted)
    assert 0.3 < small < 2
    assert 2.5 < large / small < 3.5
    told = hrcneuro("doctor", "--workdir", tmp_path, "--set", few).out
    assert f"{small:.3g} GB more, in part estimated" in told


def test_doctor_names_a_disk_that_is_too_small(tmp_path):
    from hrcneuro.cli.doctor import examine, exit_code
    from hrcneuro.config import settings
    from hrcneuro.pipeline.disk_forecast import DiskForecast

    forecast = DiskForecast(tasks=3, size=5 * 10**9, estimated=0, unknown=(), free=10**9)
    view = examine(lambda: settings.load(None, ()), tmp_path / "cache", lambda: forecast)
    assert exit_code(view) == 1
    assert view["problems"] == [str(forecast)]
    assert "that is not enough" in view["problems"][0]


def test_doctor_lists_the_mistakes_of_a_configuration_among_the_problems(hrcneuro, tmp_path):
    (tmp_path / "hrcneuro.toml").write_text("[epok]\n")
    done = hrcneuro("doctor", cwd=tmp_path)
    assert done.code == 1
    assert "did you mean 'epoch'" in done.out
    assert "lock             ok" in done.out


def test_doctor_says_whether_the_arm_answers(hrcneuro, tmp_path):
    given = ("--set", "robot.backend=ur", "--set", "robot.host=127.0.0.9", "--workdir", tmp_path, "--json")
    assert hrcneuro("doctor", *given).json["devices"]["arm"].startswith("ur at 127.0.0.9: no answer on port 29999")


def test_doctor_names_what_is_wrong_and_exits_1(hrcneuro, tmp_path):
    (tmp_path / "cache").write_text("in the way")
    done = hrcneuro("doctor", "--workdir", tmp_path)
    assert done.code == 1
    assert "problem: cache: write, publish:" in done.out
    assert "cannot be written" in done.out


@pytest.fixture(scope="module")
def package_without(tmp_path_factory):
    """Return a function that makes importlib.metadata say that a distribution is another version."""

    def patch(name, version):
        folder = tmp_path_factory.mktemp("site")
        (folder / f"{name}-{version}.dist-info").mkdir()
        (folder / f"{name}-{version}.dist-info" / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
        )
        return folder

    return patch


def test_doctor_names_a_library_that_is_too_old(hrcneuro, tmp_path, package_without):
    folder = package_without("mne", "1.2.0")
    done = hrcneuro("doctor", "--workdir", tmp_path, env={"PYTHONPATH": str(folder)})
    assert done.code == 1
    assert re.search(r"problem: mne is 1\.2\.0; needed: 1\.\d+ or newer", done.out)


def test_a_new_study_runs_as_it_is(hrcneuro, tmp_path):
    done = hrcneuro("init", "mystudy", cwd=tmp_path)
    assert done.code == 0, done.err
    folder = tmp_path / "mystudy"
    assert sorted(p.name for p in folder.iterdir()) == [".gitignore", "README.md", "hrcneuro.toml"]
    assert hrcneuro("config", "check", cwd=folder).code == 0
    plan = hrcneuro("run", "--dry-run", "--json", cwd=folder)
    assert plan.code == 0, plan.err
    assert len({i["stage"] for i in plan.json["items"] if i["kind"] == "numbers"}) == 8
    ran = hrcneuro("epoch", "s01", "-j", "1", cwd=folder)
    assert ran.code == 0, ran.err
    assert (folder / "results" / "s01" / "epoch.json").is_file()


def test_every_option_in_a_new_study_says_what_it_means(tmp_path):
    from hrcneuro.cli import init as newstudy

    newstudy.create(tmp_path / "new")
    lines = (tmp_path / "new" / "hrcneuro.toml").read_text().split("# --- ")[0].splitlines()
    options = [line for line in lines if re.match(r"\w+ = ", line)]
    assert len(options) > 15
    assert all("  # " in line for line in options)


def test_init_refuses_a_folder_that_holds_something(hrcneuro, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").touch()
    done = hrcneuro("init", "full", cwd=tmp_path)
    assert done.code == 2
    assert "is not empty: it holds thesis.tex" in done.err
    assert [p.name for p in (tmp_path / "full").iterdir()] == ["thesis.tex"]
    (tmp_path / "file").touch()
    assert "is a file" in hrcneuro("init", "file", cwd=tmp_path).err
    dry = hrcneuro("init", "new", "--dry-run", "--json", cwd=tmp_path)
    assert dry.json["files"] == ["hrcneuro.toml", "README.md", ".gitignore"]
    assert not (tmp_path / "new").exists()


def test_a_run_leaves_a_log_that_names_no_one(hrcneuro, tiny):
    home = tiny / "home" / "alice"
    (home / "study").mkdir(parents=True)
    given = ("--config", tiny / "tiny.toml", "--workdir", home / "study", "-j", "1")
    env = {"HOME": str(home), "USER": "alice", "LOGNAME": "alice"}
    assert hrcneuro("epoch", "s01", *given, env=env).code == 0
    assert hrcneuro("epoch", "s01", *given, env=env).code == 0
    bad = ("--set", "acquire.source=dataset", "--set", f"acquire.path={home}/data")
    assert hrcneuro("epoch", "s01", *given, *bad, env=env).code == 3
    first, second, third = logs(home / "study")
    assert [line["event"] for line in (first[0], first[-1])] == ["start", "end"]
    lines = [line for line in first if line["event"] == "item" and not line["stage"].endswith(".figures")]
    states = [(line["stage"], line["state"]) for line in lines]
    assert states == [(s, state) for s in ("acquire", "preprocess", "epoch") for state in ("running", "ran")]
    assert first[-1]["states"] == {"ran": 5}
    assert [line["state"] for line in second[1:-1]] == ["hit"] * 5
    assert first[0]["config"] == second[0]["config"] != third[0]["config"]
    assert (third[-1]["outcome"], third[-1]["exit_code"]) == ("failed", 3)
    assert "alice" not in json.dumps([first, second, third])


def test_looking_and_planning_leave_no_log(hrcneuro, tiny):
    given = ("--config", tiny / "tiny.toml", "--workdir", tiny)
    assert hrcneuro("epoch", "s01", "--dry-run", *given).code == 0
    assert hrcneuro("status", *given).code == 0
    assert not (tiny / "results").exists()


def test_fifty_logs_are_kept_and_a_log_that_cannot_be_written_stops_nothing(tmp_path):
    from hrcneuro.config import settings as config
    from hrcneuro.pipeline import runlog

    settings = config.load(folder=tmp_path)
    for _ in range(runlog.KEEP + 5):
        with runlog.recorded(tmp_path / "results", "epoch", settings, "hrcneuro epoch"):
            pass
    assert len(logs(tmp_path)) == runlog.KEEP
    (tmp_path / "file").touch()
    with runlog.recorded(tmp_path / "file", "epoch", settings, "hrcneuro epoch") as log:
        log.write("item")


def test_an_interrupt_is_the_last_line(tmp_path):
    from hrcneuro.config import settings as config
    from hrcneuro.pipeline import runlog

    with (
        pytest.raises(KeyboardInterrupt),
        runlog.recorded(tmp_path / "results", "run", config.load(folder=tmp_path), "hrcneuro run"),
    ):
        raise KeyboardInterrupt
    assert logs(tmp_path)[0][-1]["outcome"] == "interrupted"


def test_tab_offers_the_subjects_of_the_configuration(hrcneuro, tmp_path):
    offered = hrcneuro(cwd=tmp_path, env=tab("hrcneuro epoch s")).out.split()
    assert offered == [f"s{i:02d}" for i in range(1, 13)]
    (tmp_path / "hrcneuro.toml").write_text('[study]\nsubjects = ["sam", "tom", "sue"]\n[epok]\n')
    assert hrcneuro(cwd=tmp_path, env=tab("hrcneuro epoch s")).out.split() == ["sam", "sue"]
    assert hrcneuro(cwd=tmp_path, env=tab("hrcneuro path ep")).out.split() == ["epoch"]
    units = hrcneuro(cwd=tmp_path, env=tab("hrcneuro path epoch ")).out.split()
    assert units == ["sam", "tom", "sue", "group"]
    assert hrcneuro(cwd=tmp_path, env=tab("hrcneuro config show con")).out.split() == ["conditions", "contrasts"]


def test_completion_installs_itself(hrcneuro, tmp_path):
    home = {"HOME": str(tmp_path), "PATH": os.environ["PATH"], "SHELL": "/bin/bash"}
    done = hrcneuro("--install-completion", env=home)
    assert done.code == 0, done.err
    script = tmp_path / ".local" / "share" / "bash-completion" / "completions" / "hrcneuro"
    assert "_HRCNEURO_COMPLETE=bash" in script.read_text()
    assert stat.S_IMODE(script.stat().st_mode) & 0o400
