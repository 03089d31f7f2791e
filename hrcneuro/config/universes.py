"""The configuration of each universe: the study's, and the values that a universe takes in place of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from hrcneuro.config.multiverses import Choice, Multiverse, Value
from hrcneuro.config.settings import Settings
from hrcneuro.errors import ConfigError, DataError

Load = Callable[[Sequence[str]], Settings]
"""Returns the study's configuration with assignments on top, as ``--set`` takes them."""
_FEW = 5


def own_first(asked: Multiverse, load: Load) -> list[Choice]:
    """Return the choices with the study's own value first: the one that leaves its configuration as it is.

    Raises:
        ConfigError: A value is none that the option takes, or not one value of a choice is the study's own.
    """
    study = load(())
    mistakes: list[str] = []
    found = []
    for choice in asked.choices:
        own = []
        for value in choice.values:
            try:
                own += [value] if _same(load(value.assignments), study) else []
            except (ConfigError, DataError) as error:
                mistakes.append(f"{choice.name}, {value.name!r}: {error.problem}")
        if len(own) == 1:
            others = tuple(value for value in choice.values if value is not own[0])
            found.append(Choice(choice.name, (own[0], *others), choice.crossed))
        elif not mistakes:
            has = f"{len(own)} of its values are ({', '.join(value.name for value in own)})" if own else "none is"
            mistakes.append(
                f"{choice.name}: one value must be the study's own, and {has}; a name with {{}} sets nothing"
            )
    _refuse(asked, mistakes)
    return found


def settings_of(
    asked: Multiverse, choices: Sequence[Choice], every: Sequence[Mapping[str, str]], load: Load
) -> list[Settings]:
    """Return the configuration of each universe.

    Args:
        asked: The file.
        choices: Its choices, the study's own value first.
        every: Choice -> name of the value that each universe takes.
        load: As :data:`Load` says.

    Raises:
        ConfigError: Values of some universe contradict each other.
    """
    values: dict[tuple[str, str], Value] = {(one.name, value.name): value for one in choices for value in one.values}
    own = {one.name: one.values[0].name for one in choices}
    found, mistakes = [], []
    for chosen in every:
        taken = {name: value for name, value in chosen.items() if value != own[name]}
        try:
            found.append(load([text for pair in taken.items() for text in values[pair].assignments]))
        except ConfigError as error:
            words = "; ".join(f"{name}: {value}" for name, value in taken.items())
            mistakes.append(f"universe with {words}: {error.problem}")
    _refuse(asked, mistakes)
    return found


def _same(one: Settings, other: Settings) -> bool:
    return (one.study, one.shared, one.sections, one.own) == (other.study, other.shared, other.sections, other.own)


def _refuse(asked: Multiverse, mistakes: Sequence[str]) -> None:
    if mistakes:
        more = f"\n  - and {len(mistakes) - _FEW} more" if len(mistakes) > _FEW else ""
        found = "\n".join(f"  - {one}" for one in mistakes[:_FEW])
        raise ConfigError(
            f"the multiverse {asked.name} does not fit the study; nothing has run:\n{found}{more}",
            cure="correct its file; 'hrcneuro config show' prints every key with its value and range",
        )
