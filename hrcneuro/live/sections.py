"""The sections of a configuration that are about the live side, and are no stages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hrcneuro.live import parameters


@dataclass(frozen=True)
class Section:
    """A section.

    Attributes:
        options: A frozen dataclass of option fields.
        check: Returns sentences that say which values contradict each other.
    """

    options: type
    check: Callable[[Any], list[str]]


SECTIONS = {
    "record": Section(parameters.RecordOptions, parameters.check_record),
    "online": Section(parameters.OnlineOptions, parameters.check_online),
}
