"""A study beside that of a working folder: of the same folder and cache, with results of its own."""

from __future__ import annotations

import os
from pathlib import Path

from hrcneuro.cache.disk import guarded
from hrcneuro.cache.placed import PlacedStudy
from hrcneuro.pipeline.workdir import Workdir


class Beside(Workdir):
    """What runs here leaves the results of the working folder's study as they are, and shares every entry with it.

    In the cache's list it is a study of its own: what both point at is kept for either.

    Attributes:
        place: Its folder, in which ``results`` lies.
    """

    def __init__(self, study: Workdir, place: Path) -> None:
        super().__init__(study.folder, study.cache.root)
        self.place = place.absolute()
        self.results = self.place / "results"

    def study(self) -> PlacedStudy:
        """Return the study; it is given a folder and an id where it has none."""
        with guarded(self.place):
            self.place.mkdir(parents=True, exist_ok=True)
        return PlacedStudy.at(Path(os.path.realpath(self.place)), self.results)
