"""Before a recording begins: the declared streams are found, opened and looked at, and all that is wrong is told."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from hrcneuro.errors import HardwareError
from hrcneuro.live import preflight
from hrcneuro.live.parameters import Declared, RecordOptions
from hrcneuro.live.preflight import Look, Problem
from hrcneuro.live.transport import PORTS, Clock, Description, Inlet, Lost, Network, Samples

Wait = Callable[[float], None]
"""Lets seconds pass."""
STEP_S = 0.05
_LOOK_AGAIN_S = 0.5


@dataclass
class Opened:
    """Streams that are received, and what came of them while they were looked at.

    Attributes:
        inlets: By their name in the configuration; other streams by their own.
        looks: The same, for those that were looked at.
        problems: What stands against a recording.
        left_out: Other streams that are seen and cannot be received, with why.
    """

    inlets: dict[str, Inlet] = field(default_factory=dict)
    looks: dict[str, Look] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)

    def close(self) -> None:
        """Receive no more."""
        for inlet in self.inlets.values():
            inlet.close()


def prepare(network: Network, clock: Clock, wait: Wait, options: RecordOptions) -> Opened:
    """Return the streams to be recorded, open and looked at, with all that stands against recording them."""
    chosen, problems = _found(network, clock, wait, options.streams, options.wait_s)
    opened = Opened(problems=[*problems])
    for key, description in chosen.items():
        opened.problems += preflight.says(key, options.streams[key], _open(network, key, description, opened))
    if options.others:
        meant = {one.uid for one in chosen.values()}
        for description in network.visible():
            if description.uid not in meant and preflight.recordable(description):
                try:
                    inlet = network.open(description)
                    opened.inlets[_free(description.name, opened.inlets)] = inlet
                except Lost as error:
                    opened.left_out[description.name] = str(error)
    _look(opened, clock, wait, options.look_s)
    # One look at the network may miss a stream that is there: a twin may be seen only by now.
    known = {one.stream for one in problems}
    later = preflight.choose(options.streams, network.visible())[1]
    opened.problems += [one for one in later if one.kind == "doubled" and one.stream not in known]
    for key, look in opened.looks.items():
        if key in options.streams:
            opened.problems += preflight.comes(key, options.streams[key], look, options)
    return opened


def _found(
    network: Network, clock: Clock, wait: Wait, declared: Mapping[str, Declared], wait_s: float
) -> tuple[dict[str, Description], list[Problem]]:
    end = clock() + wait_s
    while True:
        chosen, problems = preflight.choose(declared, network.visible())
        # One that is doubled does not become less by waiting.
        if not any(one.kind == "missing" for one in problems) or clock() >= end:
            return chosen, problems
        wait(_LOOK_AGAIN_S)


def _open(network: Network, key: str, description: Description, opened: Opened) -> Description:
    try:
        opened.inlets[key] = network.open(description)
    except Lost as error:
        opened.problems.append(
            Problem(
                "no connection",
                key,
                f"{description.name!r}: {error}",
                f"let the ports of LSL through ({PORTS}), or record on the machine that sends",
            )
        )
        return description
    return opened.inlets[key].description


def _free(name: str, taken: Mapping[str, Inlet]) -> str:
    number, free = 1, name
    while free in taken:
        number += 1
        free = f"{name}#{number}"
    return free


def _look(opened: Opened, clock: Clock, wait: Wait, seconds: float) -> None:
    """Pull for some seconds; what had waited before is no measure of how the samples come."""
    for inlet in opened.inlets.values():
        with contextlib.suppress(Lost):
            inlet.pull()
    begin = clock()
    came: dict[str, list[Samples]] = {key: [] for key in opened.inlets}
    while (passed := clock() - begin) < seconds:
        wait(STEP_S)
        for key, inlet in opened.inlets.items():
            with contextlib.suppress(Lost):
                came[key].append(inlet.pull())
    for key, pieces in came.items():
        about, full = opened.inlets[key].description, [one for one in pieces if len(one)]
        stamps = np.concatenate([one.stamps for one in full] or [np.zeros(0)])
        numbers = [np.asarray(one.values) for one in full] if about.channel_format != "string" else []
        opened.looks[key] = Look(about, passed, stamps, np.concatenate(numbers) if numbers else None)


def refuse(problems: list[Problem]) -> None:
    """Refuse to record.

    Raises:
        HardwareError: There is a problem; all of them are named.
    """
    if problems:
        raise HardwareError(
            f"nothing is recorded: {len(problems)} problem{'s' * (len(problems) > 1)} with the streams\n"
            + "\n".join(f"  - {one}" for one in problems),
            cure="mend each of them; 'hrcneuro record --check' looks again and records nothing",
        )
