"""On a terminal, in a pipe, for a program: what is printed where."""

import json
import os
import pty
import re
import subprocess
import sys

import pytest
from tiny_study import ROOT, wait_for

COMMAND = [sys.executable, "-m", "hrcneuro"]
COLOUR = re.compile(r"\x1b\[[\d;]*3[1-7]")
ACQUIRE = ("acquire", "--config", "tiny.toml", "--workdir", "study", "--executor", "serial")


class Terminal:
    """A command on a pseudo-terminal of its own; standard output may go to a file instead."""

    def __init__(self, *arguments, cwd, stdout=None, **environment):
        env = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "HRCNEURO_CACHE")}
        env |= {"TERM": "xterm-256color", "COLUMNS": "100", "PYTHONPATH": str(ROOT), **environment}
        pid, self.screen = pty.fork()
        if pid == 0:
            os.chdir(cwd)
            if stdout is not None:
                os.dup2(os.open(stdout, os.O_WRONLY | os.O_CREAT), 1)
            os.execvpe(sys.executable, [*COMMAND, *arguments], env)
        self.pid, self.text = pid, ""

    def read(self):
        """Take in what has been printed since; return whether the terminal is still in use."""
        try:
            piece = os.read(self.screen, 65536)
        except OSError:
            return False
        self.text += piece.decode(errors="replace")
        return bool(piece)

    def end(self):
        """Read to the end; return the exit code."""
        while self.read():
            pass
        os.close(self.screen)
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


def test_a_terminal_shows_a_bar_that_is_gone_in_the_end(tiny):
    terminal = Terminal(*ACQUIRE, cwd=tiny)
    assert terminal.end() == 0
    assert "0/2" in terminal.text
    assert "1/2" in terminal.text
    assert "left" in terminal.text
    assert COLOUR.search(terminal.text)
    assert "+ acquire s01" in terminal.text
    # The line of the bar is erased before the closing line.
    assert "\x1b[2K" in terminal.text.rpartition("2/2")[2] or "\x1b[2K" in terminal.text.rpartition("1/2")[2]
    assert terminal.text.rstrip().endswith("acquire: 2 ran")


def test_no_color_is_obeyed(tiny):
    terminal = Terminal(*ACQUIRE, cwd=tiny, NO_COLOR="1")
    assert terminal.end() == 0
    assert "2 ran" in terminal.text
    assert not COLOUR.search(terminal.text)


def test_json_goes_to_standard_output_and_talk_to_the_terminal(tiny):
    terminal = Terminal(*ACQUIRE, "--json", cwd=tiny, stdout=tiny / "out.json")
    assert terminal.end() == 0
    assert [item["state"] for item in json.loads((tiny / "out.json").read_text())["items"]] == ["ran", "ran"]
    assert "2 ran" in terminal.text
    assert '"items"' not in terminal.text


def test_ctrl_c_on_the_terminal(tiny):
    terminal = Terminal("acquire", "--config", "tiny.toml", "--workdir", "study", "-j", "2", cwd=tiny)
    wait_for(lambda: sorted(tiny.glob("study/cache/*/*/.tmp-*")))
    os.write(terminal.screen, b"\x03")
    assert terminal.end() == 130
    assert "interrupted" in terminal.text
    assert "Traceback" not in terminal.text
    assert "\x1b[?25h" in terminal.text.rpartition("\x1b[?25l")[2], "the cursor is not shown again"
    assert sorted(tiny.glob("study/cache/*/*/.tmp-*")) == []


def shell(text, cwd=ROOT):
    command = f"{sys.executable} -m hrcneuro"
    return subprocess.run(
        ["bash", "-c", f"set -o pipefail; {text.replace('hrcneuro', command, 1)}"],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    "text", ["hrcneuro config show | head -1", "hrcneuro --help | head -1", "hrcneuro config show --json | true"]
)
def test_a_reader_that_leaves_is_no_failure(text):
    done = shell(text)
    assert (done.returncode, done.stderr) == (0, "")


def test_output_that_cannot_be_written_is_a_failure_with_one_message():
    done = shell("hrcneuro config show --json > /dev/full")
    assert done.returncode == 1
    assert "No space left" in done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr


FAILURES = {
    "no such option": (["epoch", "--colour"], 2),
    "no such command": (["epok"], 2),
    "a value of the wrong type": (["epoch", "-j", "many"], 2),
    "a missing argument": (["path"], 2),
    "an unknown subject": (["epoch", "nobody"], 2),
    "a misspelt key": (["epoch", "--set", "epoch.tmim=1"], 2),
    "a misspelt executor": (["epoch", "--executor", "cloud"], 2),
    "no workers": (["epoch", "-j", "-1"], 2),
    "no configuration": (["epoch", "--config", "nowhere.toml"], 2),
    "no pipeline": (["run", "nowhere.toml"], 2),
    "nothing there": (["path", "epoch", "s01"], 3),
    "no data": (["epoch", "s01", "--set", "acquire.source=dataset", "--set", "acquire.path=/nowhere"], 3),
    "a broken cache": (["cache", "verify"], 3),
}


@pytest.mark.parametrize("name", FAILURES)
def test_every_failure_is_one_json_document(hrcneuro, tmp_path, name):
    words, code = FAILURES[name]
    (tmp_path / "cache" / "erp" / "s01" / "0123456789abcdef").mkdir(parents=True)
    done = hrcneuro(*words, "--json", "--workdir", tmp_path)
    assert done.code == code, done.err
    assert done.json["ok"] is False
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    "words",
    [
        ["status"],
        ["run", "--dry-run"],
        ["epoch", "s01", "--dry-run"],
        ["cache", "ls"],
        ["cache", "verify"],
        ["cache", "gc"],
        ["config", "show"],
        ["config", "check"],
    ],
    ids=" ".join,
)
def test_every_success_is_one_json_document(hrcneuro, tmp_path, words):
    done = hrcneuro(*words, "--json", "--workdir", tmp_path)
    assert done.code == 0, done.err
    assert isinstance(done.json, dict)


def test_a_cached_run_loads_no_numeric_library(smoke):
    """Whoever asks again gets the answer at once: nothing is loaded for computing."""
    command = ["run", "pipelines/smoke.toml", "--workdir", str(smoke), "--json"]
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "hrcneuro", *command],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert {item["state"] for item in json.loads(done.stdout)["items"]} == {"hit"}
    loaded = {line.rpartition("|")[2].strip().partition(".")[0] for line in done.stderr.splitlines()}
    assert loaded & {"numpy", "scipy", "pandas", "mne", "pyarrow", "sklearn", "matplotlib", "ruckig"} == set()
