"""Streams that are closed, full or ASCII, and names that are not UTF-8: the exit code stays the documented one."""

import json
import os
import subprocess
import sys

import foreign
import pytest
from edf_files import save_edf, tal
from tiny_study import ROOT

COMMANDS = {
    "--help": 0,
    "simulate --help": 0,
    "status": 0,
    "config show": 0,
    "cache ls --json": 0,
    "path epoch s01": 3,
    "epoch nobody --json": 2,
    "epoch --colour": 2,
}
STREAMS = {
    "a reader that left": "| true",
    "one that left both": "2>&1 | true",
    "no standard output": ">&-",
    "no standard error": "2>&-",
    "no standard input": "<&-",
    "none at all": "<&- >&- 2>&-",
    "standard error on a full disk": "2>/dev/full",
    "unbuffered, and gone": "| head -c 1",
}
ASCII = {"PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LC_ALL": "C", "PYTHONIOENCODING": "ascii"}
BAD = os.fsdecode(b"caf\xe9")


def shell(text, cwd, **environment):
    """Run a line in which ``hrcneuro`` is the product; return its exit code and all that it printed."""
    env = {k: v for k, v in os.environ.items() if k != "HRCNEURO_CACHE"} | {"PYTHONPATH": str(ROOT), **environment}
    line = f"{text.replace('hrcneuro', f'{sys.executable} -m hrcneuro', 1)}; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", line], cwd=cwd, env=env, capture_output=True, check=False)
    printed = (done.stdout + done.stderr).decode(errors="backslashreplace")
    for word in ("Traceback", "as a bug", "Exception ignored", "unexpected"):
        assert word not in printed
    return done.returncode, printed


@pytest.mark.parametrize("stream", STREAMS)
def test_no_stream_changes_how_a_command_ends(tmp_path, stream):
    unbuffered = {"PYTHONUNBUFFERED": "1"} if "unbuffered" in stream else {}
    # Each stream with one that ends well and with two that fail, each command with several streams.
    good, bad = [[words for words, code in COMMANDS.items() if bool(code) is fails] for fails in (False, True)]
    turn = list(STREAMS).index(stream)
    for words in (good[turn % len(good)], bad[turn % len(bad)], bad[(turn + 1) % len(bad)]):
        code = COMMANDS[words]
        assert shell(f"hrcneuro {words} {STREAMS[stream]}", tmp_path, **unbuffered)[0] == code, words


@pytest.mark.parametrize("words", ["--help", "config show", "config show --json", "status", "cache verify"])
def test_output_that_is_lost_is_a_failure_that_names_the_stream(tmp_path, words):
    code, printed = shell(f"hrcneuro {words} >/dev/full", tmp_path)
    assert code == 1
    assert "standard output cannot be written: No space left on device" in printed
    assert "cure" in printed


def test_a_failure_keeps_its_code_where_its_output_is_lost(tmp_path):
    assert shell("hrcneuro epoch nobody --json >/dev/full", tmp_path)[0] == 2


@pytest.mark.parametrize(
    ("workers", "stream"),
    [
        *(("-j 1", "2>&1 | head -1"), ("-j 2", "--json | true"), ("-j 1", "2>/dev/full")),
        # What is closed here is closed in the workers, too.
        *(("-j 1", "<&- >&- 2>&-"), ("-j 2", "<&- >&- 2>&-")),
    ],
)
def test_a_run_whose_reader_leaves_goes_on_to_its_end(tiny, stream, workers):
    line = f"hrcneuro acquire --config tiny.toml --workdir study {workers} {stream}"
    assert shell(line, tiny)[0] == 0
    assert len(list(tiny.glob("study/cache/acquire/*/*/record.json"))) == 2


def test_a_slow_reader_of_a_pipe_that_does_not_wait_gets_all(tmp_path):
    """Some programs leave a pipe in the state in which a write answers "not now"."""
    theirs, ours = os.pipe()
    os.set_blocking(ours, False)
    command = [sys.executable, "-m", "hrcneuro", "config", "show", "--json"]
    process = subprocess.Popen(command, stdout=ours, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)})
    os.close(ours)
    with open(theirs, "rb") as pipe:
        assert json.loads(pipe.read())["config"]["simulate"]
    assert process.wait() == 0


@pytest.mark.parametrize(
    "words", ["config show", "acquire --rules", "--help", "status", "doctor", "config show --json"]
)
def test_a_locale_without_unicode_is_written_in_escapes(tmp_path, words):
    code, printed = shell(f"hrcneuro {words}", tmp_path, **ASCII)
    assert code == 0
    if words == "config show":
        assert r"m/s\u00b2" in printed
        (tmp_path / "all.toml").write_text(printed)
        assert shell("hrcneuro config check --config all.toml", tmp_path, **ASCII)[0] == 0


def test_a_study_runs_in_a_locale_without_unicode(tiny):
    asked = "--config tiny.toml --workdir study --set simulate.learner_repetitions=0"
    code, printed = shell(f"hrcneuro simulate {asked} -j 1", tiny, **ASCII)
    assert code == 0, printed
    assert "pictures: 1 ran" in printed
    code, printed = shell(f"hrcneuro report {asked}", tiny, **ASCII)
    assert code == 0, printed
    assert "µ" in (tiny / "study" / "results" / "report.html").read_text(encoding="utf-8")


def test_a_name_that_the_locale_lacks_is_a_mistake_with_a_cure(tiny):
    text = (tiny / "tiny.toml").read_text().replace('"s02"', '"söl"')
    (tiny / "tiny.toml").write_text(text, encoding="utf-8")
    code, printed = shell("hrcneuro acquire --config tiny.toml --workdir study -j 1", tiny, **ASCII)
    assert code == 2
    assert "LC_ALL=C.UTF-8" in printed


def test_a_study_lives_in_a_folder_whose_name_is_not_utf8(tiny):
    os.rename(tiny / "tiny.toml", tiny / f"{BAD}.toml")
    given = "--config $'caf\\xe9.toml' --workdir $'caf\\xe9' -j 2"
    assert shell(f"hrcneuro epoch s01 {given}", tiny)[0] == 0
    assert "1 fresh" in shell(f"hrcneuro acquire s01 {given}", tiny)[1]
    code, printed = shell(f"hrcneuro path acquire s01 {given}", tiny)
    assert (code, r"caf\xe9/cache/acquire" in printed) == (0, True)
    # What it prints is a path that a shell finds.
    assert shell(f'ls "$(hrcneuro path acquire s01 {given})"', tiny)[0] == 0
    assert shell(f"hrcneuro report {given.replace('-j 2', '-j 1')}", tiny)[0] == 0
    (log, *_) = (tiny / BAD / "results" / "log").iterdir()
    assert all(json.loads(line)["event"] for line in log.read_text(encoding="utf-8").splitlines())


@pytest.mark.parametrize("name", ["rec.set", f"{BAD}.edf"])
def test_a_recording_is_read_whose_name_is_not_utf8(tiny, name):
    path = tiny / BAD / name
    path.parent.mkdir()
    data = foreign.eeg_uv(9, 2000)
    if name.endswith("set"):
        foreign.save_set(path, data, foreign.NAMES, 100.0, [(1, 200 + 100 * i) for i in range(10)])
    else:
        marks = {i: tal(f"+{i}.5", "1") for i in range(2, 18)}
        rows = zip(foreign.NAMES, data, strict=True)
        save_edf(
            path,
            [(one, "uV", values.reshape(20, 100)) for one, values in rows],
            times=[f"+{i}" for i in range(20)],
            lists=marks,
        )
    place = name.replace(BAD, r"caf\xe9")
    values = (rf"path=$'caf\xe9/{place}'", "source=file", '\'event_map={"1"="a"}\'')
    given = " ".join(f"--set acquire.{value}" for value in values)
    code, printed = shell(f"hrcneuro acquire s01 --config tiny.toml {given} -j 1 --workdir w", tiny)
    assert code == 0, printed


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ("epoch $'caf\\xe9'", 2, r"unknown subject 'caf\xe9'"),
        ("path epoch $'caf\\xe9'", 2, r"unknown subject 'caf\xe9'"),
        ("epoch --config $'caf\\xe9.toml'", 2, r"caf\xe9.toml does not exist"),
        ("run $'caf\\xe9.toml'", 2, r"caf\xe9.toml does not exist"),
        ("epoch --set study.name=$'caf\\xe9'", 2, "not in UTF-8"),
        ("epoch --set conditions.$'caf\\xe9'=x", 2, "allowed: names in UTF-8"),
        ("epoch --set 'study.subjects=[\"'$'caf\\xe9''\"]'", 2, "not in UTF-8"),
        ("epoch --$'caf\\xe9'", 2, "No such option"),
        ("init $'caf\\xe9'", 0, "wrote hrcneuro.toml"),
        ("simulate --executor $'caf\\xe9'", 2, r"unknown executor 'caf\xe9'"),
        ("frob$'\\xe9'", 2, r"'frob\xe9'"),
    ],
)
def test_words_that_are_not_utf8_are_understood_or_refused(tmp_path, words, code, said):
    """Each byte is shown as what it is, however Python would write it."""
    ended, printed = shell(f"hrcneuro {words}", tmp_path)
    assert (ended, said in printed) == (code, True), printed
    assert "udc" not in printed


def test_a_locale_without_unicode_shows_each_byte_of_a_name(tmp_path):
    code, printed = shell("hrcneuro epoch $'caf\\xc3\\xa9'", tmp_path, **ASCII)
    assert code == 2
    assert r"unknown subject 'caf\xc3\xa9'" in printed


def test_a_limit_of_file_sizes_is_said_with_its_cure(tiny):
    """The system tells no file's name with it."""
    code, printed = shell("ulimit -f 4; hrcneuro acquire s01 --config tiny.toml --workdir study -j 1", tiny)
    assert code == 1
    assert f"under {tiny / 'study' / 'cache'} has become larger than is allowed" in printed
    assert "ulimit -f" in printed


@pytest.mark.parametrize("device", ["/dev/full", "/dev/zero"])
@pytest.mark.parametrize("words", ["config check --config", "run"])
def test_a_device_without_end_is_no_configuration(tmp_path, words, device):
    code, printed = shell(f"hrcneuro {words} {device}", tmp_path)
    assert code == 2
    assert f"{device} has more than" in printed


@pytest.mark.parametrize(
    "words", ["init", "export --bids", "acquire s01 --export", "acquire s01 -j 1 --workdir", "config check --config"]
)
def test_a_device_is_no_folder(tmp_path, words):
    code, printed = shell(f"hrcneuro {words} /dev/full", tmp_path)
    assert code == 2
    assert "/dev/full" in printed
