"""What came out, as blocks of text under a heading, and whether it is still what the configuration asks for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from hrcneuro import answers
from hrcneuro.cli.plan import span
from hrcneuro.contract import GROUP, OF_ALL, SWEEP, is_piece
from hrcneuro.stages import NAMES as STAGES

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

    Where nothing has run with this configuration, those that have run with another one.

    Raises:
        DataError: It has not run.
    """
    from hrcneuro import stages
    from hrcneuro.errors import DataError
    from hrcneuro.pipeline import asked

    loaded = stages.load(stage)
    of_study = [*settings.study.subjects, *([GROUP] if loaded.group else []), *([SWEEP] if loaded.sweep else [])]
    items = asked.standing(settings, workdir, stage, of_study)
    here = sorted(item.unit for item in items if item.stage == stage and item.state.done and not is_piece(item.unit))
    entries = workdir.keys()
    ran = here or sorted(unit for name, unit, _ in entries if name == stage and not is_piece(unit))
    subjects = [unit for unit in ran if unit in settings.study.subjects]
    of_all = [unit for unit in OF_ALL if unit in ran]
    if GROUP in of_all and len(settings.included) == 1 and subjects == [*settings.included]:
        return subjects  # a group of one says less
    if of_all:
        return of_all
    if not ran:
        raise DataError(
            f"{stage} has not run in {workdir.folder}", cure=f"hrcneuro {stage}{' SUBJECT' if loaded.subject else ''}"
        )
    return subjects or ran


def there(settings: Settings, workdir: Workdir) -> list[str]:
    """Return which stages and units there are to show of this configuration, a line a stage.

    Raises:
        DataError: None; with those of other configurations, if there are any.
    """
    from hrcneuro.errors import DataError
    from hrcneuro.pipeline import asked

    by_stage: dict[str, list[str]] = {}
    for item in asked.whole(settings, workdir):
        if item.state.done and not is_piece(item.unit):
            by_stage.setdefault(item.stage, []).append(item.unit)
    if by_stage:
        width = max(map(len, by_stage))
        return [f"{stage:<{width}}  {', '.join(of)}" for stage, of in by_stage.items()]
    entries = workdir.keys()
    others = sorted({f"{stage} {unit}" for stage, unit, _ in entries if stage in STAGES and not is_piece(unit)})
    also = f"; with another one have: {', '.join(others[:6])}{' …' if len(others) > 6 else ''}" if others else ""
    raise DataError(
        f"nothing has run with this configuration in {workdir.folder}{also}",
        cure="run a stage first, such as hrcneuro epoch"
        + ("; or name the --config and --set of what is there" if others else ""),
    )


def of_configuration(
    settings: Settings, workdir: Workdir, stage: str, units: Sequence[str]
) -> tuple[dict[str, Mapping[str, Any]], str]:
    """Return unit -> summary of what the configuration asks for, and a note.

    Where that has not been computed, what was last computed in this folder takes its place, and the note says so.

    Raises:
        DataError: A unit has never run.
    """
    from hrcneuro.pipeline import asked

    items = asked.standing(settings, workdir, stage, units)
    found = {item.unit: item for item in items if item.stage == stage and item.state.done}
    lacking = [unit for unit in units if unit not in found]
    summaries = {unit: found[unit].summary if unit in found else workdir.summary(stage, unit) for unit in units}
    if not lacking:
        return summaries, ""
    cause = asked.cause(items)
    of = "" if len(lacking) == len(units) else f"of {span(lacking)} "
    return summaries, (
        f"{of}this is what was last computed; the configuration asks for something else by now"
        f"{f' ({cause})' if cause else ''}: hrcneuro status"
    )
