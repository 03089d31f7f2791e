"""mne-lsl and its liblsl: loaded without what streams do not need, silent unless a laboratory asks for more."""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import sys
import types
from pathlib import Path
from typing import Any

from hrcneuro.errors import HardwareError
from hrcneuro.live.transport import N_PORTS

_WARNINGS = -1  # level of liblsl's log: warnings and errors
_QUIET = -3
_HERE = "[lab]\nKnownPeers = {127.0.0.1}\n"
_PORTS = f"[ports]\nPortRange = {N_PORTS}\n"


def apart(session: str) -> str:
    """Return a configuration of liblsl whose streams this machine alone sees, and of it who has the same session."""
    return (
        f"{_HERE}SessionID = {session}\n[multicast]\nResolveScope = machine\n{_PORTS}IPv6 = disable\n"
        f"[log]\nlevel = {_QUIET}\n"
    )


def library(purpose: str, *, instead: str = "") -> Any:
    """Return ``mne_lsl.lsl``, told where to look for streams unless a laboratory has configured that.

    Args:
        purpose: What needs it, for the message: ``markers go out through``.
        instead: What can be done without it, for the cure.

    Raises:
        HardwareError: mne-lsl is not installed, or its liblsl does not load.
    """
    try:
        lsl = _streams_alone()
    except ImportError as error:
        missing = error.name is not None and error.name.partition(".")[0] == "mne_lsl"
        raise HardwareError(
            f"{purpose} mne-lsl, which is not installed" if missing else f"mne-lsl does not load: {error}",
            cure=f"pip install 'hrcneuro[lsl]'{instead and ', or '}{instead}",
        ) from error
    places = (os.environ.get("LSLAPICFG", ""), "lsl_api.cfg", "~/lsl_api/lsl_api.cfg", "/etc/lsl_api/lsl_api.cfg")
    theirs = next((path for place in places if place and (path := Path(place).expanduser()).is_file()), None)
    if theirs is None:
        # On a machine whose only network is itself, not all streams would be found. Errors of liblsl on standard error
        # are of connections that end, which is no error here.
        lsl.set_config_content(f"{_HERE}{_PORTS}[log]\nlevel = {_QUIET}\n")
    elif (text := _without_level(theirs)) is not None:
        # Left alone, liblsl also tells what is in order, in the midst of what a person must read.
        lsl.set_config_content(f"{text}\n[log]\nlevel = {_WARNINGS}\n")
    return lsl


def _without_level(place: Path) -> str | None:
    """Return a laboratory's configuration of liblsl where it leaves open how much is logged; else, none."""
    try:
        text = place.read_text(encoding="utf-8")
    except (OSError, UnicodeError):
        return None
    log = re.search(r"^\s*\[log\](.*?)(?=^\s*\[|\Z)", text, re.MULTILINE | re.DOTALL)
    return None if log and re.search(r"^\s*level\s*=", log[1], re.MULTILINE) else text


def _streams_alone() -> Any:
    """Return ``mne_lsl.lsl`` without what ``import mne_lsl`` brings along.

    Its player, its viewer and with them SciPy's statistics are two seconds and 80 MB that a recorder, an amplifier and
    an arm's process do not need (mne-lsl 1.14). Who imports mne_lsl afterwards gets it whole.
    """
    name = "mne_lsl"
    if name in sys.modules:
        return importlib.import_module(name).lsl
    found = importlib.util.find_spec(name)
    if found is None or found.submodule_search_locations is None:
        raise ImportError(f"No module named {name!r}", name=name)
    package = types.ModuleType(name)
    package.__path__ = list(found.submodule_search_locations)
    package.__spec__ = found
    sys.modules[name] = package
    try:
        return importlib.import_module("mne_lsl.lsl")
    finally:
        del sys.modules[name]
