"""What came out, as blocks of text under a heading, and whether it is still what the configuration asks for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from hrcneuro import answers
from hrcneuro.cli.plan import span
from hrcneuro.contract import GROUP, OF_ALL

if TYPE_CHECKING:
    from hrcneuro.config.settings import Settings
    from hrcneuro.pipeline.workdir import Workdir

# So many subjects are told one by one, more of them together.
_FEW = 3


def blocks(
    summaries: Iterable[tuple[str, str, Mapping[str, Any]]], *, whole: bool = False, every: bool = False
) -> list[str]:
    """Return the numbers of stages (stage, unit, summary) as lines, a block a stage.

    Where there is a group of more than one, it speaks for its subjects; else a few subjects are told one by one.

    Args:
        summaries: In the order in which they are told.
        whole: Of a whole study: where there is no group, subjects are always told together.
        every: Leave no row of a table out.
    """
    by_stage: dict[str, dict[str, Mapping[str, Any]]] = {}
    for stage, unit, summary in summaries:
        by_stage.setdefault(stage, {})[unit] = summary
    found: list[str] = []
    for stage, units in by_stage.items():
        subjects = {unit: summary for unit, summary in units.items() if unit not in OF_ALL}
        of_all = [unit for unit in OF_ALL if unit in units and not (unit == GROUP and len(subjects) == 1)]
        if of_all:
            for unit in of_all:
                found += answers.block(f"{stage}, {unit}", answers.lines(stage, unit, units[unit], every=every))
        elif len(subjects) > (1 if whole else _FEW) and (said := answers.together(stage, subjects)):
            found += answers.block(f"{stage}, {span(list(subjects))}", said)
        else:
            for unit, summary in subjects.items():
                found += answers.block(f"{stage}, {unit}", answers.lines(stage, unit, summary, every=every))
    return found


def units(settings: Settings, workdir: Workdir, stage: str) -> list[str]:
    """Return the units of a stage that speak for it, of those that have run: the group and a sweep, else every subject.

    Subjects of another configuration in the same folder are left out, unless only they have run.

    Raises:
        DataError: It has not run.
    """
    from hrcneuro import stages
    from hrcneuro.errors import DataError

    entries = workdir.keys()
    ran = sorted(unit for name, unit, _ in entries if name == stage)
    subjects = [unit for unit in ran if unit in settings.study.subjects]
    of_all = [unit for unit in OF_ALL if unit in ran]
    if GROUP in of_all and len(settings.included) == 1 and subjects == [*settings.included]:
        return subjects  # a group of one says less
    if of_all:
        return of_all
    if not ran:
        only_group = stages.load(stage).subject is None
        raise DataError(
            f"{stage} has not run in {workdir.folder}", cure=f"hrcneuro {stage}{'' if only_group else ' SUBJECT'}"
        )
    return subjects or ran


def asked(
    settings: Settings, workdir: Workdir, stage: str, units: Sequence[str]
) -> tuple[dict[str, Mapping[str, Any]], str]:
    """Return unit -> summary of what the configuration asks for, and a note.

    Where that has not been computed, what was last computed in this folder takes its place, and the note says so.

    Raises:
        DataError: A unit has never run.
    """
    from hrcneuro.pipeline import graph, swept, walk

    known = swept.remembered(settings, workdir)
    tasks = [graph.Task.of(stage, unit) for unit in units if unit in (*settings.study.subjects, *OF_ALL)]
    items = walk.Run(known, workdir, graph.closure(known, tasks)).plan() if tasks else []
    found = {item.unit: item for item in items if item.stage == stage}
    summaries: dict[str, Mapping[str, Any]] = {}
    cause = None
    for unit in units:
        item = found.get(unit)
        if item is not None and item.state.done:
            summaries[unit] = item.summary
        else:
            summaries[unit] = workdir.summary(stage, unit)
            why = item.why if item is not None else ()
            cause = cause or (f" ({why[0]})" if why else "")
    if cause is None:
        return summaries, ""
    return summaries, (
        f"this is what was last computed; the configuration asks for something else by now{cause}: hrcneuro status"
    )
