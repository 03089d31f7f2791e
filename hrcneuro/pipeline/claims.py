"""What a run tells the studies that share its cache: the entries that it points at, and those it is about to."""

from __future__ import annotations

import contextlib
from pathlib import Path

from hrcneuro.cache.disk import explain_os_error
from hrcneuro.cache.placed import PlacedStudy
from hrcneuro.cache.record import Entry
from hrcneuro.errors import HrcError
from hrcneuro.pipeline.workdir import Workdir


class Claims:
    """A run's entry in the cache's list of studies.

    A list that cannot be written is no reason to stop a study.

    Attributes:
        flaw: Why the list does not have all that it should; empty where it does.
    """

    def __init__(self, workdir: Workdir) -> None:
        self.workdir = workdir
        self.flaw = ""
        self._why = ""
        self._study: PlacedStudy | None = None
        self._run: Path | None = None
        self._listed: set[Entry] = set()

    @property
    def id(self) -> str:
        """The study's id; empty before the run begins."""
        return self._study.id if self._study else ""

    def open(self) -> None:
        """Enter the study with all that its results point at."""
        try:
            self._study = self.workdir.study()
            self._run = self.workdir.studies.open(self._study, self.workdir.keys())
        except (OSError, HrcError) as error:
            self._run = None
            self._fall_back(error)
            return
        with contextlib.suppress(HrcError):
            self.workdir.cache.settle(lambda: claimed(self.workdir))

    def claim(self, entry: Entry) -> None:
        """Name an entry that the run is about to look for."""
        if self._run is None:
            if entry not in self._listed:
                self.flaw = self._why
            return
        try:
            self.workdir.studies.claim(self._run, entry)
        except FileNotFoundError:
            # Somebody removed the list under our feet.
            self.open()
            if self._run is not None:
                with contextlib.suppress(OSError):
                    self.workdir.studies.claim(self._run, entry)
        except OSError as error:
            self.flaw = self._said(error)

    def close(self) -> None:
        """Leave in the list what the results point at now."""
        if self._run is None or self._study is None:
            return
        try:
            self.workdir.studies.settle(self._study, self.workdir.keys, self._run)
        except (OSError, HrcError) as error:
            self.flaw = self._said(error)

    def _fall_back(self, error: OSError | HrcError) -> None:
        """Go on with what the list has of this study already: in a disk that is read-only now, that may be all."""
        self._why = self._said(error)
        with contextlib.suppress(HrcError):
            for one in self.workdir.studies.read():
                if self._study is not None and one.study.same(self._study):
                    self._listed |= one.entries

    def _said(self, error: OSError | HrcError) -> str:
        known = error if isinstance(error, HrcError) else explain_os_error(error, self.workdir.studies.folder)
        return (
            f"the cache's list of studies does not have all of this run ({known.problem}); 'hrcneuro cache gc' in "
            "another study that shares the cache may drop what results here point at"
        )


def claimed(workdir: Workdir) -> set[Entry]:
    """Return every entry that a study points at, or that a run is about to.

    Raises:
        DataError: A file of the cache's list of studies cannot be understood.
    """
    # The list first: what a run points at before it leaves the list is then in the one or the other.
    used = claimed_by_others(workdir)
    return used | workdir.keys()


def claimed_by_others(workdir: Workdir) -> set[Entry]:
    """Return every entry that another study points at, or that a run, also one of this study, is about to.

    Raises:
        DataError: A file of the cache's list of studies cannot be understood.
    """
    listings = workdir.studies.read()
    study = workdir.study() if workdir.is_study else None
    others = [one for one in listings if study is None or not (one.over and one.study.same(study))]
    used = {entry for one in others for entry in one.entries}
    for other in {one.study.folder: one.study for one in others}.values():
        # Also what the list may lack: a run that could not write it, or one of an older version.
        with contextlib.suppress(HrcError):
            used |= workdir.of(other).keys() if other.there() else set()
    return used
