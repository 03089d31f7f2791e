"""A second cache, which a run looks into for what its own has not: ``--from URL`` or ``HRCNEURO_FROM``."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

from hrcneuro.cache import transfer
from hrcneuro.cache.address import has_password, read_address, without_login
from hrcneuro.cache.bucket import Bucket
from hrcneuro.cache.record import Entry, Record
from hrcneuro.cache.store import Store
from hrcneuro.errors import ConfigError, HrcError, StageError
from hrcneuro.pipeline.graph import FORMATS

# The buckets of this process, and until when one that could not be read is not asked again: each try waits for the
# network, so no more than a tenth of the time goes into that.
_buckets: dict[str, Bucket] = {}
_silent_until: dict[str, float] = {}
_AGAIN_S, _TIMES_ITS_COST = 60.0, 10.0


def named(given: str | None, *, cache: Path | None = None) -> str:
    """Return the URL of the second cache that a command or the environment names; an empty string for none.

    An empty variable of the environment names none; an empty option is a slip.

    Args:
        given: What the command names; None where it names none.
        cache: The first cache, which it may not lie in.

    Raises:
        ConfigError: It is no address that can be used (``read_address``).
    """
    url = os.environ.get("HRCNEURO_FROM") or None if given is None else given
    return "" if url is None else read_address(url, cache=cache)


def for_workers(url: str) -> str:
    """Return the URL of the second cache that travels to workers on other machines.

    An empty string where it is that of the environment and has a password: each worker takes that of its own.

    Raises:
        ConfigError: It has a password: it would stand in files and go over the network.
    """
    if not has_password(url):
        return url
    if url == named(None):
        return ""
    raise ConfigError(
        f"{without_login(url)} is given with a password, which would travel to all workers, in files and by network",
        cure="leave it out and use keys that the workers have (~/.ssh, ~/.aws, an agent), or set HRCNEURO_FROM to the "
        "address with its password, here and where the workers run, and leave --from out",
    )


def take(url: str, store: Store, entry: Entry, tell: Callable[[str], None]) -> Record | None:
    """Take an entry of a second cache into the first, whose lock for it is held; None where it is not to be had.

    What is wrong with it, or with the second cache, is told: then the entry is computed.
    """
    if url not in _buckets:
        _buckets[url] = Bucket(url)
    bucket = _buckets[url]
    begin = time.monotonic()
    if begin < _silent_until.get(url, 0.0):
        return None
    try:
        return transfer.take(store, bucket, entry, formats=FORMATS)
    except StageError as error:
        now = time.monotonic()
        again_s = max(_AGAIN_S, _TIMES_ITS_COST * (now - begin))
        _silent_until[url] = now + again_s
        tell(f"computed here, as what follows within {again_s:.0f} s: {error.problem}")
    except HrcError as error:
        tell(f"computed here: of {bucket} {error.problem}")
    except Exception as error:
        # Whoever writes there must not be able to end a run here, by whatever nobody has thought of.
        tell(f"computed here: what {bucket} has of it cannot be taken ({type(error).__name__})")
    return None
