"""TAB: what is offered, and what bash and zsh make of it."""

import shutil
import subprocess
from types import SimpleNamespace

import pytest

from hrcneuro.cli import completion, shells
from hrcneuro.config import settings
from hrcneuro.paradigm.design import CONDITIONS

LINES = {
    "hrcneuro ep": ([], "ep"),
    "hrcneuro epoch ": (["epoch"], ""),
    "hrcneuro epoch s01 --set a.b=": (["epoch", "s01", "--set"], "a.b="),
    "hrcneuro epoch 'o": (["epoch"], "o"),
    "hrcneuro epoch o\\'br": (["epoch"], "o'br"),
    'hrcneuro epoch "two w': (["epoch"], "two w"),
    "hrcneuro": ([], ""),
}


@pytest.mark.parametrize("line", LINES)
def test_a_line_is_read_as_the_shell_reads_it(line):
    assert shells.split(line) == LINES[line]


def offered(*words, capsys, monkeypatch, shell="zsh"):
    from hrcneuro.cli.app import app

    monkeypatch.setenv("HRCNEURO_LINE", " ".join(("hrcneuro", *words)))
    assert shells.offer(app, shell) == 0
    return [line.partition("\t")[0] for line in capsys.readouterr().out.splitlines()]


@pytest.mark.parametrize(
    ("words", "some"),
    [
        (["epo"], ["epoch"]),
        (["show", ""], ["acquire", "robot"]),
        (["epoch", "--set", ""], ["preprocess.", "study.", "conditions."]),
        (["epoch", "--set", "study."], ["study.subjects=", "study.exclude="]),
        (["epoch", "--set", "study.subjects="], ['study.subjects=["o\'brien", "s02"]']),
        (
            ["epoch", "--set", "study.stages="],
            [
                'study.stages=["acquire", "preprocess", "epoch", "erp", "ersp", "rerp", "decode", "transfer", '
                '"simulate", "robot", "calibrate"]'
            ],
        ),
        (["epoch", "--set", "conditions."], ["conditions.go=", 'conditions."no go"=']),
        (["epoch", "--set", "conditions.g"], ["conditions.go="]),
        (["epoch", "--set", "conditions.go="], ["conditions.go=event == 'go'"]),
        (["epoch", "--set", "contrasts."], ["contrasts.HR-HH_before="]),
        (["epoch", "--set", "preprocess.l_freq="], ["preprocess.l_freq=0.7"]),
        (["simulate", "--sweep", ""], ["accuracy=", "period=", "wide"]),
        (["simulate", "--sweep", "ac"], ["accuracy="]),
        (["run", ""], ["smoke", "paper", ""]),
        (["epoch", "--config", "s"], ["smoke", ""]),
        (["epoch", "--config=s"], ["--config=smoke", ""]),
        (["epoch", "--set=preprocess.l_"], ["--set=preprocess.l_freq="]),
        (["epoch", "--set=preprocess.l_freq="], ["--set=preprocess.l_freq=0.7"]),
        (["epoch", "--set", "preprocess.l_"], ["preprocess.l_freq="]),
        (["robot", "--set", "robot.backend="], ["robot.backend=ursim", "robot.backend=ros"]),
        (["robot", "--set", "simulate.confound="], ["simulate.confound=true", "simulate.confound=false"]),
        (["robot", "--backend", "ur"], ["ursim", "ur"]),
        (["robot", "--executor", "s"], ["serial"]),
        (["robot", "--exec"], ["--executor"]),
        (["epoch", "o"], ["o'brien"]),
    ],
)
def test_what_may_follow_is_offered(capsys, monkeypatch, tmp_path, words, some):
    (tmp_path / "hrcneuro.toml").write_text(
        '[study]\nsubjects = ["o\'brien", "s02"]\n[preprocess]\nl_freq = 0.7\n'
        '[conditions]\ngo = "event == \'go\'"\n"no go" = "event == \'nogo\'"\n'
    )
    monkeypatch.chdir(tmp_path)
    assert set(some) <= set(offered(*words, capsys=capsys, monkeypatch=monkeypatch))


@pytest.mark.parametrize(
    ("words", "all_of_them"),
    [
        (["epoch", "--config", "smoke", ""], ["s01", "s02", "s03"]),
        (["epoch", "--config", "smoke", "--set", "study.subjects="], ['study.subjects=["s01", "s02", "s03"]']),
        # Nothing that begins otherwise; files, of which there may be some.
        (["run", "smo"], ["smoke", ""]),
        (["run", "study."], [""]),
        (["epoch", "--set", "conditions.R"], [f"conditions.{one}=" for one in CONDITIONS if one.startswith("R")]),
        (["epoch", "--config", "nowhere.toml", ""], [f"s{i:02d}" for i in range(1, 13)]),
    ],
)
def test_nothing_else_is_offered(capsys, monkeypatch, tmp_path, words, all_of_them):
    monkeypatch.chdir(tmp_path)
    assert offered(*words, capsys=capsys, monkeypatch=monkeypatch) == all_of_them


def test_what_is_offered_behind_set_is_understood(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for section in ("study", "conditions", "contrasts", "problems", "simulate"):
        keys = offered("epoch", "--set", f"{section}.", capsys=capsys, monkeypatch=monkeypatch)
        given = [v for key in keys for v in offered("epoch", "--set", key, capsys=capsys, monkeypatch=monkeypatch)[:1]]
        assert len(given) > 1
        settings.load(assignments=given)


@pytest.mark.parametrize(
    ("word", "found"),
    [
        ("--config=sm", ["smoke", "\t"]),
        ("--set=robot.backend=ur", ["ursim", "ur"]),
        ("--set=robot.back", ["robot.backend="]),
    ],
)
def test_bash_puts_in_the_value_behind_an_option_s_equals_sign(capsys, monkeypatch, tmp_path, word, found):
    from hrcneuro.cli.app import app

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HRCNEURO_LINE", f"hrcneuro robot {word}")
    assert shells.offer(app, "bash") == 0
    assert capsys.readouterr().out.splitlines() == found


@pytest.mark.parametrize("words", [["acquire", "--set", "acquire.path="], ["nosuch", "x"], ["epoch", "--set", "no.k"]])
def test_where_nothing_is_offered_the_shell_offers_files(capsys, monkeypatch, words):
    assert offered(*words, capsys=capsys, monkeypatch=monkeypatch) == []


def test_every_option_of_every_stage_is_offered_with_its_meaning():
    from hrcneuro.stages import NAMES

    nothing_given = SimpleNamespace(params={})
    for stage in NAMES:
        keys = completion.assignments(nothing_given, f"{stage}.")
        assert keys
        assert all(name.startswith(f"{stage}.") and name.endswith("=") and help for name, help in keys)


def run(shell, script, folder, offers):
    """Let a shell complete with a command that offers these lines; return what the script printed."""
    stand_in = folder / "hrcneuro"
    stand_in.write_text("#!/bin/sh\ncat <<'END'\n" + "\n".join(offers) + "\nEND\n")
    stand_in.chmod(0o755)
    (folder / "script").write_text(shells.SCRIPTS[shell] + script)
    path = shutil.which(shell)
    if path is None:
        pytest.skip(f"needs {shell}")
    done = subprocess.run(
        [path, *(["-f"] if shell == "zsh" else ["--norc"]), "script"],
        cwd=folder,
        env={"PATH": f"{folder}:/usr/bin:/bin", "HOME": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    return done.stdout.splitlines()


_BASH = """
COMP_LINE="hrcneuro epoch o"; COMP_POINT=${#COMP_LINE}
compopt() { echo "no space"; }
_hrcneuro hrcneuro
printf '%s\\n' "${COMPREPLY[@]}"
"""
_ZSH = """
compadd() { print -r -- "$*"; for offer in "${(@P)@[-1]}"; do print -r -- "offer $offer"; done }
words=(hrcneuro epoch o); CURRENT=3
_hrcneuro
"""


_FILES = """
COMP_LINE="hrcneuro run s"; COMP_POINT=${#COMP_LINE}; COMP_WORDS=(hrcneuro run s); COMP_CWORD=2
compopt() { echo "$*"; }
_hrcneuro hrcneuro
printf '%s\\n' "${COMPREPLY[@]}"
"""
_ZSH_FILES = """
compadd() { print -r -- "${(@P)@[-1]}"; }
compset() { print -r -- "compset $*"; }
_files() { print files; }
"""


def test_bash_offers_names_and_files_together(tmp_path):
    (tmp_path / "study.toml").touch()
    (tmp_path / "other.toml").touch()
    said, *found = run("bash", _FILES, tmp_path, ["smoke", "\t"])
    assert (said, sorted(found)) == ("-o filenames", ["script", "smoke", "study.toml"])


@pytest.mark.parametrize(
    ("words", "offers", "printed"),
    [
        ("run s", ["smoke", "\t"], ["smoke", "files"]),
        ("run st", ["\t"], ["files"]),
        ("acquire --set acquire.path=rec", [""], ["compset -P 1 *=", "files"]),
        ("epoch --config=st", ["\t"], ["compset -P 1 *=", "files"]),
        ("epoch --workdir a=b/", [""], ["files"]),
        ("epoch s", ["s01"], ["s01"]),
    ],
)
def test_zsh_offers_files_where_they_may_stand(tmp_path, words, offers, printed):
    asked = f'words=(hrcneuro {words}); CURRENT=$#words; PREFIX="$words[-1]"; _hrcneuro\n'
    assert run_zsh(tmp_path, "compdef() { }\n", _ZSH_FILES + asked, offers) == printed


def test_bash_puts_in_what_is_offered_and_no_space_behind_what_goes_on(tmp_path):
    assert run("bash", _BASH, tmp_path, [shells._for_bash("o'brien", "o")]) == ["o\\'brien"]
    assert run("bash", _BASH, tmp_path, ["l_freq="]) == ["no space", "l_freq="]
    assert shells._for_bash("robot.backend=ursim", "robot.backend=u") == "ursim"


def test_zsh_keeps_apostrophes_and_puts_no_space_behind_what_goes_on(tmp_path):
    script = _ZSH.replace("\n", "\ncompdef() { }\n", 1)
    text = "compdef() { }\n"
    found = run_zsh(tmp_path, text, script, ["o'brien\tthe paper's subject", "preprocess.l_freq=\tlower edge"])
    assert found == [
        "-l -S  -d openly -a open",
        "offer preprocess.l_freq=",
        "-l -d doing -a done",
        "offer o'brien",
    ]


def run_zsh(folder, first, script, offers):
    before = shells.SCRIPTS["zsh"]
    shells.SCRIPTS["zsh"] = first + before
    try:
        return run("zsh", script, folder, offers)
    finally:
        shells.SCRIPTS["zsh"] = before


@pytest.mark.parametrize(("shell", "startup"), [("bash", ".bashrc"), ("zsh", ".zshrc"), ("fish", None)])
def test_teaching_twice_changes_nothing_more(tmp_path, monkeypatch, capsys, shell, startup):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("SHELL", f"/bin/{shell}")
    written = []
    for _ in range(2):
        assert shells.teach(install=True) == 0
        written.append({p: p.read_text() for p in tmp_path.rglob("*") if p.is_file()})
    assert written[0] == written[1]
    assert (startup is None) or (tmp_path / startup) in written[0]
    assert shell in capsys.readouterr().out


def test_an_unknown_shell_is_told_with_a_cure(monkeypatch, capsys):
    monkeypatch.setenv("SHELL", "/bin/ksh")
    assert shells.teach(install=False) == 2
    assert "cure" in capsys.readouterr().err
