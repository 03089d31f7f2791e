"""What outlives a run tells neither of the machine nor of who works there."""

import dataclasses
import getpass
import socket
import sys
from pathlib import Path

import pytest

from hrcneuro.arms.connection import Connection
from hrcneuro.config import settings as config
from hrcneuro.contract import params
from hrcneuro.pipeline.anonymous import anonymous, command_line, hidden


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("/data/lab/raw/s01.fif is truncated", "…/s01.fif is truncated"),
        ("cannot read '/data/lab/s01.fif'", "cannot read '…/s01.fif'"),
        ("/mnt/Jane Q Doe/raw/s01.fif is truncated", "…/s01.fif is truncated"),
        ("/mnt/Jane Q Doe is full", "… is full"),
        ("computed here: of ssh://me:pass@host/data/x its record", "computed here: of ssh://… its record"),
        ("no scheduler answers at 'tcp://head.lab:8786'", "no scheduler answers at 'tcp://…'"),
        ("(/a/b is drwxr-xr-x, of jane, group lab)", "(…/b is drwxr-xr-x, of …, group …)"),
        ("params: preprocess.l_freq 1.0 -> 0.5", "params: preprocess.l_freq 1.0 -> 0.5"),
        ("inputs: scale/a/y.txt", "inputs: scale/a/y.txt"),
        ("see https://mne.tools/stable/x.html", "see https://mne.tools/stable/x.html"),
    ],
)
def test_paths_owners_and_addresses_are_cut_and_the_rest_stays(text, kept):
    assert anonymous(text, ["/mnt/Jane Q Doe", "/mnt/Jane Q Doe/raw"]) == kept


def test_the_home_and_the_working_folder_are_cut_also_with_blanks(tmp_path, monkeypatch):
    home = tmp_path / "Jane Q Doe"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.chdir(home)
    assert "Jane" not in anonymous(f"{home}/a b/s01.fif is truncated")


def test_user_and_host_are_cut_but_no_word_of_three_letters(monkeypatch):
    from hrcneuro.pipeline import anonymous as module

    monkeypatch.setattr(socket, "gethostname", lambda: "labserver7")
    monkeypatch.setattr(getpass, "getuser", lambda: "eeg")
    module._names.cache_clear()
    try:
        assert anonymous("labserver7: eeg of labserver7-b") == "…: eeg of …-b"
    finally:
        module._names.cache_clear()


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["run", "/data/Jane Doe/pipeline.toml"], "run pipeline.toml"),
        (["erp", "--workdir=/data/x", "-j", "2"], "erp --workdir=x -j 2"),
        (["erp", "--set", "acquire.path=/data/a b/{subject}.fif"], "erp --set acquire.path={subject}.fif"),
        (["robot", "s01", "--host", "ur10.lab.example"], "robot s01 --host …"),
        (["robot", "s01", "--host=10.0.0.5"], "robot s01 --host=…"),
        (["robot", "--set", "robot.host=10.0.0.5"], "robot --set robot.host=…"),
        (["run", "--set", "cluster.scheduler=tcp://head.lab:8786"], "run --set cluster.scheduler=…"),
        (["run", "--set", "cluster.scheduler=head.lab:8786"], "run --set cluster.scheduler=…"),
        (["run", "--set=cluster.sbatch.mail_user=jane@lab.example"], "run --set=cluster.sbatch.mail_user=…"),
        (["run", "--set", "cluster.retries=3"], "run --set cluster.retries=3"),
        (["run", "--from", "ssh://me:secret@host"], "run --from ssh://…"),
        (["run", "--from=s3://key:se=cret@lab/x"], "run --from=s3://…"),
        (["cache", "push", "s3://key:se=cret@lab"], "cache push s3://…"),
    ],
)
def test_the_command_line_is_kept_without_places(monkeypatch, arguments, line):
    monkeypatch.setattr(sys, "argv", ["/usr/bin/hrcneuro", *arguments])
    assert command_line() == f"hrcneuro {line}"


def test_an_arm_s_address_decides_results_and_is_told_to_nobody():
    one, two = (params(Connection(host=host))["host"] for host in ("10.0.0.5", "10.0.0.6"))
    assert one != two
    assert "10.0.0" not in one + two
    assert params(Connection())["host"] == ""


def test_the_folders_and_addresses_of_a_configuration_are_hidden(tmp_path):
    found = config.load(
        None, ["acquire.source=dataset", "acquire.path=/data/Jane Q Doe/raw", "robot.host=ur10.lab"], folder=tmp_path
    )
    kept = hidden(found, Path("/work/a b"))
    assert {"/work/a b", "/data/Jane Q Doe", "ur10.lab"} <= set(kept)
    assert anonymous("ur10.lab refused; /data/Jane Q Doe/raw/s01.fif", kept) == "… refused; …/s01.fif"


def test_every_place_that_an_option_names_is_declared():
    """A path or an address that is not declared as such would stand in keys and records."""
    from hrcneuro import stages

    for name in stages.NAMES:
        for f in dataclasses.fields(stages.load(name).config()):
            words = set(f.name.split("_"))
            if words & {"path", "folder", "file"}:
                assert f.metadata["path"] or not isinstance(f.default, str), f"{name}.{f.name}"
            if words & {"host", "address", "password", "user", "token"}:
                assert f.metadata["private"] or not f.metadata["keyed"], f"{name}.{f.name}"
