"""hrcneuro: a neuro-robotics study that anyone can rerun, question and extend (Ehrlich et al., PLoS ONE 2023)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from hrcneuro.api import Study

__version__ = "0.1.0"


def open(
    folder: str | Path = ".", config: str | Path | None = None, set: Sequence[str] = (), *, last: bool = False
) -> Study:
    """Return the study whose working folder, or whose ``results``, this is: its artifacts as MNE and pandas objects.

    Args:
        folder: Where it ran.
        config: Its configuration, a file or a name such as ``smoke``; none: ``hrcneuro.toml`` in that folder, else in
            the current one, else the paper's.
        set: Values on top of it, as ``--set`` takes them: ``["preprocess.l_freq=0.5"]``.
        last: Take what ran last of each unit, whatever its configuration.

    Raises:
        ConfigError: The configuration has a mistake.
        DataError: Nothing has run there.
    """
    from hrcneuro.api import open as open_study

    return open_study(folder, config, set, last=last)
