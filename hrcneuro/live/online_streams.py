"""The streams of the closed loop: the EEG that a decoder serves, and the markers; found, held, and found again."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hrcneuro.decoding.frozen import FrozenDecoder
from hrcneuro.decoding.frozen_refusals import StreamError
from hrcneuro.errors import HardwareError
from hrcneuro.live import preflight
from hrcneuro.live.parameters import Declared, OnlineOptions
from hrcneuro.live.timeline import NOT_FINITE, RAILED
from hrcneuro.live.transport import PORTS, TRIGGER_TYPES, Clock, Description, Inlet, Lost, Network, Samples
from hrcneuro.live.watch import StreamWatch

_LOOK_AGAIN_S = 0.5
_STALL_S = 1.0
_PIECE_S = 0.5
_LOOK_S, _MEASURE_S, _STEP_S = 1.0, 5.0, 0.05


@dataclass
class Eeg:
    """The EEG as it is received.

    Attributes:
        inlet: From which it comes.
        rows: Columns of its samples that the decoder takes, in its order.
        trigger: Column of the trigger channel; -1 for none.
        used: ndarray, shape (n_rows,), bool: channels that the decoder reads at all.
        watch: Whether it comes as it should.
        offset: What to add to its stamps, seconds of the receiver's clock; NaN as long as it was not measured.
        measured: When that was measured, seconds of the receiver's clock.
    """

    inlet: Inlet
    rows: list[int]
    trigger: int
    used: np.ndarray
    watch: StreamWatch
    offset: float = float("nan")
    measured: float = float("-inf")

    def measure(self) -> None:
        """Take what was measured of the clocks' difference."""
        for when, offset in self.inlet.offsets():
            self.measured, self.offset = when, offset

    def marks(self, own: np.ndarray, rail_uv: float) -> np.ndarray:
        """Return what is wrong with each sample in the channels that the decoder reads.

        Args:
            own: ndarray, shape (n_rows, n_times), µV.
            rail_uv: A channel that reaches this is railed, µV; 0 for no such bound.

        Returns:
            ndarray, shape (n_times,), uint8: bits of ``NOT_FINITE`` and ``RAILED``.
        """
        used = own[self.used]
        marks = NOT_FINITE * ~np.isfinite(used).all(axis=0)
        if rail_uv:
            with np.errstate(invalid="ignore"):
                marks = marks | (RAILED * (np.abs(used) >= rail_uv).any(axis=0))
        return marks.astype(np.uint8)


def find_eeg(
    network: Network, clock: Clock, wait: Callable[[float], None], decoder: FrozenDecoder, options: OnlineOptions
) -> Eeg:
    """Return the one EEG stream, open, if the decoder serves it.

    Raises:
        HardwareError: There is none, or more than one, it cannot be reached, or the decoder is for another one.
    """
    declared = {"eeg": Declared(name=options.eeg, type="EEG")}
    end = clock() + options.wait_s
    while True:
        chosen, problems = preflight.choose(declared, network.visible())
        if chosen:
            eeg = served(network.opening(chosen["eeg"]), chosen["eeg"].name, decoder, options)
            _look(eeg, clock, wait)
            return eeg
        if any(one.kind != "missing" for one in problems) or clock() >= end:
            one = problems[0]
            raise HardwareError(
                f"the EEG is {one.kind}: {one.text}",
                cure="start the amplifier's program; end streams that are not meant, or name the one: online.eeg",
            )
        wait(_LOOK_AGAIN_S)


def _look(eeg: Eeg, clock: Clock, wait: Callable[[float], None]) -> None:
    """Learn how the stream's stamps waver and how far its clock is; what had waited is left out."""
    begun, stamps = clock(), []
    while (passed := clock() - begun) < _LOOK_S or (passed < _MEASURE_S and np.isnan(eeg.offset)):
        wait(_STEP_S)
        try:
            stamps.append(eeg.inlet.pull().stamps)
            eeg.measure()
        except Lost:
            return  # the loop will tell of it, and look for it
    eeg.watch.learn(np.concatenate(stamps))


def served(opening: Future[Inlet], name: str, decoder: FrozenDecoder, options: OnlineOptions) -> Eeg:
    """Return a stream that is received from now on, which is waited for.

    Raises:
        HardwareError: It cannot be reached, or the decoder is for another kind.
    """
    try:
        inlet = opening.result()
    except Lost as error:
        raise HardwareError(
            f"{name!r}: {error}",
            cure=f"let the ports of LSL through ({PORTS}), or run it on the machine that sends",
        ) from error
    about = inlet.description
    try:
        labels = preflight.names_of(about)
        trigger = _trigger(about, options)
        beside = {labels[i] for i in _stims(about)} | ({labels[trigger]} if trigger >= 0 else set())
        units = about.units or ("",) * about.n_channels
        rows = decoder.rows(labels, units, about.sfreq, beside=beside)
    except StreamError as error:
        inlet.close()
        raise HardwareError(
            f"the decoder does not serve {about.name!r}: {error}",
            cure="set the amplifier as in the calibration, or calibrate on a recording of this stream: hrcneuro "
            "calibrate SUBJECT",
        ) from error
    except HardwareError:
        inlet.close()
        raise
    return Eeg(inlet, rows, trigger, np.asarray(decoder.matrix.any(axis=0)), StreamWatch(about.sfreq, stall_s=_STALL_S))


def _stims(about: Description) -> list[int]:
    """Return which channels are of triggers, by the type that the stream states."""
    try:
        found = [one.findtext("type") or "" for one in ET.fromstring(about.xml).iter("channel")]
    except ET.ParseError:
        return []
    return [i for i, kind in enumerate(found) if kind.lower() in TRIGGER_TYPES]


def _trigger(about: Description, options: OnlineOptions) -> int:
    """Return the column of the trigger channel; -1 for none.

    Raises:
        HardwareError: The stream has no channel of the name that is asked for.
    """
    if options.trigger == "none":
        return -1
    if options.trigger == "auto":
        return next(iter(_stims(about)), -1)
    if options.trigger not in about.labels:
        raise HardwareError(
            f"{about.name!r} has no channel {options.trigger!r}; it has {', '.join(about.labels) or 'no names'}",
            cure="correct online.trigger; 'auto' takes the first of type stim, 'none' times moves by markers alone",
        )
    return about.labels.index(options.trigger)


def in_order(samples: Samples, last: float) -> Samples:
    """Return the samples without those that came behind younger ones: a causal filter has gone past their place.

    Args:
        samples: What came.
        last: Stamp of the sample before them.
    """
    youngest = np.maximum.accumulate(np.concatenate([[last], samples.stamps]))[:-1]
    keep = samples.stamps > youngest
    return Samples(samples.stamps[keep], np.asarray(samples.values)[keep])


def pieces(samples: Samples, breaks: list[int], sfreq: float) -> list[tuple[bool, slice]]:
    """Return stretches of at most half a second, and for each whether samples are missing before it.

    Args:
        samples: What came.
        breaks: Places among them before which others are missing.
        sfreq: Rate, Hz.
    """
    length = max(1, round(_PIECE_S * sfreq))
    edges = sorted({0, len(samples), *breaks})
    return [
        (at == start and start in breaks, slice(at, min(at + length, stop)))
        for start, stop in pairwise(edges)
        for at in range(start, stop, length)
    ]


def fitting(network: Network, wanted: Declared) -> list[Description]:
    """Return the streams that fit."""
    return [one for one in network.visible() if preflight.fits(wanted, one) and preflight.recordable(one)]


def another(network: Network, wanted: Declared, uid: str) -> Description | None:
    """Return a stream that fits and is another run than ``uid``; None where there is none, or more than one."""
    there = fitting(network, wanted)
    others = [one for one in there if one.uid != uid]
    return others[0] if len(others) == 1 and len(there) == 1 else None
