"""``.dat``, which several makers use: BCI2000, and Curry 7 with its parameters beside it."""

from __future__ import annotations

from pathlib import Path

from hrcneuro.errors import DataError
from hrcneuro.sources.formats import bci2000, curry
from hrcneuro.sources.formats.curry_names import parameter_file
from hrcneuro.sources.recording import Recording


def read(path: Path) -> Recording:
    """Return the recording; as :func:`hrcneuro.sources.formats.read_recording`."""
    if parameter_file(path) is not None:
        return curry.read(path)
    header = path.with_suffix(".vhdr")
    if header.is_file():
        raise DataError(
            f"{path.name} holds the samples of {header.name}", cure=f"name the header: acquire.path = '…/{header.name}'"
        )
    return bci2000.read(path)
