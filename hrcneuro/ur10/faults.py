"""Faults on demand: what goes wrong with the robot, its network or its panel, at a time or on command.

A fault is written KIND[=VALUE][@SECONDS]: ``protective_stop@5``, ``drop=0.2``, ``latency=0.05``, ``slider=0.5@3``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from hrcneuro.errors import ConfigError, did_you_mean
from hrcneuro.ur10.controller import Controller

# Kind: least and greatest value, the value without one, what it does.
KINDS = {
    "protective_stop": (1.0, 1.0, 1.0, "trigger a protective stop"),
    "emergency_stop": (0.0, 1.0, 1.0, "press (1) or release (0) the emergency stop"),
    "safeguard_stop": (0.0, 1.0, 1.0, "open (1) or close (0) the safeguard input"),
    "slider": (0.0, 1.0, 0.5, "set the speed slider"),
    "drop": (0.0, 1.0, 0.1, "leave out this share of the data packets"),
    "silence": (0.0, 3600.0, 0.1, "send no data packets for this many seconds"),
    "latency": (0.0, 10.0, 0.05, "send everything this many seconds late"),
    "cut": (1.0, 1.0, 1.0, "cut every connection"),
}


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong: its kind and value, as :data:`KINDS` explains them, and when."""

    kind: str
    value: float
    at: float = 0.0  # s since the controller's start


def parse(text: str) -> Fault:
    """Return the fault that ``text`` writes.

    Raises:
        ConfigError: No such fault, or a value out of its range.
    """
    rest, _, at = text.partition("@")
    kind, _, value = rest.partition("=")
    if kind not in KINDS:
        raise ConfigError(
            f"no fault {kind!r}{did_you_mean(kind, KINDS)}; faults are {', '.join(KINDS)}",
            cure="write KIND, KIND=VALUE or KIND=VALUE@SECONDS",
        )
    least, most, usual, _ = KINDS[kind]
    try:
        fault = Fault(kind, float(value) if value else usual, float(at) if at else 0.0)
    except ValueError:
        raise ConfigError(f"fault {text!r}: not a number", cure="write KIND=VALUE@SECONDS") from None
    if not least <= fault.value <= most or not (isfinite(fault.at) and fault.at >= 0.0):
        raise ConfigError(f"fault {text!r}: the value lies in {least:g} … {most:g}, the time is not negative")
    return fault


class Network:
    """What the faults do to the packets."""

    def __init__(self) -> None:
        self.drop = self.latency = 0.0
        self.silent_until = -1.0
        self.cut = False
        self._debt = 0.0

    def loses(self, now: float) -> bool:
        """Return whether this cycle's data packets get lost: evenly spread, so that a test can be repeated."""
        self._debt += self.drop
        if self._debt >= 1.0 - 1e-9:
            self._debt -= 1.0
            return True
        return now < self.silent_until


class Schedule:
    """Brings faults about when they are due."""

    def __init__(self, controller: Controller, network: Network, faults: Sequence[Fault] = ()) -> None:
        """Keep ``faults`` in the order in which they come about."""
        self._c, self._network = controller, network
        self._waiting = sorted(faults, key=lambda f: f.at)

    def cycle(self) -> None:
        """Bring about what is due."""
        while self._waiting and self._waiting[0].at <= self._c.now:
            self.apply(self._waiting.pop(0))

    def apply(self, fault: Fault) -> None:
        """Bring a fault about in the controller or on the network."""
        c, network, value = self._c, self._network, fault.value
        if fault.kind == "protective_stop":
            c.protective_stop("asked for as a fault")
        elif fault.kind == "emergency_stop":
            c.emergency_stop(value > 0.0)
        elif fault.kind == "safeguard_stop":
            c.safeguard_stop(value > 0.0)
        elif fault.kind == "slider":
            c.slider = value
        elif fault.kind == "silence":
            network.silent_until = c.now + value
        elif fault.kind == "cut":
            network.cut = True
        else:
            setattr(network, fault.kind, value)
