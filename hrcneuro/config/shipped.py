"""Configurations, pipelines and multiverses that come with the program, for each a bare name: ``--config smoke``.

In a clone they lie in ``configs/``, ``pipelines/`` and ``multiverses/``; the folder ``shipped`` has links to them, so
that they are installed with the package.
"""

from __future__ import annotations

from pathlib import Path

from hrcneuro.errors import ConfigError, did_you_mean

_FOLDER = Path(__file__).parent / "shipped"
CONFIGURATIONS = "configs"
PIPELINES = "pipelines"
MULTIVERSES = "multiverses"
_WORDS = {CONFIGURATIONS: "configuration", PIPELINES: "pipeline", MULTIVERSES: "multiverse"}


def names(kind: str) -> list[str]:
    """Return the names of what comes with the program, of one of these kinds."""
    return sorted(path.stem for path in (_FOLDER / kind).glob("*.toml"))


def find(path: Path, kind: str) -> Path:
    """Return the file that a path, or the bare name of one that comes with the program, stands for.

    A file of that name in the working folder comes first.

    Raises:
        ConfigError: A bare name is neither.
    """
    if path.is_file() or path.name != str(path) or path.suffix:
        return path
    known = names(kind)
    if path.name in known:
        return _FOLDER / kind / f"{path.name}.toml"
    if path.exists():
        return path  # a folder, or a device: whoever reads it says what is wrong
    raise ConfigError(
        f"no {_WORDS[kind]} has the name {str(path)!r}{did_you_mean(path.name, known)}",
        cure=f"name one that comes with the program ({', '.join(known)}), or a file of your own, such as study.toml",
    )
