"""What a channel's label and unit say of it: its type, and the site of its electrode.

Labels of the form ``EEG Fp1-Ref`` are those of EDF's standard texts (Kemp & Olivan 2003); the words for other signals
are the ones that amplifiers and clinics write.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence

_WORDS = {
    "eog": "EOG VEOG HEOG LEOG REOG VEO HEO LOC ROC",
    "ecg": "ECG EKG",
    "emg": "EMG CHIN SUBMENTAL MENTALIS MASSETER TIBIALIS TIB LAT RAT LEG LEGS LLEG RLEG PLM PLML PLMR",
    "misc": (
        "RESP RESPIRATION RSP BREATH BELT THOR THORAX THORACIC CHEST ABD ABDO ABDOMEN ABDOMINAL FLOW AIRFLOW NASAL "
        "ORONASAL CANNULA SNORE SAO2 SPO2 O2SAT SAT OSAT PULSE PULS PLETH PLET PPG BVP HR BPM RATE IBI CO2 ETCO2 PCO2 "
        "TEMP TEMPERATURE GSR EDA SCR SCL SKIN ERG ACC ACCEL ACCX ACCY ACCZ GYRO GYROX GYROY GYROZ MAG ACTIVITY "
        "POSITION LIGHT LUX PHOTO PHOTIC PHOTODIODE MIC AUDIO SOUND AUX DC BURSTS SUPPR BATTERY BATT IMPEDANCE "
        "COUNTER PACKET TIMESTAMP POS BODYPOS THERM THERMISTOR PTAF PRESSURE CPAP PAP LEAK EFFORT RIP DHR PTT STAGE"
    ),
    "stim": "STI STIM TRIG TRIGGER TRIGGERS STATUS EVENT EVENTS MARKER MARKERS",
}
_KIND = {word: kind for kind, words in _WORDS.items() for word in words.split()}
# A bipolar pair of muscles or eyes may be labelled after both words; the first type in this order wins.
_ORDER = ("eog", "ecg", "emg", "stim", "misc")
_REFERENCE_WORDS = (
    "REF REFERENCE LE RE AR AVG AVE AV AVERAGE CAR CAV A1 A2 M1 M2 A1A2 A1+A2 A1/A2 M1M2 M1+M2 M1/M2 LM RM EAR EARS"
)
_REFERENCES = frozenset(_REFERENCE_WORDS.split())
_SPARE = re.compile(r"(EXG|BIP) ?\d+", re.IGNORECASE)
_PREFIX = re.compile(r"^EEG[\s_:-]+", re.IGNORECASE)


def kind_of(label: str) -> str:
    """Return the type that a label's words name: eog, ecg, emg, stim or misc; empty where they name none."""
    # Letters and digits part company at the end of a word: ECG1, EOG3, RESP2; SaO2 and CO2 are words themselves.
    words = [word for word in re.split(r"[^A-Z0-9]+", label.upper()) if word]
    kinds = {_KIND.get(word) or _KIND.get(word.rstrip("0123456789")) for word in words}
    kinds |= {"eog"} if "EOG" in label.upper() else set()
    return next((kind for kind in _ORDER if kind in kinds), "")


def is_spare(label: str) -> bool:
    """Return whether a label is that of an input for any electrode: BioSemi's EXG1 …, ANT's BIP1 …"""
    return bool(_SPARE.fullmatch(label.strip()))


def eyes(names: Sequence[str]) -> set[str]:
    """Return the labels of sleep recordings' eye channels, ``E1-M2`` and ``E2``; in a net E1 is one of many."""
    first = {name: (_pair(name) or (_bare(name), ""))[0].upper() for name in names}
    if any(re.fullmatch(r"E\d+", one) and one not in ("E1", "E2") for one in first.values()):
        return set()
    return {name for name, one in first.items() if one in ("E1", "E2")}


def sites(names: Sequence[str], kinds: Sequence[str], known: Collection[str]) -> dict[str, str]:
    """Return label -> site for EEG channels whose label has more about it than the site's name.

    ``EEG Fp1-Ref`` -> ``Fp1``; also a mastoid or earlobe as reference (``C3-A2``), one electrode that is the reference
    of at least three channels (``Fp1-Cz``, ``F3-Cz``, ``C3-Cz``), dots and blanks (``Cz..``). A label stays as it is
    where another channel would get the same name.

    Args:
        names, kinds: The channels' labels and types.
        known: Names of sites.
    """
    places = {site.lower() for site in known}
    partners = Counter(pair[1] for name in names if (pair := _pair(name)) and pair[0].lower() in places)
    short = {}
    for name, kind in zip(names, kinds, strict=True):
        if kind != "eeg" or kind_of(name):
            continue
        site, partner = _pair(name) or (_bare(name), "")
        is_reference = partner.upper() in _REFERENCES or not partner or partners[partner] >= 3
        if is_reference and site.lower() in places and site != name:
            short[name] = site
    wanted = Counter(short.get(name, name).strip().lower() for name in names)
    return {name: site for name, site in short.items() if wanted[site.lower()] == 1}


def bipolar(names: Sequence[str], known: Collection[str]) -> list[str]:
    """Return the labels of channels between two electrodes: they have no position."""
    places = {site.lower() for site in known}
    pairs = {name: _pair(name) for name in names}
    return [name for name, pair in pairs.items() if pair and all(one.lower() in places for one in pair)]


def twins(names: Sequence[str]) -> list[list[str]]:
    """Return the groups of names that differ in case, blanks or a running number only."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(re.sub(r"-\d+$", "", name.strip()).lower(), []).append(name)
    return [group for group in groups.values() if len(group) > 1]


def match(names: Sequence[str], places: Mapping[str, object]) -> dict[str, str]:
    """Return channel -> name of its place: the same name, else the same but for case where it is the only one so."""
    exact = {name: name for name in names if name in places}
    lower: dict[str, list[str]] = {}
    for place in places:
        lower.setdefault(place.lower(), []).append(place)
    rest = Counter(name.lower() for name in names)
    loose = {
        name: lower[name.lower()][0]
        for name in names
        if name not in exact and rest[name.lower()] == 1 and len(lower.get(name.lower(), [])) == 1
    }
    return exact | loose


def _bare(name: str) -> str:
    return re.sub(r"-\d+$", "", _PREFIX.sub("", name.strip())).rstrip(". ")


def _pair(name: str) -> tuple[str, str] | None:
    """Return the two sides of a label ``A-B``."""
    before, dash, after = _bare(name).partition("-")
    return (before.strip(), after.strip()) if dash and before.strip() and after.strip() else None
