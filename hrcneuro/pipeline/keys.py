"""What decides a task's key: parameters, files, code and libraries, of a stage or of its pictures."""

from __future__ import annotations

import copy
import dataclasses
import fnmatch
import functools
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from hrcneuro import drawings, stages
from hrcneuro.cache import fingerprint
from hrcneuro.cache.record import Record
from hrcneuro.config.settings import Settings
from hrcneuro.contract import OF_ALL, Stage, chosen, params, plain
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.pipeline.graph import Need, Task, drawing_of
from hrcneuro.pipeline.workdir import FIGURES, Workdir

PACKAGE = Path(__file__).parents[1]


def check_places(settings: Settings, workdir: Workdir) -> None:
    """Refuse to keep in the cache what nobody can make again.

    Raises:
        ConfigError: Recordings are to lie there.
    """
    cache, real = workdir.cache.root, _real(workdir.cache.root)
    for stage, section in {**settings.sections, **settings.live}.items():
        for name, place in _places(section, workdir.folder, "recordings").items():
            if any(one == real or one.startswith(f"{real}/") for one in _all_real(place, settings.study.subjects)):
                raise ConfigError(
                    f"{stage}.{name} = {str(place)!r} lies in the cache {cache}, of which anything may be deleted, and "
                    "what is kept there cannot be made again",
                    cure=f"name a folder outside the cache, such as --set {stage}.{name}=recordings",
                )


def _all_real(place: Path, subjects: Iterable[str]) -> Iterator[str]:
    """Yield where a place and the subjects' folders in it lie, by whichever link any of them is named.

    One that leads back to itself is another's to tell of.
    """
    real = _real(place)
    yield real
    for subject in subjects:
        one = f"{real}/{subject}"
        # What is no link in a folder that is named by none lies where it seems to: hundreds are looked at.
        yield _real(one) if os.path.islink(one) else one


def _real(path: str | Path) -> str:
    return os.path.realpath(path).rstrip("/")


def _places(config: Any, folder: Path, kind: str) -> dict[str, Path]:
    """Return the options that name a place of this kind: what is named is absolute, else it lies in ``folder``."""
    values = {f.name: getattr(config, f.name) for f in dataclasses.fields(config) if f.metadata.get(kind)}
    return {name: folder / value for name, value in values.items() if value}


@functools.cache
def _pattern(patterns: tuple[str, ...]) -> Callable[[str], object]:
    """Return what tells of a name whether it fits one of these patterns of a shell."""
    return re.compile("|".join(map(fnmatch.translate, patterns)) or "(?!)").match


class Keys:
    """Makes the parts of keys, and remembers what it has hashed."""

    def __init__(self, settings: Settings, workdir: Workdir) -> None:
        self.settings = settings
        self.folder = workdir.folder
        self.memo = fingerprint.Memo(workdir.cache.root / ".memo.json")
        self._static: dict[tuple[str, str], dict[str, Any]] = {}
        # Of objects that live as long as this one, by their identity.
        self._texts: dict[int, str] = {}
        self._params: dict[tuple[int, str], dict[str, Any]] = {}
        self._libs: dict[tuple[int, str], dict[str, str]] = {}

    def of(self, settings: Settings) -> Keys:
        """Return the same for another configuration in this working folder, with all that was hashed for this one."""
        other = copy.copy(self)
        other.settings = settings
        # Options of drawings are in what their pictures share.
        other._static = {place: parts for place, parts in self._static.items() if not place[0].endswith(FIGURES)}
        # By identity: of what lives as long as these keys, and of no other's, whose numbers may be given anew.
        kept = (id(part) for parts in other._static.values() for part in parts.values())
        other._texts = {number: self._texts[number] for number in kept}
        other._params, other._libs = {}, {}
        return other

    def key(self, parts: Mapping[str, Any]) -> str:
        """Return the key that parts make."""
        texts = {name: self._texts[id(part)] for name, part in parts.items() if id(part) in self._texts}
        return fingerprint.key(parts, texts)

    def parts(self, task: Task, upstream: Iterable[tuple[Record, Need]]) -> dict[str, Any]:
        """Return the named parts of a task's key.

        Raises:
            DataError: A source file is missing or cannot be read.
        """
        inputs = {
            f"{record.stage}/{record.unit}/{name}": record.outputs[name]["sha256"]
            for record, need in upstream
            for name in self.matching(record, need)
        }
        parts = {"stage": task.name, "unit": task.unit, "inputs": inputs, **self._unchanging(task)}
        if not task.draws:
            config = self.settings.section(task.name, task.unit)
            stage = stages.load(task.name)
            parts["params"] = self._params_of(config, stage, task.unit)
            parts["libs"] = self._libs_of(config, task, parts["libs"])
            if kept := self.settings.last_sources.get((task.name, task.unit)):
                return {**parts, "sources": dict(kept)}
            files = stage.sources(config, task.unit)
            if files:
                parts["sources"] = {label: self.content(path) for label, path in sorted(files.items())}
        return parts

    def _params_of(self, config: Any, stage: Stage, unit: str) -> dict[str, Any]:
        """Return the options that decide a unit's result: not those that another result on the side alone reads."""
        own = stage.side(config, unit)
        place = id(config), own.unit if own else ""
        if place not in self._params:
            others = {name for side in stage.sides if side is not own for name in side.options}
            self._params[place] = {name: value for name, value in params(config).items() if name not in others}
            self._write(self._params[place])
        return self._params[place]

    def _libs_of(self, config: Any, task: Task, declared: Mapping[str, str]) -> dict[str, str]:
        place = id(config), task.name
        if place not in self._libs:
            self._libs[place] = {**declared, **_packages(task, config)}
            self._write(self._libs[place])
        return self._libs[place]

    def _write(self, part: Any) -> None:
        """Write a part that many keys have, and that lives as long as these keys, in canonical form, once."""
        self._texts[id(part)] = fingerprint.canonical(part)

    def config(self, task: Task) -> Any:
        """Return what a task is handed of the configuration: a stage its section, a drawing the options it names."""
        if not task.draws:
            return self._placed(self.settings.section(task.name, task.unit))
        return chosen(self.settings.sections, drawing_of(task).options)

    def _placed(self, config: Any) -> Any:
        """Return options whose places lie in the working folder where nobody named one: what is named is absolute."""
        places = {name: str(place) for name, place in _places(config, self.folder, "path").items()}
        return dataclasses.replace(config, **places) if places else config

    def content(self, path: Path) -> str:
        """Return the digest of a file's content.

        Raises:
            DataError: It cannot be read.
        """
        try:
            return self.memo.get("bytes", path, fingerprint.file_digest)
        except OSError as error:
            raise DataError(f"{path} cannot be read: {error.strerror}", cure="check the file and its rights") from error

    def matching(self, record: Record, need: Need) -> list[str]:
        """Return the names of an entry's files that are read."""
        fits = _pattern(need.files)
        return [name for name in record.outputs if fits(name)]

    def _unchanging(self, task: Task) -> dict[str, Any]:
        """Return the parts that all subjects of a stage, or of its pictures, share."""
        place = (task.name, task.unit if task.draws and task.unit in OF_ALL else "")
        if place not in self._static:
            self._static[place] = self._of_drawing(task) if task.draws else self._of_stage(task)
            for part in self._static[place].values():
                self._write(part)
        return self._static[place]

    def _of_stage(self, task: Task) -> dict[str, Any]:
        return _installed(task, self.memo)

    def _of_drawing(self, task: Task) -> dict[str, Any]:
        drawing = drawing_of(task)
        config = vars(chosen(self.settings.sections, drawing.options))
        params_ = {section: plain(vars(options)) for section, options in config.items()}
        return {"params": params_, **_installed(task, self.memo)}


def installed(task: Task, config: Any, memo: fingerprint.Memo) -> dict[str, dict[str, str]]:
    """Return the parts of a task's key that this machine's installation decides: ``code`` and ``libs``."""
    parts = _installed(task, memo)
    return parts if task.draws else {**parts, "libs": {**parts["libs"], **_packages(task, config)}}


def _installed(task: Task, memo: fingerprint.Memo) -> dict[str, dict[str, str]]:
    declared = drawings.load(task.subject) if task.draws else stages.load(task.name)
    module = f"hrcneuro.{'drawings' if task.draws else 'stages'}.{task.subject}"
    return {"code": fingerprint.code(module, PACKAGE, memo), "libs": fingerprint.libraries(declared.libraries)}


def _packages(task: Task, config: Any) -> dict[str, str]:
    """Return the versions of other people's code that the configuration names."""
    return {name: fingerprint.version(name) for name in stages.load(task.name).packages(config)}
