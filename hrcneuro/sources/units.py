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
    return plain not in _NO_WORD and voltage_unit(text) is None and not plain.endswith("v")
