"""What a task is handed of the configuration."""

import pytest

from hrcneuro.config import settings
from hrcneuro.errors import ConfigError
from hrcneuro.pipeline.graph import Task
from hrcneuro.pipeline.keys import Keys, check_places
from hrcneuro.pipeline.workdir import Workdir


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Return where recordings lie with these assignments, of a command given elsewhere."""
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")

    def recordings(*assignments):
        keys = Keys(settings.load(assignments=assignments), Workdir(tmp_path / "study"))
        return keys.config(Task.of("robot", "s01")).rescue_folder

    return recordings


def test_a_place_that_nobody_names_lies_in_the_working_folder(place, tmp_path):
    assert place() == str(tmp_path / "study" / "recordings")


def test_a_place_that_is_named_is_taken_from_where_it_is_named(place, tmp_path):
    assert place("robot.rescue_folder=mine") == str(tmp_path / "elsewhere" / "mine")


@pytest.mark.parametrize("place", ["cache", "cache/mine", "link", "other/../cache/a/b"])
def test_recordings_never_lie_in_the_cache(place, tmp_path):
    (tmp_path / "cache").mkdir()
    (tmp_path / "link").symlink_to("cache")
    asked = settings.load(assignments=[f"robot.rescue_folder={place}"], folder=tmp_path)
    with pytest.raises(ConfigError, match=r"robot\.rescue_folder") as caught:
        check_places(asked, Workdir(tmp_path))
    assert str(tmp_path / "cache") in caught.value.problem
    assert "outside the cache" in caught.value.cure


@pytest.mark.parametrize("place", ["recordings", "cache-2", "cache/../mine"])
def test_recordings_may_lie_beside_the_cache(place, tmp_path):
    asked = settings.load(assignments=[f"robot.rescue_folder={place}"], folder=tmp_path)
    check_places(asked, Workdir(tmp_path))


def test_a_cache_that_lies_among_recordings_is_no_place_for_them(tmp_path, monkeypatch):
    monkeypatch.setenv("HRCNEURO_CACHE", str(tmp_path / "recordings"))
    with pytest.raises(ConfigError, match=r"robot\.rescue_folder"):
        check_places(settings.load(folder=tmp_path), Workdir(tmp_path))
