"""The address of a bucket: what may be one, what is most likely a slip, and what of it nobody is shown.

A slip must not pass for the name of a folder: gigabytes would go to where nobody looks for them, without a word.
"""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from urllib.parse import urlsplit

from hrcneuro.cache.filesystems import SSH
from hrcneuro.errors import ConfigError, did_you_mean

PROTOCOLS = ("file", "s3", "sftp", "ssh")
_ALSO_IN_TESTS = ("memory",)
_NEEDS = {"s3": "s3fs", "sftp": "paramiko", "ssh": "paramiko"}
_ALLOWED = f"allowed: {', '.join(f'{name}://' for name in PROTOCOLS)} and a folder"
_SUCH_AS = "such as s3://BUCKET/FOLDER, ssh://HOST/FOLDER, file:///FOLDER or /mnt/shared/cache"


def read_address(given: str, *, cache: Path | None = None) -> str:
    """Return the address of a bucket as a URL; a folder's has its whole path.

    Args:
        given: A URL or a folder.
        cache: The cache that it stands beside, which it may not lie in.

    Raises:
        ConfigError: It is of no kind that can be used, looks like a slip, lies in the cache, or needs what is not
            installed.
    """
    if not given.strip():
        raise ConfigError(
            f"the bucket's address is empty; {_ALLOWED}",
            cure="if it comes from a variable of the shell, that is not set; '.' is the folder you are in",
        )
    # As it is: fsspec takes no %20 for a blank.
    url = given if "://" in given else f"file://{_folder(given)}"
    protocol, _, rest = url.partition("://")
    if protocol not in (*PROTOCOLS, *_ALSO_IN_TESTS) or "::" in url:
        raise ConfigError(
            f"{without_login(url)!r} is no place for a cache that can be used{did_you_mean(protocol, PROTOCOLS)}; "
            f"{_ALLOWED}",
            cure=_SUCH_AS,
        )
    if protocol == "file":
        _check_folder(rest, cache)
    if protocol == "s3":
        _check_s3(rest)
    if protocol in SSH:
        _check_ssh(url, protocol, rest)
    for name in _libraries(protocol):
        if importlib.util.find_spec(name) is None:
            raise absent(protocol)
    return url


def without_login(url: str) -> str:
    """Return a URL without the user and the password in it."""
    head, mark, rest = url.partition("://")
    if not mark:
        return url
    if has_password(url):
        # Also one with a slash in it, of which no host would begin where it seems to.
        rest = rest.rpartition("@")[2]
    place, slash, path = rest.partition("/")
    return f"{head}://{place.rpartition('@')[2]}{slash}{path}"


def has_password(url: str) -> bool:
    """Return whether a URL has a password or a secret key in front of its host."""
    return ":" in url.partition("://")[2].rpartition("@")[0]


def absent(protocol: str) -> ConfigError:
    """Return the error that what a protocol needs is not installed."""
    return ConfigError(
        f"{protocol}:// needs {' and '.join(_libraries(protocol))}, which is not installed",
        cure="pip install 'hrcneuro[remote]'",
    )


def _libraries(protocol: str) -> list[str]:
    """Return the names of the modules that a protocol needs."""
    return ["fsspec", *([_NEEDS[protocol]] if protocol in _NEEDS else [])]


def _folder(given: str) -> Path:
    """Return a folder's whole path, unless its name is more likely an address with a slip."""
    word, colon, _ = given.partition("/")[0].partition(":")
    if colon:
        # What follows may be a password, as in sftp:/me:…@host, and is not shown.
        word = word.rpartition("@")[2]
        meant = word.lower() if word.lower() in PROTOCOLS else "ssh"
        form = {"file": "file:///FOLDER", "s3": "s3://BUCKET/FOLDER"}.get(meant, f"{meant}://HOST/FOLDER")
        raise ConfigError(
            f"the bucket's address begins with '{word}:' and has no '://' behind it{did_you_mean(word, PROTOCOLS)}; "
            f"{_ALLOWED}",
            cure=f"write {form}; a folder of such a name is ./{word}:…",
        )
    try:
        return Path(given).expanduser().absolute()
    except RuntimeError as error:
        raise ConfigError(f"the folder {given}: {error}", cure="write its whole path") from error


def _check_folder(path: str, cache: Path | None) -> None:
    if not path.startswith("/"):
        path = without_login(f"file://{path}").removeprefix("file://")
        host, slash, below = path.partition("/")
        raise ConfigError(
            f"'file://{path}' has {f'the machine {host!r} in it' if host else 'no folder'}; allowed: file:///FOLDER, "
            "with three slashes, of this machine",
            cure=f"a folder from here on: {path or 'FOLDER'}, without file://"
            + (f"; one from the root on: file:///{below}; another machine's: ssh://{path}" if slash else ""),
        )
    if cache is None:
        return
    # Links are followed: what counts is where the files would come to lie.
    place, own = Path(os.path.realpath(path)), Path(os.path.realpath(cache))
    if own in (place, *place.parents):
        raise ConfigError(
            f"{path} is {'the cache itself' if place == own else f'inside the cache {own}'}; a bucket lies elsewhere",
            cure="choose a folder beside the cache, such as one on another disk",
        )


def _check_s3(rest: str) -> None:
    bucket = rest.partition("/")[0]
    # The address of an access point has colons, and is no login.
    if ("@" in bucket or ":" in bucket) and not bucket.startswith("arn:"):
        raise ConfigError(
            "the s3:// address has keys or a port beside the bucket's name, which S3 takes from elsewhere; allowed: "
            "s3://BUCKET/FOLDER",
            cure="put the keys into AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or a profile (~/.aws, AWS_PROFILE), "
            "and the address of a server of your own into AWS_ENDPOINT_URL",
        )
    if not bucket:
        raise ConfigError(
            f"'s3://{rest}' names no bucket; allowed: s3://BUCKET/FOLDER", cure="name one, after two slashes"
        )


def _check_ssh(url: str, protocol: str, rest: str) -> None:
    """Refuse a login that does not parse, without a word of what the parser says: that has pieces of the password."""
    form = f"{protocol}://USER:PASSWORD@HOST:PORT/FOLDER"
    try:
        parts = urlsplit(url)
        host, _, behind = parts.hostname, parts.port, rest[len(parts.netloc) :]
        whole = behind[:1] in ("", "/")
    except ValueError:
        host, whole = None, False
    if not whole:
        raise ConfigError(
            f"the {protocol}:// address cannot be read: its port is no number up to 65535, or a character of its login "
            f"ends it too early; allowed: {form}, without / ? # [ ] in the login",
            cure="use a key or an agent instead of a password (ssh-add), which also stays out of the shell's history",
        )
    if not host:
        raise ConfigError(f"'{protocol}://…' names no machine; allowed: {form}", cure=f"write {protocol}://HOST/FOLDER")
