"""Whether ``hrcneuro record`` of the same subject loses a stream, by what it writes beside its recording."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

from hrcneuro.io.places import is_locked
from hrcneuro.live import journal
from hrcneuro.live.part import LOCK

_LOST, _THERE = ("stall", "lost"), ("back", "changed")


class RecorderWatch:
    """Looks at the newest recording of a subject, as long as somebody records.

    Attributes:
        seen: Somebody records, or did since this began to look.
    """

    def __init__(self, folder: Path, declared: Collection[str]) -> None:
        """Look into ``folder``, which holds the subject's recordings, for the streams ``declared``."""
        self._folder, self._declared = folder, tuple(declared)
        self.seen = False

    def look(self) -> str:
        """Return what is wrong with the recording; an empty text where nothing is, or where nobody has recorded."""
        # The arm's own recordings lie beside it, and may be younger; only who records locks.
        there = sorted(self._folder.glob(f"*/{LOCK}"))
        if not there:
            return ""
        # The one that is being written, whatever it is called: an older one may be resumed.
        newest = next((one for one in there if is_locked(one)), there[-1])
        running = is_locked(newest)
        if not (running or self.seen):
            return ""
        self.seen = True
        if not running:
            return "nobody records any more"
        parts = journal.parts(newest.parent)
        lost = _lost(parts[-1], self._declared) if parts else []
        return f"the recorder has lost {', '.join(lost)}" if lost else ""


def _lost(part: dict[str, Any], declared: Collection[str]) -> list[str]:
    state: dict[str, bool] = {}
    for event in part.get("events", []):
        if event.get("kind") in (*_LOST, *_THERE):
            # What it came back as has its name, and a number.
            state[str(event.get("stream")).partition("#")[0]] = event["kind"] in _LOST
    return [key for key in declared if state.get(key)]
