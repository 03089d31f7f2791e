"""The folder of programs: whatever lies beside the scripts, the scripts can be loaded."""

import gzip
import os

import pytest

from hrcneuro.errors import ConfigError
from hrcneuro.ur10.loading import read_programs


def test_scripts_are_read_and_all_else_is_known_by_its_reason(tmp_path):
    (tmp_path / "plain.script").write_text("textmsg(1)\n")
    (tmp_path / "windows.script").write_bytes("\ufefftextmsg(1)\r\n".encode())
    (tmp_path / "old.script").write_bytes("textmsg('Größe')\n".encode("latin-1"))
    (tmp_path / "empty.script").touch()
    (tmp_path / "wait.urp").write_bytes(gzip.compress(b"<URProgram/>"))
    (tmp_path / "photo.png").write_bytes(bytes(range(20)))
    (tmp_path / "folder").mkdir()
    (tmp_path / "gone.script").symlink_to("nowhere")
    (tmp_path / "ring.script").symlink_to("ring.script")
    (tmp_path / "there.script").symlink_to("back.script")
    (tmp_path / "back.script").symlink_to("there.script")
    (tmp_path / "good.script").symlink_to("plain.script")
    (tmp_path / "default.variables").write_text("# only a comment\n")
    (tmp_path / "default.installation").write_bytes(gzip.compress(b"<Installation/>"))
    (tmp_path / "unpacked.urp").write_text("\ufeff<?xml version='1.0'?>\n<URProgram/>\n")
    (tmp_path / "script.urp").write_text("textmsg(1)\n")
    (tmp_path / "huge.script").write_bytes(b"#" * 1_000_001)
    os.mkfifo(tmp_path / "pipe.script")
    found = read_programs(str(tmp_path))
    assert found.scripts == {
        "plain.script": "textmsg(1)\n", "windows.script": "textmsg(1)\r\n", "old.script": "textmsg('Größe')\n",
        "empty.script": "", "good.script": "textmsg(1)\n", "script.urp": "textmsg(1)\n",
    }  # fmt: skip
    assert {name: reason.split(",")[0] for name, reason in found.refused.items()} == {
        "wait.urp": "it is compressed", "photo.png": "it is no text", "folder": "it is a folder",
        "gone.script": "it is a link to nothing", "huge.script": "it is larger than 1000000 bytes",
        "pipe.script": "it is no file", "ring.script": "it is a link that leads back to itself",
        "there.script": "it is a link that leads back to itself",
        "back.script": "it is a link that leads back to itself", "unpacked.urp": "it is XML",
        "default.variables": "it holds the variables of an installation",
        "default.installation": "it is an installation; 'load installation' loads it",
    }  # fmt: skip


def test_a_file_that_may_not_be_read_is_named(tmp_path, monkeypatch):
    (tmp_path / "secret.script").touch()

    def refuse(self):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.read_bytes", refuse)
    assert read_programs(str(tmp_path)).refused == {"secret.script": "it cannot be read: Permission denied"}


def test_a_missing_folder_is_an_error(tmp_path):
    with pytest.raises(ConfigError, match="No such file"):
        read_programs(str(tmp_path / "none"))


def test_an_empty_name_is_not_the_folder_one_is_in(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here.script").touch()
    assert list(read_programs(".").scripts) == ["here.script"]
    with pytest.raises(ConfigError, match="--programs '': an empty name is no folder"):
        read_programs("")
