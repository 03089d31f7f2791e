"""What comes with the program is found by its name, from any folder, and is part of what is installed."""

import glob
import json
import shutil
import tomllib
from pathlib import Path

import pytest
from started import libraries

from hrcneuro.config import settings, shipped
from hrcneuro.config.pipelinefile import read_pipeline
from hrcneuro.errors import ConfigError

ROOT = Path(__file__).parents[2]
KINDS = (shipped.CONFIGURATIONS, shipped.PIPELINES, shipped.MULTIVERSES)


def test_the_names_are_those_of_the_files_in_the_clone():
    for kind in KINDS:
        assert shipped.names(kind) == sorted(path.stem for path in (ROOT / kind).glob("*.toml"))
        assert "smoke" in shipped.names(kind)


def test_a_name_stands_for_its_file_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    named = settings.load(Path("smoke"))
    assert named.sections == settings.load(ROOT / "configs" / "smoke.toml").sections
    assert named.study.name == "smoke"
    plan = read_pipeline(Path("smoke"))
    assert settings.load(plan.config).study == named.study


def test_a_file_in_the_working_folder_comes_first_and_a_folder_does_not(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "smoke").mkdir()
    assert settings.load(Path("smoke")).study.name == "smoke"
    (tmp_path / "smoke").rmdir()
    (tmp_path / "smoke").write_text("[study]\nname = 'mine'\n")
    assert settings.load(Path("smoke")).study.name == "mine"


def test_a_name_that_nothing_has_is_refused_with_the_nearest():
    with pytest.raises(ConfigError, match="did you mean 'eeglab_sample'") as caught:
        settings.load(Path("eeglab_sampel"))
    assert "eeglab_sample, logs, p300_emotiv, p300_muse, paper, smoke" in caught.value.cure


def test_they_are_among_the_files_that_are_installed():
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["hrcneuro"]
    installed = {path for one in patterns for path in glob.glob(one, root_dir=ROOT / "hrcneuro", recursive=True)}
    for kind in KINDS:
        assert {f"config/shipped/{kind}/{name}.toml" for name in shipped.names(kind)} <= installed


def test_a_package_without_its_repository_has_them(tmp_path):
    # As a wheel leaves it: files in the place of links, and nothing beside the package.
    site = tmp_path / "site"
    shutil.copytree(ROOT / "hrcneuro", site / "hrcneuro", ignore=shutil.ignore_patterns("__pycache__"))
    for words in (["config", "check", "--config", "smoke"], ["run", "smoke", "--dry-run", "--json"]):
        given = {"environment": {"PYTHONPATH": str(site)}, "paths": [site]}
        ended, out, err = libraries().run(words, cwd=tmp_path, timeout=300, **given)
        assert ended == 0, err
    assert {item["unit"] for item in json.loads(out)["items"]} == {"s01", "s02", "s03", "group"}
