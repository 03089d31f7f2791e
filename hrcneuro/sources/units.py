"""Units as files spell them."""

from __future__ import annotations

import re
import unicodedata

_MICRO_AS_BROKEN = str.maketrans({"µ": "u", "μ": "u", "\ufffd": "u"})
_SPELLINGS = {
    "uv": "uV", "muv": "uV", "microv": "uV", "microvolt": "uV", "microvolts": "uV", "-6": "uV",
    "mv": "mV", "milliv": "mV", "millivolt": "mV", "millivolts": "mV", "-3": "mV",
    "nv": "nV", "nanov": "nV", "nanovolt": "nV", "nanovolts": "nV", "-9": "nV",
    "v": "V", "volt": "V", "volts": "V", "0": "V",
}  # fmt: skip


def voltage_unit(text: str) -> str | None:
    """Return ``V``, ``mV``, ``uV`` or ``nV`` for a unit in any usual spelling, None where it is no voltage.

    The sign of a millionth may be the micro sign, the Greek letter, a ``u``, or either of the first two read in a wrong
    code page. A power of ten (``-6``) counts as that of a volt, as in streams of MNE-LSL.
    """
    plain = re.sub(r"[\s\[\]()]", "", unicodedata.normalize("NFC", text)).replace("Â", "").replace("Î¼", "u")
    return _SPELLINGS.get(plain.translate(_MICRO_AS_BROKEN).lower())
