"""Addresses of buckets: slips are refused before anything goes anywhere, and no message has a piece of a password."""

import re

import pytest

from hrcneuro.cache.address import read_address, without_login
from hrcneuro.errors import ConfigError

pytest.importorskip("fsspec", reason="needs the extra remote")
pytest.importorskip("s3fs", reason="needs the extra remote")
pytest.importorskip("paramiko", reason="needs the extra remote")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield
    assert [path.name for path in tmp_path.iterdir() if path.name not in ("cache", "link")] == []


@pytest.mark.parametrize(
    ("given", "problem", "cure"),
    [
        ("", "the bucket's address is empty; allowed: file://, s3://", "that is not set"),
        ("  ", "the bucket's address is empty", "that is not set"),
        ("s3:/lab/study", "begins with 's3:' and has no '://' behind it", "write s3://BUCKET/FOLDER"),
        ("s3:lab/study", "begins with 's3:'", "a folder of such a name is ./s3:…"),
        ("ssh:/lab/study", "begins with 'ssh:'", "write ssh://HOST/FOLDER"),
        ("file:/mnt/x", "begins with 'file:'", "write file:///FOLDER"),
        ("S3:/lab", "begins with 'S3:'", "write s3://BUCKET/FOLDER"),
        ("lab.example.org:/data", "begins with 'lab.example.org:'", "write ssh://HOST/FOLDER"),
        ("me@lab:/data", "begins with 'lab:'", "write ssh://HOST/FOLDER"),
        ("sfpt:/lab", "did you mean 'sftp'?", "write ssh://HOST/FOLDER"),
        ("file://relative/place", "has the machine 'relative' in it", "relative/place, without file://"),
        ("file://localhost/mnt/x", "has the machine 'localhost' in it", "file:///mnt/x"),
        ("file://", "has no folder", "FOLDER, without file://"),
        ("s3:///study", "names no bucket", "name one"),
        ("ssh:///study", "names no machine", "write ssh://HOST/FOLDER"),
        ("~nobody-of-this-name/x", "the folder ~nobody-of-this-name/x", "write its whole path"),
    ],
)
def test_a_slip_is_refused_with_the_right_form(given, problem, cure):
    with pytest.raises(ConfigError, match=re.escape(problem)) as refused:
        read_address(given)
    assert cure in refused.value.cure


@pytest.mark.parametrize(
    "given",
    [
        "s3://lab/study", "s3://arn:aws:s3:eu-west-1:123456789012:accesspoint/lab/study", "s3://lab/a:b@c/x",
        "ssh://lab/data", "ssh://me@lab:2222/data", "sftp://me:pw@lab/data", "sftp://me:p@w@lab/a#b",
        "ssh://lab:22/a@b/c", "file:///mnt/a:b", "file:///",
    ],
)  # fmt: skip
def test_an_address_that_can_be_read_stays_as_it_is(given):
    assert read_address(given) == given


def test_a_folder_has_its_whole_path_also_where_a_colon_is_in_its_name(tmp_path):
    assert read_address("./s3:/lab") == f"file://{tmp_path}/s3:/lab"
    assert read_address("lab/s3:x") == f"file://{tmp_path}/lab/s3:x"


@pytest.mark.parametrize(
    "password", ["hun/ter2", "hunt#er2", "hunt?er2", "hunt[er2", "12#er2", "hunt℀er2", "99999/er2"]
)
@pytest.mark.parametrize("protocol", ["ssh", "sftp"])
def test_a_login_that_does_not_parse_is_refused_without_a_piece_of_it(protocol, password):
    with pytest.raises(ConfigError, match="address cannot be read") as refused:
        read_address(f"{protocol}://me:{password}@127.0.0.1:1/x")
    said = str(refused.value)
    assert not any(piece in said for piece in ("hun", "er2", "12", "99999"))
    assert "ssh-add" in refused.value.cure
    # Nor has the error that it came from, which --debug prints.
    assert refused.value.__cause__ is None
    assert refused.value.__context__ is None


@pytest.mark.parametrize("login", ["KEY:SECRET@", "KEY:SEC/RET@", "KEY@", "KEY:SEC#RET@"])
def test_keys_in_an_s3_address_are_refused_with_where_they_go(login):
    with pytest.raises(ConfigError, match="has keys or a port beside the bucket's name") as refused:
        read_address(f"s3://{login}lab/x")
    assert not re.search("KEY:|KEY@|SEC|RET", str(refused.value).replace("AWS_SECRET_ACCESS_KEY", ""))
    assert "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY" in refused.value.cure
    assert "AWS_PROFILE" in refused.value.cure


def test_a_password_behind_one_slash_is_not_shown():
    with pytest.raises(ConfigError, match="begins with 'sftp:'") as refused:
        read_address("sftp:/me:hunter2@lab/x")
    assert "hunter2" not in str(refused.value)
    with pytest.raises(ConfigError, match="has the machine 'lab' in it") as refused:
        read_address("file://me:hunter2@lab/x")
    assert "hunter2" not in str(refused.value)
    assert without_login("sftp://me:hun/ter2@lab/x") == "sftp://lab/x"


@pytest.mark.parametrize(
    "form", ["cache", "{0}/cache", "file://{0}/cache", "cache/bucket", "x/../cache/", "link", "link/x"]
)
def test_a_place_in_the_cache_is_refused_also_through_a_link(tmp_path, form):
    (tmp_path / "cache").mkdir()
    (tmp_path / "link").symlink_to("cache")
    with pytest.raises(ConfigError, match=r"is (the cache itself|inside the cache .*); a bucket lies elsewhere"):
        read_address(form.format(tmp_path), cache=tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_place_beside_the_cache_or_around_it_is_allowed(tmp_path):
    for name in ("cache2", ".", "bucket"):
        assert read_address(name, cache=tmp_path / "cache").startswith("file:///")
