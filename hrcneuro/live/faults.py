"""What goes wrong with an amplifier, on demand: ``KIND[=VALUE][@SECONDS]``, as ``hrcneuro amp --fault`` takes it."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from hrcneuro.errors import ConfigError, did_you_mean

# Kind: least and greatest value, the value without one, what it does.
KINDS = {
    "delay": (0.0, 10.0, 0.037, "stamp every sample this many seconds late, as a driver does that stamps on arrival"),
    "drift": (-1000.0, 1000.0, 50.0, "let the amplifier's clock run faster by this many parts in a million"),
    "jitter": (0.0, 1.0, 0.005, "stamp chunks early and late by chance around the delay, with this SD in seconds"),
    "drop": (0.0, 3600.0, 0.1, "lose the samples of this many seconds"),
    "stall": (0.0, 3600.0, 2.0, "hold back everything for this many seconds, then send it"),
    "reconnect": (0.0, 3600.0, 2.0, "vanish, and come back after this many seconds, without what was meanwhile"),
    "end": (1.0, 1.0, 1.0, "vanish for good"),
    "flat": (1.0, 1024.0, 1.0, "make so many channels flat, the first ones"),
    "labels": (1.0, 1.0, 1.0, "name the channels 1, 2, 3 …"),
    "volts": (1.0, 1.0, 1.0, "state and send volts"),
    "rate": (1.0, 100000.0, 500.0, "state this sampling rate, and send at the true one"),
    "stuck": (1.0, 1.0, 1.0, "be there and send nothing"),
    "twin": (1.0, 1.0, 1.0, "let a second stream of the same name and type be there"),
}
AT_START = ("delay", "drift", "jitter", "flat", "labels", "volts", "rate", "stuck", "twin")
"""Those that hold from the start, and take no time."""


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong.

    Attributes:
        kind: As :data:`KINDS` explains it.
        value: Of the kind.
        at: When it begins, seconds after the start.
    """

    kind: str
    value: float
    at: float = 0.0


def parse(text: str) -> Fault:
    """Return the fault that a text writes.

    Raises:
        ConfigError: No such fault, a value out of its range, or a time where there can be none.
    """
    rest, timed, at = text.partition("@")
    kind, _, value = rest.partition("=")
    cure = "write KIND, KIND=VALUE or KIND=VALUE@SECONDS; docs/recording.md lists them"
    if kind not in KINDS:
        raise ConfigError(f"no fault {kind!r}{did_you_mean(kind, KINDS)}; faults are {', '.join(KINDS)}", cure=cure)
    least, most, usual, _ = KINDS[kind]
    try:
        fault = Fault(kind, float(value) if value else usual, float(at) if timed else 0.0)
    except ValueError:
        raise ConfigError(f"fault {text!r}: value and time are numbers", cure=cure) from None
    if not least <= fault.value <= most or not (isfinite(fault.at) and fault.at >= 0):
        raise ConfigError(
            f"fault {text!r}: the value lies in {least:g} … {most:g}, the time is not negative", cure=cure
        )
    if timed and kind in AT_START:
        raise ConfigError(f"fault {text!r}: {kind} holds from the start and takes no time", cure=f"write {rest}")
    return fault
