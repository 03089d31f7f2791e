"""What came out, as blocks of text under a heading, and whether it is still what the configuration asks for."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from hrcneuro import answers
from hrcneuro.cli.plan import span
from hrcneuro.contract import GROUP, OF_ALL, is_piece
from hrcneuro.errors import DataError
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

    Raises:
        DataError: A summary does not have what its stage tells.
    """
    by_stage: dict[str, dict[str, Mapping[str, Any]]] = {}
    for stage, unit, summary in summaries:
        by_stage.setdefault(stage, {})[unit] = summary
    found: list[str] = []
    for stage, units in by_stage.items():
        subjects = {unit: summary for unit, summary in units.items() if unit not in OF_ALL}
        of_all = [unit for unit in OF_ALL if unit in units and not (unit == GROUP and len(subjects) == 1)]
        told = {unit: units[unit] for unit in of_all} or subjects
        if not of_all and len(subjects) > (1 if whole else _FEW):
            with _readable(stage, span(list(subjects))):
                said = answers.together(stage, subjects)
            if said:
                found += answers.block(f"{stage}, {span(list(subjects))}", said)
                continue
        for unit, summary in told.items():
            with _readable(stage, unit):
                found += answers.block(f"{stage}, {unit}", answers.lines(stage, unit, summary, every=every))
    return found


@contextlib.contextmanager
def _readable(stage: str, units: str) -> Iterator[None]:
    """Say which record it is where one does not have what its stage tells: it may come from somebody else's cache."""
    try:
        yield
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise DataError(
            f"the record of {stage} of {units} does not tell what it should ({type(error).__name__}: {error})",
            cure=f"make it anew: hrcneuro {stage} --force; if that does not help, please report it as a bug",
        ) from error


def asked_for(settings: Settings, workdir: Workdir, stage: str, unit: str = "") -> dict[str, Mapping[str, Any]]:
    """Return unit -> summary of what the configuration asks for; without a unit, of those that speak for the stage.

    Raises:
        ConfigError: The study has no such unit.
        DataError: It has not been computed with this configuration.
    """
    from hrcneuro import stages
    from hrcneuro.pipeline import asked

    if unit:
        return {unit: asked.result(settings, workdir, stage, unit).summary}
    loaded = stages.load(stage)
    of_study = [*settings.study.subjects, *([GROUP] if loaded.group else []), *(one.unit for one in loaded.sides)]
    items = asked.standing(settings, workdir, stage, of_study)
    found = {i.unit: i.summary for i in items if i.stage == stage and i.state.done and not is_piece(i.unit)}
    # Where there is nothing, the first of what another configuration has: why it is not asked for says it of all.
    speaking = _speaking(settings, sorted(found)) or _speaking(settings, _ran(workdir, stage))[:1]
    return {one: found[one] if found else asked.result(settings, workdir, stage, one).summary for one in speaking}


def last(settings: Settings, workdir: Workdir, stage: str, unit: str = "") -> dict[str, Mapping[str, Any]]:
    """Return unit -> summary of what was last computed, whatever its configuration; the units as :func:`asked_for`.

    Raises:
        DataError: It has not run, or is gone from the cache.
    """
    of = [unit] if unit else _speaking(settings, _ran(workdir, stage))
    return {one: workdir.summary(stage, one) for one in of}


def _ran(workdir: Workdir, stage: str) -> list[str]:
    """Return the units of a stage that have run, whatever their configuration.

    Raises:
        DataError: None has.
    """
    from hrcneuro import stages
    from hrcneuro.errors import DataError

    entries = workdir.keys()
    if ran := sorted(unit for name, unit, _ in entries if name == stage and not is_piece(unit)):
        return ran
    own = " SUBJECT" if stages.load(stage).subject else ""
    raise DataError(f"{stage} has not run in {workdir.folder}", cure=f"hrcneuro {stage}{own}")


def _speaking(settings: Settings, ran: Sequence[str]) -> list[str]:
    """Return the units that speak for a stage, of those that have run: the group and what is beside it, or all."""
    subjects = [unit for unit in ran if unit in settings.study.subjects]
    of_all = [unit for unit in OF_ALL if unit in ran]
    if GROUP in of_all and len(settings.included) == 1 and subjects == [*settings.included]:
        return subjects  # a group of one says less
    return of_all or subjects or list(ran)


def there(settings: Settings, workdir: Workdir, *, whatever: bool = False) -> dict[str, list[str]]:
    """Return stage -> units that there are to show of this configuration.

    Args:
        settings, workdir: What is asked for, and where.
        whatever: Of what was last computed, whatever its configuration.

    Raises:
        DataError: None; with those of other configurations, if there are any.
    """
    from hrcneuro.errors import DataError
    from hrcneuro.pipeline import asked

    others: dict[str, list[str]] = {}
    for stage, unit, _ in sorted(workdir.keys(), key=lambda entry: (entry[1] in OF_ALL, entry[1])):
        if stage in STAGES and not is_piece(unit):
            others.setdefault(stage, []).append(unit)
    if whatever and others:
        return {stage: others[stage] for stage in STAGES if stage in others}
    by_stage: dict[str, list[str]] = {}
    for item in asked.whole(settings, workdir) if not whatever else ():
        if item.state.done and not is_piece(item.unit):
            by_stage.setdefault(item.stage, []).append(item.unit)
    if by_stage:
        return by_stage
    names = [f"{stage} {unit}" for stage in sorted(others) for unit in others[stage]]
    also = f"; with another one have: {', '.join(names[:6])}{' …' if len(names) > 6 else ''}" if names else ""
    raise DataError(
        f"nothing has run with this configuration in {workdir.folder}{also}",
        cure="run a stage first, such as hrcneuro epoch"
        + ("; or name the --config and --set of what is there; --last shows it as it is" if names else ""),
    )
