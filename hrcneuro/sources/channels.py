"""Channels of a foreign recording: which to keep, what to call them, what they are, and where they sit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.errors import ConfigError, did_you_mean
from hrcneuro.sources.recording import Recording

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

    Args:
        recording: As its file has it.
        rename: Name in the file -> name here.
        types: Name here -> type. Without it a channel whose name contains ``EOG`` is taken for one.
        drop: Names in the file of channels to leave out.
        bads: Names here of channels that are bad, beside those that the file marks.
        montage: ``auto`` (the file's positions, else the 10-05 system's by name), ``none``, or a montage of MNE.
        unit: Unit in which the file's numbers stand; empty to believe the file.

    Raises:
        ConfigError: A map names a channel or montage that there is not, or two channels get one name.
    """
    _drop(recording, drop)
    _merge_copies(recording)
    _rename(recording, rename)
    _retype(recording, types)
    require(bads, recording.ch_names, "acquire.bads")
    recording.bads = list(dict.fromkeys([*recording.bads, *bads]))
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


def require(names: Iterable[str], have: list[str], option: str) -> None:
    """Refuse names of channels that a recording does not have.

    Raises:
        ConfigError: Names every unknown channel, the nearest spelling and what there is.
    """
    unknown = [name for name in names if name not in have]
    if unknown:
        listed = ", ".join(f"{name!r}{did_you_mean(name, have)}" for name in unknown)
        raise ConfigError(
            f"{option} names {'channels' if len(unknown) > 1 else 'a channel'} that the recording does not have: "
            f"{listed}; it has {', '.join(have)}",
            cure=f"correct {option}; hrcneuro acquire SUBJECT --inspect lists the channels",
        )


def _drop(recording: Recording, names: tuple[str, ...]) -> None:
    require(names, recording.ch_names, "acquire.drop")
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


def _rename(recording: Recording, mapping: Mapping[str, str]) -> None:
    require(mapping, recording.ch_names, "acquire.channel_map")
    names = [mapping.get(name, name) for name in recording.ch_names]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ConfigError(
            f"acquire.channel_map gives several channels the same name: {', '.join(twice)}",
            cure="give each channel a name of its own",
        )
    if recording.montage is not None:
        known = {old: new for old, new in mapping.items() if old in recording.montage.ch_names}
        recording.montage.rename_channels(known)
    recording.ch_names = names
    recording.file_names = {new: old for old, new in mapping.items() if new != old}
    recording.bads = [mapping.get(name, name) for name in recording.bads]


def _retype(recording: Recording, types: Mapping[str, str]) -> None:
    require(types, recording.ch_names, "acquire.channel_types")
    for i, name in enumerate(recording.ch_names):
        if name in types:
            recording.ch_types[i] = types[name]
        elif recording.ch_types[i] == "eeg" and "EOG" in name.upper():
            recording.ch_types[i] = "eog"
            recording.notes.append(f"channel {name} taken for EOG by its name")


def _rescale(recording: Recording, unit: str) -> None:
    believed = recording.units or ["V"] * len(recording.ch_names)
    for i, kind in enumerate(recording.ch_types):
        if kind != "stim":
            recording.data[i] *= VOLTS[unit] / VOLTS.get(believed[i], 1.0)


def _position(recording: Recording, montage: str) -> None:
    if montage == "none":
        recording.montage = None
    elif montage == "auto":
        own = _own_positions(recording)
        recording.montage = own if own is not None else standard_montage()
    else:
        recording.montage = _named_montage(montage)


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
