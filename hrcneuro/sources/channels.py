"""Channels of a foreign recording: which to keep, what to call them, what they are, and where they sit."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.errors import ConfigError, DataError, did_you_mean
from hrcneuro.sources import labels
from hrcneuro.sources.recording import Recording, some
from hrcneuro.sources.units import is_no_voltage

if TYPE_CHECKING:
    import mne

VOLTS = {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "nV": 1e-9}


def shape(
    recording: Recording,
    *,
    rename: Mapping[str, str],
    types: Mapping[str, str],
    drop: tuple[str, ...],
    bads: tuple[str, ...],
    montage: str,
    unit: str,
) -> None:
    """Apply a study's channel options to a recording, in place.

    A label with more about it than the site's name gets shorter (``EEG Fp1-Ref`` -> ``Fp1``); options may name a
    channel by either.

    Args:
        recording: As its file has it.
        rename: Name in the file -> name here.
        types: Name here -> type. Without it an EEG channel whose label or unit is that of another signal gets its type.
        drop: Names in the file of channels to leave out.
        bads: Names here of channels that are bad, beside those that the file marks.
        montage: ``auto`` (the file's positions, else the 10-05 system's by name), ``none``, or a montage of MNE.
        unit: Unit in which the file's numbers stand; empty to believe the file.

    Raises:
        ConfigError: An option misspells a channel, there is no such montage, or two channels get one name.
        DataError: Two channels have one name in the file.
    """
    sites = labels.sites(recording.ch_names, recording.ch_types, standard_sites())
    in_file = {site: label for label, site in sites.items() if site not in recording.ch_names}
    _drop(recording, tuple(in_file.get(name, name) for name in drop))
    _merge_copies(recording)
    _shorten_and_rename(recording, {in_file.get(name, name): new for name, new in rename.items()})
    here = {old: new for new, old in recording.file_names.items()}
    _retype(recording, {here.get(name, name): kind for name, kind in types.items()})
    bads = tuple(here.get(name, name) for name in bads)
    look_for(bads, recording, "acquire.bads")
    recording.bads = list(dict.fromkeys([*recording.bads, *(name for name in bads if name in recording.ch_names)]))
    _tell_names(recording)
    if unit:
        _rescale(recording, unit)
    _position(recording, montage)


def without_position(raw: mne.io.BaseRaw) -> list[str]:
    """Return the EEG channels of a recording whose position is not known."""
    import mne

    picks = mne.pick_types(raw.info, eeg=True, exclude=())
    locs = np.array([raw.info["chs"][i]["loc"][:3] for i in picks]).reshape(-1, 3)
    lost = ~np.isfinite(locs).all(axis=1) | ~np.any(locs, axis=1)
    return [raw.ch_names[i] for i, one in zip(picks, lost, strict=True) if one]


def look_for(names: Iterable[str], recording: Recording, option: str) -> None:
    """Warn of names of channels that a recording does not have: others of the study may have them.

    Raises:
        ConfigError: A name is a misspelling of a channel that is there; names it and what there is.
    """
    have, names = recording.ch_names, list(names)
    absent = [name for name in names if name not in have]
    spare = [name for name in have if name not in names]
    for name in absent:
        meant = [one for one in spare if misspelt(name, one)]
        if meant:
            raise ConfigError(
                f"{option} names a channel that the recording does not have: {name!r}{did_you_mean(meant[0], meant)}; "
                f"it has {', '.join(have)}",
                cure=f"correct {option}; where a subject's names differ, give it options of its own under "
                "[acquire.subjects.SUBJECT]; hrcneuro acquire SUBJECT --inspect lists the channels",
            )
    if absent:
        listed = ", ".join(f"{name!r}{did_you_mean(name, spare)}" for name in absent)
        recording.warnings.append(f"{option} names what the recording does not have: {listed}")


def misspelt(name: str, other: str) -> bool:
    """Return whether two names are one channel's by their letters.

    They are where they differ in case, blanks and signs alone, and where one has a letter or its only number more or
    two letters are swapped. Another letter or number is another channel, and so are two places of the 10-05 system:
    ``VEOG`` is not ``HEOG``, ``A1`` not ``A11``, ``AF7`` not ``F7``.
    """
    one, two = (re.sub(r"[^a-z0-9]", "", text.lower()) for text in (name, other))
    if one == two:
        return True
    numbers = {re.sub(r"\D", "", text) for text in (one, two)} - {""}
    if len(numbers) > 1 or {one, two} <= {place.lower() for place in standard_sites()}:
        return False
    short, long = sorted((one, two), key=len)
    if len(long) - len(short) == 1:
        return len(short) > 1 and any(long[:i] + long[i + 1 :] == short for i in range(len(long)))
    return any(one[:i] + one[i + 1 : i + 2] + one[i] + one[i + 2 :] == two for i in range(len(one) - 1))


def _drop(recording: Recording, names: tuple[str, ...]) -> None:
    look_for(names, recording, "acquire.drop")
    recording.keep([i for i, name in enumerate(recording.ch_names) if name not in names])


def _merge_copies(recording: Recording) -> None:
    """Leave out channels that repeat another's label and its samples: they would make a regression singular."""
    first: dict[str, int] = {}
    copies = []
    for i, name in enumerate(recording.ch_names):
        stem, dash, number = name.rpartition("-")
        if not (dash and number.isdigit()):
            continue
        if stem in first and np.array_equal(recording.data[i], recording.data[first[stem]]):
            copies.append(i)
        first.setdefault(stem, i)
    if copies:
        names = [recording.ch_names[i] for i in copies]
        recording.keep([i for i in range(len(recording.ch_names)) if i not in copies])
        recording.notes.append(f"channels that repeat another's label and samples left out: {', '.join(names)}")


def _shorten_and_rename(recording: Recording, rename: Mapping[str, str]) -> None:
    """Give channels the names of the map, and the others that of their site, unless another channel has it."""
    sites = labels.sites(recording.ch_names, recording.ch_types, standard_sites())
    given = {name.lower() for name in rename.values()}
    sites = {label: site for label, site in sites.items() if label not in rename and site.lower() not in given}
    _rename(recording, sites | dict(rename))
    recording.shortened = frozenset(sites.values())
    if sites:
        listed = [f"{label!r} -> {site}" for label, site in sites.items()]
        recording.notes.append(f"labels shortened to the electrode's site: {some(listed)}")


def _rename(recording: Recording, mapping: Mapping[str, str]) -> None:
    look_for(mapping, recording, "acquire.channel_map")
    names = [mapping.get(name, name) for name in recording.ch_names]
    twice = sorted({name for name in names if names.count(name) > 1})
    if of_map := [name for name in twice if name in mapping.values()]:
        raise ConfigError(
            f"acquire.channel_map gives several channels the same name: {', '.join(of_map)}",
            cure="give each channel a name of its own",
        )
    if twice:
        raise DataError(
            f"the recording has several channels of the same name: {', '.join(twice)}",
            cure="give each a name of its own in the file; options cannot tell them apart",
        )
    if recording.montage is not None:
        known = {old: new for old, new in mapping.items() if old in recording.montage.ch_names}
        recording.montage.rename_channels(known)
    recording.ch_names = names
    recording.file_names = {new: old for old, new in mapping.items() if new != old and new in names}
    recording.bads = [mapping.get(name, name) for name in recording.bads]


def _retype(recording: Recording, types: Mapping[str, str]) -> None:
    """Give channels their types: those of the map, else what an EEG channel's label or unit says it is."""
    look_for(types, recording, "acquire.channel_types")
    said: dict[tuple[str, str], list[str]] = {}
    for i, name in enumerate(recording.ch_names):
        kind, why = types.get(name, ""), ""
        if not kind and recording.ch_types[i] == "eeg":
            kind, why = _by_label_or_unit(recording, i)
        if not kind:
            continue
        if kind == "stim" != recording.ch_types[i] and recording.units:
            # A trigger channel holds the file's numbers: codes are no volts.
            recording.data[i] /= VOLTS.get(recording.units[i], 1.0)
        recording.ch_types[i] = kind
        if why:
            said.setdefault((kind, why), []).append(name)
    recording.notes += [
        f"taken for {kind.upper()}, not EEG, by the {why}: {some(names)}" for (kind, why), names in said.items()
    ]


def _by_label_or_unit(recording: Recording, i: int) -> tuple[str, str]:
    name, unit = recording.ch_names[i], recording.units[i] if recording.units else ""
    label = recording.file_names.get(name, name)
    for text in (name, label):
        if kind := labels.kind_of(text):
            return kind, "label"
    if label in labels.eyes([recording.file_names.get(one, one) for one in recording.ch_names]):
        return "eog", "label"
    return ("misc", f"unit {unit}") if is_no_voltage(unit) else ("", "")


def _tell_names(recording: Recording) -> None:
    """Note EEG channels that cannot be placed by their names: pairs of electrodes, and several of one name."""
    eeg = [recording.ch_names[i] for i in recording.picks("eeg")]
    if pairs := labels.bipolar(eeg, standard_sites()):
        recording.notes.append(f"channels between two electrodes, without a position of their own: {some(pairs)}")
    if spare := [name for name in eeg if labels.is_spare(name)]:
        recording.notes.append(
            f"inputs for anything, taken for EEG until acquire.channel_types says what they are: {some(spare)}"
        )
    for group in labels.twins(eeg):
        recording.notes.append(
            f"channels of one name but for case, blanks or number: {', '.join(map(repr, group))}; "
            "acquire.drop or acquire.channel_map tells them apart"
        )


def _rescale(recording: Recording, unit: str) -> None:
    believed = recording.units or ["V"] * len(recording.ch_names)
    for i, kind in enumerate(recording.ch_types):
        if kind != "stim" and not is_no_voltage(believed[i]):
            recording.data[i] *= VOLTS[unit] / VOLTS.get(believed[i], 1.0)


def _position(recording: Recording, montage: str) -> None:
    if montage == "none":
        recording.montage = None
    elif montage == "auto":
        own = _own_positions(recording)
        recording.montage = own if own is not None else _by_name(recording, standard_montage())
    else:
        recording.montage = _by_name(recording, _named_montage(montage))


def _by_name(recording: Recording, montage: mne.channels.DigMontage) -> mne.channels.DigMontage:
    """Return a montage whose names are those of the recording where they differ in case only."""
    eeg = [recording.ch_names[i] for i in recording.picks("eeg")]
    places = labels.match(eeg, montage.get_positions()["ch_pos"])
    return montage.copy().rename_channels({place: name for name, place in places.items() if name != place})


def _own_positions(recording: Recording) -> mne.channels.DigMontage | None:
    """Return the file's positions of the EEG channels, or None where it has none."""
    import mne

    if recording.montage is None:
        return None
    known = recording.montage.get_positions()
    eeg = {recording.ch_names[i] for i in recording.picks("eeg")}
    places = {
        name: place
        for name, place in (known["ch_pos"] or {}).items()
        if name in eeg and np.isfinite(place).all() and np.any(place)
    }
    if not places:
        return None
    marks = {name: known[name] for name in ("nasion", "lpa", "rpa")}
    return mne.channels.make_dig_montage(places, coord_frame=known["coord_frame"], **marks)


def standard_montage() -> mne.channels.DigMontage:
    """Return the positions of the 10-05 system on MNE's template head."""
    return _named_montage("standard_1005")


@functools.cache
def standard_sites() -> tuple[str, ...]:
    """Return the names of the 10-05 system; kept, since making the montage for them takes 10 ms each time."""
    return tuple(standard_montage().ch_names)


def _named_montage(name: str) -> mne.channels.DigMontage:
    import mne

    known = mne.channels.get_builtin_montages()
    # MNE 1.13 renamed its template's montages; both names are taken, whichever MNE is installed.
    pairs = (("standard_", "colin27_"), ("colin27_", "standard_"))
    name = next((new for a, b in pairs if name not in known and (new := name.replace(a, b)) in known), name)
    if name not in known:
        raise ConfigError(
            f"acquire.montage = {name!r}{did_you_mean(name, known)}; allowed: auto, none, {', '.join(known)}",
            cure="correct acquire.montage",
        )
    return mne.channels.make_standard_montage(name)
