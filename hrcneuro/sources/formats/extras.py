"""Libraries that only some formats need: an extra of the installation each."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from hrcneuro.errors import ConfigError


def needed(module: str, what: str, *, extra: str = "formats") -> ModuleType:
    """Return a library that a format is read by.

    Args:
        module: Its name, for ``import`` and for ``pip`` alike.
        what: What is read, for the message.
        extra: The extra that installs it.

    Raises:
        ConfigError: It is not installed; the cure is the command that installs it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise ConfigError(
            f"reading {what} needs {module}, which is not installed", cure=f"pip install 'hrcneuro[{extra}]'"
        ) from error
