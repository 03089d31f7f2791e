"""Nothing that a study leaves, or that a bucket gets, names a user, a host, a folder or a password."""

import base64
import os
import re
import shutil
import subprocess
import sys
import zlib

import pytest
from tiny_study import ROOT, write_tiny

SECRET = "hunter2-hunter2"
USER = "jqdoe-of-the-lab"
HOST = "canary-host-of-the-lab"
FOLDER = "Jane Q Doe"
# The machine's own: the list of studies and the locks name who uses a cache from where, and never leave it.
OWN = {".studies", ".locks"}


def command(base, *arguments):
    """Run a command as a user of another name, on a machine of another name where this account may rename it."""
    words = [sys.executable, "-m", "hrcneuro", *map(str, arguments)]
    given = {"USER": USER, "LOGNAME": USER, "HOME": str(base), "AWS_SECRET_ACCESS_KEY": SECRET, "NO_COLOR": "1"}
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **given}
    environment.pop("HRCNEURO_CACHE", None)
    if renames():
        words = ["unshare", "--uts", "sh", "-c", f'hostname {HOST}; exec "$@"', "sh", *words]
    return subprocess.run(words, cwd=base, env=environment, capture_output=True, text=True, timeout=300, check=False)


def renames():
    """Return whether this account may give its children's machine another name."""
    words = ["unshare", "--uts", "hostname", HOST]
    return bool(shutil.which("unshare")) and subprocess.run(words, capture_output=True, check=False).returncode == 0


def plain(data):
    """Return a file's bytes, without pictures that lie in a page, and with what a PDF has packed."""
    data = re.sub(rb"data:[\w/+.-]+;base64,[A-Za-z0-9+/=]+", b"", data)
    unpacked = []
    for stream in re.findall(rb"stream\r?\n(.*?)endstream", data, re.S) if data.startswith(b"%PDF") else ():
        try:
            unpacked.append(zlib.decompress(stream))
        except zlib.error:
            continue
    return b"\n".join([data, *unpacked])


@pytest.fixture(scope="module")
def left(tmp_path_factory):
    """The folder in which a study ran: whole, with a failure, and pushed."""
    base = tmp_path_factory.mktemp("private") / FOLDER
    base.mkdir()
    write_tiny(base)
    pipeline = base / "pipeline.toml"
    pipeline.write_text('config = "tiny.toml"\nstages = ["acquire", "preprocess", "epoch", "simulate", "robot"]\n')
    # One subject, and for the arm one episode: more of them write no other kind of file.
    shared = ["--workdir", base / "one", "-j", "1", "--set", "study.subjects=['s01']", "--set", "robot.blocks=[1]"]
    second = f"ssh://{USER}:{SECRET}@127.0.0.1:1{base}/bucket"
    done = command(base, "run", pipeline, *shared, "--from", second if has("paramiko") else base / "none")
    assert done.returncode == 0, done.stderr
    if has("distributed"):
        there = ["--workdir", base / "dask", "--executor", "dask", "-j", "1", "--config", base / "tiny.toml"]
        assert command(base, "acquire", "s01", *there).returncode == 0
    (base / "raw").mkdir()
    (base / "raw" / "s01.fif").write_bytes(next((base / "one/cache/acquire").rglob("s01_raw.fif")).read_bytes()[:30000])
    other = ["--config", base / "tiny.toml", "--workdir", base / "bad", "-j", "1", "--set", "acquire.source=file"]
    other += ["--set", f"acquire.path={base}/raw/{{subject}}.fif"]
    assert command(base, "acquire", "s01", "s02", *other).returncode == 3
    command(base, "report", *other)
    if has("fsspec"):
        assert command(base, "cache", "push", base / "bucket", "--workdir", base / "one").returncode == 0
    return base


def has(module):
    import importlib.util

    return importlib.util.find_spec(module) is not None


def test_nothing_that_is_left_names_a_user_a_host_a_folder_or_a_password(left):
    words = [SECRET, USER, FOLDER, str(left), str(left.parent), str(ROOT), sys.prefix, *([HOST] if renames() else [])]
    words += [base64.b64encode(word.encode()).decode() for word in (SECRET, USER)]
    files = [p for p in left.rglob("*") if p.is_file() and not OWN.intersection(p.parts)]
    files = [p for p in files if p.parent not in (left, left / "raw")]
    kinds = {p.suffix for p in files}
    assert {".fif", ".parquet", ".png", ".pdf", ".html", ".json", ".jsonl"} <= kinds
    found = {
        f"{path.relative_to(left)}: {word}"
        for path in files
        for content in [plain(path.read_bytes())]
        for word in words
        if word.encode() in content
    }
    assert found == set()


def test_logs_say_what_failed_all_the_same(left):
    (log,) = (left / "bad/results/log").glob("*-acquire.jsonl")
    text = log.read_text()
    assert "s01.fif is truncated" in text
    assert "acquire.path={subject}.fif" in text


def test_a_cache_s_own_list_is_not_pushed(left):
    if not has("fsspec"):
        pytest.skip("needs the extra remote")
    names = {p.relative_to(left / "bucket").parts[0] for p in (left / "bucket").rglob("*") if p.is_file()}
    assert names == {"records", "files"}
