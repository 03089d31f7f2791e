"""Where the page of the first hour lies, and what each of its parts finds in its folder."""

import re
from pathlib import Path

from tiny_study import ROOT

PAGE = ROOT / "docs" / "start" / "first_hour.md"
DATA = ROOT.parent / "shared" / "data"
# Part of the page -> the data that it needs, of those that are no part of the project.
PARTS = {
    "Install": "",
    "A small study": "",
    "The authors' logs": "HRC_neurobased_taskplanning",
    "A recording": "eeglab_sample",
}


def provide(part: str, folder: Path) -> None:
    """Put what a part of the page needs into its folder."""
    needs = PARTS[part]
    if needs == "eeglab_sample":
        for path in (DATA / needs).iterdir():
            (folder / path.name).symlink_to(path)
    elif needs:
        (folder / needs).symlink_to(DATA / needs)


def entered(command: str, folder: Path) -> Path:
    """Return where a command leads."""
    found = re.search(r"(?:^|&& )cd (\S+)", command)
    return folder / found[1] if found else folder
