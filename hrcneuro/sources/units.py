"""Units as files spell them."""

from __future__ import annotations

import re
import unicodedata

# Also the letter's bytes in code pages 437, 850 and 1253, read as latin-1.
_MICRO_AS_BROKEN = str.maketrans({"µ": "u", "μ": "u", "\ufffd": "u", "æ": "u", "ì": "u"})
# EDF has room for eight letters: microvol.
_VOLTS = re.compile(r"(u|mu|micro|m|milli|n|nano|)v(?:ol|olt|olts)?")
_UNITS = {"u": "uV", "mu": "uV", "micro": "uV", "m": "mV", "milli": "mV", "n": "nV", "nano": "nV", "": "V"}
_POWERS = {"-6": "uV", "-3": "mV", "-9": "nV", "0": "V"}
_NO_WORD = frozenset(
    {"", "n/a", "na", "none", "unknown", "?", "-", "a.u.", "au", "adc", "raw", "count", "counts", "unit", "units"}
)
# SI's, and those that physiology uses beside them, without the letter of a power of ten; in small letters.
_QUANTITIES = (
    "% percent ratio 1 rad ° deg degree degrees °c c degc celsius k kelvin f °f hz bpm 1/min /min beats/min "
    "breaths/min s sec second seconds min h m g kg m/s m/s^2 m/s² m/s2 rad/s °/s deg/s dps n nm pa bar mmhg cmh2o "
    "s/m siemens mho ohm ohms ω a t gauss lx lux cd l ml l/s l/min lpm w j db dba mol px pixel pixels pxl sample "
    "samples bit bits byte bytes boolean bool code codes level levels index ticks arbitrary arb"
)
_OTHERS = frozenset(_QUANTITIES.split())
_TENTHS = ("", "f", "m", "u", "n", "p", "k", "c", "d", "h", "meg")


def voltage_unit(text: str) -> str | None:
    """Return ``V``, ``mV``, ``uV`` or ``nV`` for a unit in any usual spelling, None where it is no voltage.

    The sign of a millionth may be the micro sign, the Greek letter, a ``u``, or either of the first two read in a wrong
    code page. A power of ten (``-6``) counts as that of a volt, as in streams of MNE-LSL.
    """
    plain = re.sub(r"[\s\[\]()]", "", unicodedata.normalize("NFC", text)).replace("Â", "").replace("Î¼", "u")
    plain = plain.translate(_MICRO_AS_BROKEN).lower()
    hit = _VOLTS.fullmatch(plain)
    return _UNITS[hit[1]] if hit else _POWERS.get(plain)


def is_no_voltage(text: str) -> bool:
    """Return whether a unit is one of another quantity: per cent, degrees …; one that says nothing is not.

    Whatever ends in a V may be a volt whose first letter was read in a wrong code page.
    """
    plain = text.strip().lower()
    return not says_nothing(text) and voltage_unit(text) is None and not plain.endswith("v")


def says_nothing(text: str) -> bool:
    """Return whether a unit is a word for none: ``n/a``, ``a.u.``, counts."""
    return text.strip().lower() in _NO_WORD


def is_known_unit(text: str) -> bool:
    """Return whether a unit is a usual one of another quantity than voltage, with or without a power of ten."""
    plain = unicodedata.normalize("NFC", text).strip().translate(_MICRO_AS_BROKEN).lower()
    return any(plain.startswith(power) and plain.removeprefix(power) in _OTHERS for power in _TENTHS)
