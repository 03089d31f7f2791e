"""What outlives a run tells neither of the machine nor of who works there."""

import dataclasses
import getpass
import socket
import sys
from pathlib import Path

import pytest

from hrcneuro.arms.connection import Connection
from hrcneuro.config import settings as config
from hrcneuro.contract import option, params
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
        ("see https://doi.org/10.1371/journal.pone.0287958.", "see https://doi.org/10.1371/journal.pone.0287958."),
        ("https://me:secret@lab.example/x refused", "https://… refused"),
        ("http://token@head/x and http://head:8787/status", "http://… and http://…"),
        ("10.0.0.5:30004 and 10.0.0.6. are silent", "… and …. are silent"),
        ("fe80::1%eth0, [2001:db8::1]:22", "…, …"),
        ("mne 1.10.2 at 12:30:45, x::y, 1.5", "mne 1.10.2 at 12:30:45, x::y, 1.5"),
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
        (["run", "--set", 'cluster={account="lab7"}'], "run --set cluster=…"),
        (["run", "--set", 'cluster . "account" = lab7'], 'run --set cluster . "account" =…'),
        (["run", '--set=robot={host="10.0.0.5"}'], "run --set=robot=…"),
        (["run", "--set", "robot.subjects.s01.host=arm.lab"], "run --set robot.subjects.s01.host=…"),
        (["run", "--set", 'acquire.files=["/data/jane/a", "/data/b=c"]'], "run --set acquire.files=…"),
        (["run", "--workdir=/data/jane=doe/x"], "run --workdir=x"),
        (["run", "10.0.0.5"], "run …"),
        (["run", "--from", "ssh://me:secret@host"], "run --from ssh://…"),
        (["run", "--from=s3://key:se=cret@lab/x"], "run --from=s3://…"),
        (["cache", "push", "s3://key:se=cret@lab"], "cache push s3://…"),
    ],
)
def test_the_command_line_is_kept_without_places(monkeypatch, arguments, line):
    monkeypatch.setattr(sys, "argv", ["/usr/bin/hrcneuro", *arguments])
    assert command_line() == f"hrcneuro {line}"


def test_no_key_has_an_arm_s_address_or_what_it_could_be_guessed_from():
    """There are only 2**32 of them; a simulated controller's session is not taken for an arm's all the same."""
    one, two, simulated, none = (
        params(Connection(host=host))["host"] for host in ("10.0.0.5", "arm.lab", "127.0.0.7", "")
    )
    assert one == two
    assert len({one, simulated, none}) == 3


def test_what_is_private_is_in_no_key_unless_something_stands_for_it():
    @dataclasses.dataclass(frozen=True)
    class Config:
        account: str = option("", "an account", private=True)
        place: str = option("", "an address", private=True, keyed_as=len)

    assert params(Config(account="lab7", place="arm")) == {"place": 3}


def test_the_folders_and_addresses_of_a_configuration_are_hidden(tmp_path):
    found = config.load(
        None, ["acquire.source=dataset", "acquire.path=/data/Jane Q Doe/raw", "robot.host=ur10.lab"], folder=tmp_path
    )
    kept = hidden(found, Path("/work/a b"))
    assert {"/work/a b", "/data/Jane Q Doe", "ur10.lab"} <= set(kept)
    assert anonymous("ur10.lab refused; /data/Jane Q Doe/raw/s01.fif", kept) == "… refused; …/s01.fif"


def test_what_only_a_subject_s_own_options_name_is_hidden_as_well(tmp_path):
    found = config.load(None, [], folder=tmp_path)
    theirs = dataclasses.replace(found.sections["robot"], host="ur10.lab")
    found = dataclasses.replace(found, own={"robot": {"s01": theirs}})
    assert "ur10.lab" in hidden(found)


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
