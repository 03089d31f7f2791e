"""The log of an experiment as it is begun, or gone on with: what is refused, and what is mended first."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hrcneuro.arms.clock import seconds
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.experiment import mending
from hrcneuro.experiment.disk import replaced
from hrcneuro.experiment.entries import entry_of, line_of, plain, session
from hrcneuro.experiment.log import SIMULATED, Log
from hrcneuro.experiment.places import ANOTHER, opened, reading, refuse_begun, refuse_running
from hrcneuro.experiment.progress import Progress, of_entries
from hrcneuro.io.places import check_room
from hrcneuro.sources import experiments

_ROOM = 20_000_000  # bytes: several sessions


def refuse(
    folder: Path, subject: str, *, options: Mapping[str, Any], within: str = "", simulated: bool, resume: bool
) -> None:
    """Refuse what :func:`begin` or :func:`resume` would refuse, and write nothing.

    Arguments as there; ``resume`` says which of the two.

    Raises:
        ConfigError, DataError, HardwareError, StageError: As there.
    """
    place = folder / subject / within
    if not resume:
        _check_room(place)
        refuse_begun(place, subject)
        return
    _refuse_without_session(place)
    refuse_running(place, subject)
    with reading(place):
        entries, _ = experiments.read(place / experiments.FILE)
    _refuse_other(place, subject, of_entries(entries), _asked(options, simulated))


def begin(
    folder: Path, subject: str, *, options: Mapping[str, Any], about: Mapping[str, Any] | None = None,
    within: str = "", simulated: bool = False, real_time: bool = True, now: Callable[[], float] = seconds,
) -> Log:  # fmt: skip
    """Begin the log of a session that was never begun.

    Args:
        folder: Where recordings are kept.
        subject: Whose session.
        options: JSON values that decide the session, its seed among them; one that goes on must have the same.
        about: JSON values that are worth knowing, and may differ when it goes on.
        within: A folder in the subject's, in which it lies.
        simulated, real_time, now: As :class:`~hrcneuro.experiment.log.Log` takes them.

    Raises:
        ConfigError: The subject has a session, or the folder may not be written.
        HardwareError: Another experiment of the subject is running.
        StageError: There is no room.
    """
    place = folder / subject / within
    _check_room(place)
    with opened(place, subject) as lock:
        refuse_begun(place, subject)
        began = now()
        fields = session(1, subject, _asked(options, simulated), about, began)
        entry = entry_of(experiments.SESSION, 0.0, datetime.now(UTC), fields)
        replaced(place / experiments.FILE, lambda part: part.write_text(line_of(entry), encoding="utf-8"))
        progress = of_entries([entry])
        mending.mend_pair(place, subject, progress, SIMULATED if simulated else "")
        return Log(place, subject, lock, progress, simulated=simulated, real_time=real_time, now=now, origin_s=began)


def resume(
    folder: Path, subject: str, *, options: Mapping[str, Any], about: Mapping[str, Any] | None = None,
    within: str = "", simulated: bool = False, real_time: bool = True, now: Callable[[], float] = seconds,
) -> Log:  # fmt: skip
    """Go on with the log of a session that was broken off; ``Log.progress`` tells how far it had come.

    Arguments as of :func:`begin`. What a crash has left of a line is moved to ``experiment.torn``.

    Raises:
        DataError: There is no session, or its log is damaged.
        ConfigError: It is complete, was begun with other options, or the folder may not be written.
        HardwareError: Another experiment of the subject is running.
    """
    place = folder / subject / within
    _refuse_without_session(place)
    with opened(place, subject) as lock:
        entries, notes = mending.mend_journal(place / experiments.FILE)
        progress, asked = of_entries(entries), _asked(options, simulated)
        _refuse_other(place, subject, progress, asked)
        progress.notes = notes + mending.mend_pair(place, subject, progress, SIMULATED if simulated else "")
        wall = datetime.now(UTC)
        session_s = progress.passed(wall)
        log = Log(
            place, subject, lock, progress, simulated=simulated, real_time=real_time, now=now,
            origin_s=now() - session_s,
        )  # fmt: skip
        more = session(progress.parts + 1, subject, asked, about, now()) | {"mended": progress.notes}
        log.begin_part(wall, session_s, more)
    return log


def _asked(options: Mapping[str, Any], simulated: bool) -> dict[str, Any]:
    asked: dict[str, Any] = plain({**options, "simulated": simulated})
    return asked


def _check_room(place: Path) -> None:
    check_room(
        place, _ROOM, what="the experiment's log", cure="free space, or choose another place: record.folder",
        then="nothing was begun",
    )  # fmt: skip


def _refuse_without_session(place: Path) -> None:
    if not (place / experiments.FILE).is_file():
        raise DataError(
            f"there is no experiment to go on with in {place}", cure="begin one: the same command without --resume"
        )


def _refuse_other(place: Path, subject: str, progress: Progress, asked: Mapping[str, Any]) -> None:
    if progress.complete:
        raise ConfigError(f"the session of {subject} in {place} is complete", cure=ANOTHER)
    progress.refuse_other(asked)
