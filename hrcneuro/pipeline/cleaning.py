"""What may go from a cache that several studies share: the entries that no study in its list points at."""

from __future__ import annotations

import contextlib
import os
import shlex
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from hrcneuro.cache.disk import guarded, remove, size
from hrcneuro.cache.listing import Listing
from hrcneuro.cache.locks import ago
from hrcneuro.cache.placed import PlacedStudy
from hrcneuro.cache.record import PULLED, Entry, entry_of, read_record
from hrcneuro.cache.studies import KEPT_S
from hrcneuro.errors import ConfigError, DataError, HrcError
from hrcneuro.pipeline.claims import claimed
from hrcneuro.pipeline.workdir import Workdir


@dataclass
class Kept:
    """What is kept for another study.

    Attributes:
        study: The study.
        entries: That it points at and this one does not.
        seen: When it wrote the list last, seconds since 1970.
        away: Why it may be gone; empty where it is in its place.
    """

    study: PlacedStudy
    entries: set[Entry]
    seen: float
    away: str


@dataclass
class Survey:
    """What may go, and what stays for whom.

    Attributes:
        doomed: Folders of entries that no study points at, and quarantined ones.
        unlisted: Folders of entries that no study in the list points at or has written since there is a list.
        recent: Folders of entries that a study pointed at within the last day: a copy of it that has not run yet may do
            so still; and those that somebody has pulled within it, for a run to come. None where nobody shares the
            cache.
        kept: What is kept for other studies.
    """

    doomed: list[Path] = field(default_factory=list)
    unlisted: list[Path] = field(default_factory=list)
    recent: list[Path] = field(default_factory=list)
    kept: list[Kept] = field(default_factory=list)


def enter(workdir: Workdir) -> None:
    """Bring the list up to date with what this study's results point at, and finish what a killed gc began."""
    if workdir.is_study:
        # A cache that cannot be written loses nothing either.
        with contextlib.suppress(OSError):
            workdir.studies.settle(workdir.study(), workdir.keys)
    workdir.cache.settle(lambda: claimed(workdir))


def survey(workdir: Workdir) -> Survey:
    """Return what may go from the cache; nothing is written.

    Raises:
        DataError: What a study points at is not known: a pointer, or a file of the cache's list, cannot be understood.
    """
    _refuse_unclear(workdir)
    used, listings, found = claimed(workdir), workdir.studies.read(), Survey()
    writers = {name for one in listings for name in one.study.ids}
    if workdir.is_study:
        writers |= workdir.study().ids
    # A copy of a study has its id: of an entry that is older than the list, its writer may be one that is not in it.
    before, shared = workdir.studies.before(), _is_shared(workdir, listings)
    recent = _recent(listings) if shared else set()
    visible = {entry_of(folder): folder for folder in workdir.cache.entries()}
    for entry, folder in visible.items():
        if entry in used:
            continue
        record, pulled = read_record(folder), _pulled(folder)
        # What cannot be read is no entry to anybody; what was pulled was written by no study that uses this cache.
        listed = record is not None and record.provenance.get("study") in writers and entry not in before
        taken = pulled is not None and not (shared and entry in before)
        known = record is None or listed or taken
        just_pulled = shared and pulled is not None and time.time() - pulled < KEPT_S
        where = found.unlisted if not known else found.recent if just_pulled or entry in recent else found.doomed
        where.append(folder)
    found.doomed += workdir.cache.quarantined()
    found.kept = _kept(workdir, listings, set(visible) - workdir.keys())
    return found


def _pulled(folder: Path) -> float | None:
    """Return when an entry was pulled, seconds since 1970; None where it was made here."""
    try:
        return (folder / PULLED).lstat().st_mtime
    except OSError:
        return None


def _is_shared(workdir: Workdir, listings: Iterable[Listing]) -> bool:
    """Return whether another study may use the cache: one in its list, or any where it lies outside this one."""
    folder, cache = map(os.path.realpath, (workdir.folder, workdir.cache.root))
    mine = workdir.study() if workdir.is_study else None
    listed = [one for one in listings if not one.forgotten]
    alone = all(mine is not None and one.study.same(mine) for one in listed)
    # A copy of the working folder has a cache of its own.
    return not (alone and os.path.commonpath([folder, cache]) == folder)


def _recent(listings: Iterable[Listing]) -> set[Entry]:
    """Return what studies pointed at within the last day."""
    now = time.time()
    return {entry for one in listings if not one.forgotten for entry, at in one.left.items() if now - at < KEPT_S}


def _refuse_unclear(workdir: Workdir) -> None:
    for path, entries in workdir.unclear().items():
        raise DataError(
            f"nothing was dropped: {path}, which says what this study uses, cannot be understood; any of "
            f"{len(entries)} entries may be meant, such as {'/'.join(min(entries))}",
            cure="'hrcneuro run', or the command that made these results, writes the file anew and computes nothing "
            "that is there; or remove the file if these results may go; then run gc again",
        )


def refuse_unlisted(workdir: Workdir, unlisted: Iterable[Path]) -> None:
    """Refuse to drop what may be of a study that is not in the list.

    Raises:
        ConfigError: There is such an entry.
    """
    folders = list(unlisted)
    if folders:
        raise ConfigError(
            f"nothing was dropped: {len(folders)} of the entries in {workdir.cache.root} "
            f"({sum(map(size, folders)) / 1e9:.2f} GB, such as {'/'.join(entry_of(folders[0]))}) were written by no "
            "study in its list, or before there was a list, so another study may share this cache without being in it",
            cure="run 'hrcneuro cache gc' in each other study that uses this cache, with this version: that enters it "
            "in the list; then again here. If there is no other, drop them too: hrcneuro cache gc --unlisted",
        )


def drop(workdir: Workdir, folders: Iterable[Path]) -> list[Path]:
    """Remove entries and quarantined folders; return those that went. What a study claims meanwhile stays.

    Raises:
        HrcError: A folder cannot be removed.
    """
    folders, quarantined = list(folders), set(workdir.cache.quarantined())
    gone = set(workdir.cache.drop([f for f in folders if f not in quarantined], lambda: claimed(workdir)))
    for folder in quarantined.intersection(folders):
        with guarded(folder):
            remove(folder)
        gone.add(folder)
    return [folder for folder in folders if folder in gone]


def forget(workdir: Workdir, names: Iterable[str]) -> None:
    """Let studies that are gone point at nothing any more.

    Raises:
        ConfigError: The list has no such study, or it is in its place.
    """
    listed = _studies(workdir, workdir.studies.read())
    for name in names:
        wanted = [k for k in listed if str(k.study) == name or k.study.folder == os.path.abspath(name)]
        if not wanted:
            away = ", ".join(str(k.study) for k in listed if k.away)
            raise ConfigError(
                f"no study of {name} is in the list of {workdir.cache.root}", cure=f"gone are: {away or 'none'}"
            )
        here = [k for k in wanted if not k.away]
        if here:
            raise ConfigError(
                f"the study in {name} is there, and its results point at this cache",
                cure=f"run 'hrcneuro cache gc' in it, or remove {Path(here[0].study.folder) / 'results'} first",
            )
        for one in wanted:
            with guarded(workdir.studies.folder):
                workdir.studies.forget(one.study)


def away_in_words(kept: Kept) -> str:
    """Return what a person should know, and do, of a study that is not in its place."""
    return (
        f"kept for a study that {kept.away} (last seen {ago(time.time() - kept.seen)}): {len(kept.entries)} entries; "
        f"if it has moved, run a command where it is now; then, or if it is deleted: hrcneuro cache gc --forget "
        f"{shlex.quote(str(kept.study))}"
    )


def _kept(workdir: Workdir, listings: Iterable[Listing], others: set[Entry]) -> list[Kept]:
    kept = _studies(workdir, listings)
    for one in kept:
        one.entries &= others
    return [one for one in kept if one.entries]


def _studies(workdir: Workdir, listings: Iterable[Listing]) -> list[Kept]:
    """Return the other studies in the list, each once, with all that they point at."""
    mine = workdir.study() if workdir.is_study else None
    found: list[Kept] = []
    for one in listings:
        if one.forgotten or (mine is not None and one.study.same(mine)):
            continue
        known = next((k for k in found if k.study.same(one.study)), None)
        if known is None:
            found.append(known := Kept(one.study, set(), one.seen, _away(workdir, one)))
            with contextlib.suppress(HrcError):
                known.entries |= set() if known.away else workdir.of(one.study).keys()
        known.entries |= one.entries
        known.seen = max(known.seen, one.seen)
    return found


def _away(workdir: Workdir, listing: Listing) -> str:
    if not listing.study.there():
        return f"is not seen at {listing.study}"
    with contextlib.suppress(OSError):
        if not os.path.samefile(listing.cache, workdir.cache.root):
            return f"is at {listing.study} and uses {listing.cache}, of which this cache is a copy"
    return ""
