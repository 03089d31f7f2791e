"""A second cache, which a run looks into for what its own has not: ``--from URL`` or ``HRCNEURO_FROM``."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

from hrcneuro.cache import transfer
from hrcneuro.cache.bucket import Bucket
from hrcneuro.cache.record import Entry, Record
from hrcneuro.cache.store import Store
from hrcneuro.errors import HrcError, StageError

FORMATS: transfer.Formats = {
    ".fif": (b"\x00\x00\x00\x64\x00\x00\x00\x1f", b""),
    ".parquet": (b"PAR1", b"PAR1"),
    ".npz": (b"PK\x03\x04", b""),
    ".png": (b"\x89PNG\r\n\x1a\n", b""),
    ".pdf": (b"%PDF-", b""),
    ".json": (b"", b""),
}
"""What stages and drawings write, by suffix: the bytes that it begins and ends with. Nothing of it is run as code."""

# The buckets of this process, and when one last could not be read: each try waits for the network.
_buckets: dict[str, Bucket] = {}
_silent: dict[str, float] = {}
_AGAIN_S = 60.0


def named(given: str | None) -> str:
    """Return the URL of the second cache that a command or the environment names; an empty string for none.

    Raises:
        ConfigError: It is of no kind that can be used, or the extra ``remote`` is not installed.
    """
    url = given or os.environ.get("HRCNEURO_FROM") or ""
    return Bucket(url).url if url else ""


def take(url: str, store: Store, entry: Entry, tell: Callable[[str], None]) -> Record | None:
    """Take an entry of a second cache into the first, whose lock for it is held; None where it is not to be had.

    What is wrong with it, or with the second cache, is told: then the entry is computed.
    """
    if url not in _buckets:
        _buckets[url] = Bucket(url)
    bucket = _buckets[url]
    if url in _silent and time.monotonic() - _silent[url] < _AGAIN_S:
        return None
    try:
        return transfer.take(store, bucket, entry, formats=FORMATS)
    except StageError as error:
        _silent[url] = time.monotonic()
        tell(f"computed here, as what follows within {_AGAIN_S:.0f} s: {error.problem}")
    except HrcError as error:
        tell(f"computed here: of {bucket} {error.problem}")
    return None
