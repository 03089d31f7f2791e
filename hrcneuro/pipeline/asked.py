"""What a configuration asks for: whether it has been computed, and where it lies, whatever ran last in the folder."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from hrcneuro import drawings, stages
from hrcneuro.config.settings import Settings
from hrcneuro.contract import ASKED_BY, GROUP, OF_ALL, is_piece
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.pipeline import graph, sides, walk
from hrcneuro.pipeline.graph import Task
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.workdir import Workdir, refuse_dropped

_LAST = "--last (in Python last=True) takes what ran last, whatever its configuration"


def whole(settings: Settings, workdir: Workdir) -> list[Item]:
    """Return how the numbers of the whole study stand; nothing runs."""
    known = sides.remembered(settings, workdir)
    tasks = graph.closure(known, graph.targets(known, known.stages, ()))
    return sides.told(settings, walk.Run(known, workdir, tasks).plan())


def standing(settings: Settings, workdir: Workdir, stage: str, units: Iterable[str]) -> list[Item]:
    """Return how units of a stage, and all that they stand on, stand; units that the study does not have are left out.

    What a unit stands on comes before it.
    """
    known = sides.remembered(settings, workdir)
    tasks = [Task.of(stage, unit) for unit in units if unit in (*settings.study.subjects, *OF_ALL) or is_piece(unit)]
    return walk.Run(known, workdir, graph.closure(known, tasks)).plan() if tasks else []


def cause(items: Sequence[Item]) -> str:
    """Return why not all of these items are fresh: what the first of them says that is not; empty where all are."""
    return next((item.why[0] for item in items if not item.state.done and item.why), "")


def result(settings: Settings, workdir: Workdir, stage: str, unit: str) -> Item:
    """Return a unit's item, which has its summary and its files.

    Raises:
        ConfigError: The study has no such unit.
        DataError: It has not been computed; what is there of it was, with another configuration.
    """
    side = unit in OF_ALL and unit != GROUP
    if side and not stages.load(stage).side_of(unit):
        raise ConfigError(
            f"{stage} has no {unit}", cure=f"name a subject or group: hrcneuro status lists what {stage} has"
        )
    if not (is_piece(unit) or side or workdir.pointer(stage, unit)):
        graph.targets(settings, [stage], [unit])  # which says what is wrong with a name that nobody has
    items = standing(settings, workdir, stage, [unit])
    found = next((item for item in items if (item.stage, item.unit) == (stage, unit)), None)
    if found is None or not found.state.done:
        raise _absent(workdir, stage, unit, items)
    return found


def place(settings: Settings, workdir: Workdir, stage: str, unit: str, file: str = "") -> Path:
    """Return where a unit's folder, or one file or picture of it, lies; ``stage`` may name pictures that join stages.

    Raises:
        ConfigError: There is no such stage, or the study has no such unit.
        DataError: It has not been computed with this configuration, or has no such file.
    """
    graph.check_stage(stage, joint=True)
    drawn = stage in drawings.JOINT
    found = _pictures(settings, workdir, stage, unit) if drawn else result(settings, workdir, stage, unit)
    names = [*found.artifacts]
    if file and file not in names and not drawn and (captions := _captions(stage, unit)):
        if Path(file).stem in captions:
            found = _pictures(settings, workdir, stage, unit)
            names += found.artifacts
        else:
            names += [f"{stem}.png" for stem in captions]
    if file and not found.draws:
        refuse_dropped(workdir.cache.folder(found.stage, unit, found.key), stage, unit, file)
    if file and file not in found.artifacts:
        raise DataError(f"{stage} of {unit} has no file {file!r}", cure=f"name one of: {', '.join(sorted(set(names)))}")
    return Path(found.artifacts[file]) if file else workdir.cache.folder(found.stage, unit, found.key)


def _captions(stage: str, unit: str) -> list[str]:
    """Return the pictures that may be drawn of a unit, without their endings."""
    drawing = drawings.load(stage).of(unit) if stage in drawings.NAMES else None
    return [Path(name).stem for name in drawing.captions] if drawing else []


def _pictures(settings: Settings, workdir: Workdir, name: str, unit: str) -> Item:
    """Return the item of a unit's pictures; those that join stages are of all that the whole study has.

    Raises:
        DataError: They have not been drawn.
    """
    known = sides.remembered(settings, workdir)
    joint = name in drawings.JOINT
    wanted = graph.targets(known, known.stages, ()) if joint else [Task.of(name, unit)]
    numbers = graph.closure(known, wanted)
    task = Task.drawing(name, unit)
    needed = {one: needs for one, needs in graph.pictures(known, numbers, joint=joint).items() if one == task}
    for item in walk.Run(known, workdir, numbers | needed).plan():
        if item.draws and item.state.done:
            return item
    raise DataError(
        f"the pictures {name} of {unit} have not been drawn with this configuration in {workdir.folder}",
        cure="hrcneuro report, with the same --config and --set, draws what can be drawn",
    )


def _absent(workdir: Workdir, stage: str, unit: str, items: Sequence[Item]) -> DataError:
    """Return what is said where a unit's result is not there: why, what is there, and how to have either."""
    own = ASKED_BY.get(unit, f" {unit}")
    command = f"hrcneuro {stage}{own}"
    failed = next((item.error for item in items if item.state is State.FAILED), None)
    if failed is not None:
        last = f"; {_LAST}" if workdir.pointer(stage, unit) else ""
        return DataError(
            f"whether {stage} of {unit} is there cannot be told: {failed.problem}", cure=f"{failed.cure}{last}"
        )
    if not workdir.pointer(stage, unit):
        return DataError(f"{stage} of {unit} has not run in {workdir.folder}", cure=command)
    why = f" ({cause(items)})" if items else ""
    return DataError(
        f"{stage} of {unit} has not been computed with this configuration in {workdir.folder}; what was last computed "
        f"there is another{why}",
        cure=f"compute it: {command}, with the same --config and --set; or name those of what is there; {_LAST}",
    )
