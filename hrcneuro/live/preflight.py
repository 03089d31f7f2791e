"""Whether the streams that a recording needs are there and as they should be, before it begins."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hrcneuro.live.parameters import Declared, RecordOptions
from hrcneuro.live.transport import TRUTH, Description

_WAVER_S = 0.01
_MICROVOLTS = ("microvolts", "microvolt", "uv", "µv", "μv")
_SCALE = {**dict.fromkeys(_MICROVOLTS, 1.0), "millivolts": 1e3, "mv": 1e3, "volts": 1e6, "v": 1e6, "nanovolts": 1e-3}


@dataclass(frozen=True)
class Problem:
    """Why a recording does not begin.

    Attributes:
        kind: ``missing``, ``doubled``, ``other rate``, ``other channels``, ``other unit``, ``no connection``,
            ``not moving``, ``flat`` or ``railed``.
        stream: Its name in the configuration.
        text: What was asked for and what was got.
        cure: What a person can do.
    """

    kind: str
    stream: str
    text: str
    cure: str

    def __str__(self) -> str:
        return f"{self.stream}: {self.kind}: {self.text}\n    cure: {self.cure}"


@dataclass(frozen=True)
class Look:
    """What came of a stream within a few seconds.

    Attributes:
        description: What it says of itself.
        seconds: How long it was looked at.
        stamps: ndarray, shape (n_samples,), seconds of the sender's clock.
        values: ndarray, shape (n_samples, n_channels), of the stream's unit; none from a stream of texts.
    """

    description: Description
    seconds: float
    stamps: np.ndarray
    values: np.ndarray | None


def fits(declared: Declared, description: Description) -> bool:
    """Return whether a stream has the name, type and source id that are asked for."""
    wanted = ((declared.name, description.name), (declared.type, description.type))
    named = all(not want or fnmatch.fnmatchcase(got, want) for want, got in wanted)
    return named and description.source_id == (declared.source_id or description.source_id)


def recordable(description: Description) -> bool:
    """Return whether a stream may be recorded: what a simulated person knows is for its amplifier alone."""
    return description.name != TRUTH


def choose(
    declared: Mapping[str, Declared], visible: Sequence[Description]
) -> tuple[dict[str, Description], list[Problem]]:
    """Return the stream for each declared one, and what stands against that."""
    chosen, problems = {}, []
    for key, want in declared.items():
        there = [one for one in visible if fits(want, one) and recordable(one)]
        if len(there) == 1:
            chosen[key] = there[0]
        elif there:
            problems.append(_doubled(key, want, there))
        else:
            problems.append(_missing(key, want, visible))
    return chosen, problems


def _missing(key: str, want: Declared, visible: Sequence[Description]) -> Problem:
    seen = ", ".join(f"{one.name!r} ({one.type})" for one in visible if recordable(one)) or "none"
    return Problem(
        "missing",
        key,
        f"no stream of {want.in_words}; streams that are seen: {seen}",
        "start what sends it; where it runs on another machine, see that both are in one network and that no firewall "
        f"stands between; if it has another name, say so: record.streams.{key}.name",
    )


def _doubled(key: str, want: Declared, there: Sequence[Description]) -> Problem:
    listed = ", ".join(f"{one.name!r} (source id {one.source_id!r})" for one in there)
    return Problem(
        "doubled",
        key,
        f"{len(there)} streams of {want.in_words}: {listed}",
        f"end those that are not meant, or tell them apart: record.streams.{key}.name or .source_id",
    )


def says(key: str, want: Declared, got: Description) -> Iterator[Problem]:
    """Yield where a stream says of itself other than what is asked for."""
    if want.sfreq is not None and got.sfreq != want.sfreq:
        yield Problem(
            "other rate",
            key,
            f"{got.name!r} states {got.sfreq:g} Hz; {want.sfreq:g} Hz are asked for",
            f"set the rate at the amplifier, or record.streams.{key}.sfreq",
        )
    if want.n_channels and got.n_channels != want.n_channels:
        yield _channels(key, f"{got.name!r} has {got.n_channels} channels; {want.n_channels} are asked for")
    if want.channels and got.labels != want.channels:
        absent = [label for label in want.channels if label not in got.labels]
        spare = [label for label in got.labels if label not in want.channels]
        told = [f"lacks {', '.join(absent)}"] * bool(absent) + [f"has also {', '.join(spare)}"] * bool(spare)
        yield _channels(key, f"{got.name!r} {' and '.join(told) or 'has them in another order'}")
    # A trigger channel has no unit, which it may say.
    units = sorted({unit for unit in got.units if unit.lower() not in ("", "none")}) or ["none"]
    if want.unit and not all(_same_unit(unit, want.unit) for unit in units):
        yield Problem(
            "other unit",
            key,
            f"{got.name!r} states {', '.join(units)}; {want.unit} is asked for",
            f"set the unit at the amplifier, or record.streams.{key}.unit",
        )


def _channels(key: str, text: str) -> Problem:
    cure = f"load the montage of this study at the amplifier, or set record.streams.{key}.channels and .n_channels"
    return Problem("other channels", key, text, cure)


def _same_unit(one: str, other: str) -> bool:
    a, b = one.lower(), other.lower()
    return a == b or (a in _SCALE and _SCALE.get(a) == _SCALE.get(b))


def comes(key: str, want: Declared, look: Look, options: RecordOptions) -> Iterator[Problem]:
    """Yield what is wrong with the samples of a regular stream."""
    name, sfreq = look.description.name, look.description.sfreq
    if not sfreq:
        return
    if len(look.stamps) < 2 or look.stamps[-1] <= look.stamps[0]:
        yield Problem(
            "not moving",
            key,
            f"{name!r} sent {len(look.stamps)} samples in {look.seconds:g} s",
            "start the acquisition at the amplifier",
        )
        return
    span = float(look.stamps[-1] - look.stamps[0])
    measured = 1 / float(np.polyfit(np.arange(len(look.stamps)), look.stamps, 1)[0])
    # Stamps waver by some milliseconds, which is much of a short look.
    if abs(measured / sfreq - 1) > options.rate_tolerance + _WAVER_S / span:
        yield Problem(
            "other rate",
            key,
            f"{name!r} states {sfreq:g} Hz and comes at {measured:.4g} Hz; {100 * options.rate_tolerance:g} % off are "
            "allowed (record.rate_tolerance)",
            "samples are lost on the way, or the sender states a wrong rate: see to its cable or radio link",
        )
    if look.values is not None and look.description.type.lower() == "eeg":
        yield from _channels_that_say_nothing(key, want, look, options)


def _channels_that_say_nothing(key: str, want: Declared, look: Look, options: RecordOptions) -> Iterator[Problem]:
    assert look.values is not None
    scale = scales(look.description)
    names = names_of(look.description)
    values = np.asarray(look.values, float) * scale
    allowed = {*want.flat, *(name for name, factor in zip(names, scale, strict=True) if factor == 0)}
    with np.errstate(invalid="ignore"):
        spread = values.std(axis=0)
    # What is no number is no signal either.
    flat = [n for n, sd in zip(names, spread, strict=True) if not sd >= options.flat_uv and n not in allowed]
    if flat:
        yield Problem(
            "flat",
            key,
            f"{len(flat)} of {len(names)} channels vary by less than {options.flat_uv:g} µV: {_listed(flat)}",
            f"see to these electrodes, reference and ground; those that are to be flat: record.streams.{key}.flat",
        )
    if options.rail_uv:
        most = np.abs(values).max(axis=0)
        railed = [name for name, peak in zip(names, most, strict=True) if peak >= options.rail_uv]
        if railed:
            yield Problem(
                "railed",
                key,
                f"{len(railed)} of {len(names)} channels reach {options.rail_uv:g} µV: {_listed(railed)}",
                "see to these electrodes, reference and ground",
            )


def scales(description: Description) -> np.ndarray:
    """Return what makes microvolts of each channel's numbers, shape (n_channels,); 0 where it is no voltage."""
    units = description.units or ("",) * description.n_channels
    return np.array([_SCALE.get(unit.lower(), 0.0) if unit else 1.0 for unit in units])


def names_of(description: Description) -> tuple[str, ...]:
    """Return the channels' labels; numbers where it names none."""
    return description.labels or tuple(str(i + 1) for i in range(description.n_channels))


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
