"""Which files of a folder are session logs of Ehrlich & Cheng 2018. No numeric library: every plan asks this."""

from __future__ import annotations

import re
from pathlib import Path

from hrcneuro.errors import DataError
from hrcneuro.sources.pointers import refuse_broken_link

REPOSITORY = "stefan-ehrlich/dataset-ErrP-coadaptation"
_FOLDER = "data_coadaptation"
_NAME = re.compile(r"(s\d{2})_(calib|corl[1-4])_log")
_GRID_STUDY = re.compile(r"subject\d+\.csv")
CURE = (
    f"name the folder {_FOLDER} of a copy of {REPOSITORY}, which holds sNN_calib_log and sNN_corl1_log to "
    "sNN_corl4_log: --evidence FOLDER"
)


def log_files(folder: str | Path) -> dict[str, Path]:
    """Return label -> file of the session logs in a folder, or in its ``data_coadaptation``: ``s03 corl1`` and so on.

    Raises:
        DataError: There is no such folder, it has no log of a closed session that was scored (corl1, 2 or 4), or it
            holds the logs of another study.
    """
    root = Path(folder)
    if not root.is_dir():
        raise DataError(f"the folder {root} {'is a file' if root.exists() else 'does not exist'}", cure=CURE)
    home = root / _FOLDER if (root / _FOLDER).is_dir() else root
    names = sorted(path.name for path in home.iterdir())
    labels = {f"{match[1]} {match[2]}": home / name for name in names if (match := _NAME.fullmatch(name))}
    if not any(label[-1] in "124" for label in labels):
        raise DataError(
            f"{home} holds {_told(home, names)}; expected are the logs of closed sessions, such as s03_corl1_log",
            cure=CURE,
        )
    for path in labels.values():
        refuse_broken_link(path)
    return labels


def _told(home: Path, names: list[str]) -> str:
    """Return what is there instead, and of which study it is where that is known."""
    inside = [f"{name}/{one.name}" for name in names[:3] if (home / name).is_dir() for one in (home / name).iterdir()]
    for name in (*names, *inside):
        if _GRID_STUDY.fullmatch(Path(name).name):
            return f"{name}, a trial log of the study on the grid (acquire reads it), and no session log of this one"
    shown = [name for name in names if not name.startswith(".")]
    return f"{', '.join(shown[:4]) or 'nothing'}{' …' if len(shown) > 4 else ''}"
