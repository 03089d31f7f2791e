"""Frozen decoders as files: ``decoder.npz``, arrays without any object, and ``decoder.json``, what they mean."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hrcneuro.decoding import frozen_refusals
from hrcneuro.decoding.frozen import UNIT, FrozenDecoder, FrozenProblem
from hrcneuro.eeg.causal import Design
from hrcneuro.errors import ConfigError, Cures, DataError, cured

ARRAYS, ABOUT = "decoder.npz", "decoder.json"
_VERSION = 1

STREAM_CURES: Cures = {
    frozen_refusals.OtherChannelsError: (
        ConfigError,
        "send these channels under these names, or calibrate on a recording of this stream: hrcneuro calibrate SUBJECT",
    ),
    frozen_refusals.OtherOrderError: (
        ConfigError,
        "send the channels in the order of the recording, or calibrate anew",
    ),
    frozen_refusals.OtherUnitError: (ConfigError, f"let the amplifier's program send {UNIT}, and state it"),
    frozen_refusals.OtherRateError: (
        ConfigError,
        "set the amplifier to that rate, or calibrate on a recording at the stream's rate",
    ),
}
"""What a person can do where a stream is of another kind than a decoder takes."""


def write_decoder(decoder: FrozenDecoder, folder: Path, *, about: Mapping[str, Any]) -> None:
    """Write a decoder into a folder; the same decoder gives the same bytes.

    Args:
        decoder: What is written.
        folder: Where to.
        about: What else a person or program should know of it, as JSON values.
    """
    arrays = {
        "sos": decoder.filter.sos,
        "settled": decoder.filter.settled,
        "matrix": decoder.matrix,
        "windows": decoder.windows,
        **{f"weights_{i}": one.weights for i, one in enumerate(decoder.problems.values())},
    }
    with zipfile.ZipFile(folder / ARRAYS, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.ascontiguousarray(array, "<f8"), allow_pickle=False)
    text = {
        "version": _VERSION,
        "channels": list(decoder.channels),
        "unit": UNIT,
        "sfreq": decoder.sfreq,
        "band_hz": list(decoder.band_hz),
        "kept": list(decoder.kept),
        "reject_uv": decoder.reject_uv,
        "problems": {
            name: {
                "weights": f"weights_{i}",
                "classes": list(one.classes),
                "actor": one.actor,
                "bias": one.bias,
                "slope": one.slope,
                "offset": one.offset,
            }
            for i, (name, one) in enumerate(decoder.problems.items())
        },
        "about": dict(about),
    }
    (folder / ABOUT).write_text(f"{json.dumps(text, indent=1, ensure_ascii=False)}\n", encoding="utf-8")


def read_decoder(folder: Path) -> tuple[FrozenDecoder, Mapping[str, Any]]:
    """Return the decoder of a folder, and what was written about it.

    Raises:
        DataError: A file is missing, damaged or of another version.
    """
    cure = "make it anew: hrcneuro calibrate SUBJECT --force"
    try:
        text = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
        if text["version"] != _VERSION:
            raise DataError(
                f"{folder / ABOUT} is of version {text['version']!r}; this program reads version {_VERSION}", cure=cure
            )
        with np.load(folder / ARRAYS, allow_pickle=False) as file:
            arrays = {name: np.array(file[name]) for name in file.files}
        problems = {
            name: FrozenProblem(
                (one["classes"][0], one["classes"][1]),
                one["actor"],
                arrays[one["weights"]],
                float(one["bias"]),
                float(one["slope"]),
                float(one["offset"]),
            )
            for name, one in text["problems"].items()
        }
        decoder = FrozenDecoder(
            tuple(text["channels"]),
            float(text["sfreq"]),
            (float(text["band_hz"][0]), float(text["band_hz"][1])),
            Design(arrays["sos"], arrays["settled"]),
            arrays["matrix"],
            tuple(text["kept"]),
            arrays["windows"],
            float(text["reject_uv"]),
            problems,
        )
    except FileNotFoundError as error:
        raise DataError(f"{error.filename} does not exist", cure="hrcneuro calibrate SUBJECT makes it") from error
    except (OSError, ValueError, KeyError, TypeError, IndexError, zipfile.BadZipFile, EOFError) as error:
        raise DataError(f"the decoder in {folder} cannot be read: {error}", cure=cure) from error
    _check(decoder, folder, cure)
    return decoder, text["about"]


def rows(
    decoder: FrozenDecoder,
    channels: Sequence[str],
    units: Sequence[str],
    sfreq: float,
    *,
    beside: Collection[str] = (),
) -> list[int]:
    """Return the stream's rows that the decoder takes, as :meth:`.FrozenDecoder.rows` does.

    Raises:
        ConfigError: The stream is of another kind; with what to do.
    """
    with cured(STREAM_CURES):
        return decoder.rows(channels, units, sfreq, beside=beside)


def _check(decoder: FrozenDecoder, folder: Path, cure: str) -> None:
    """Refuse arrays that do not fit each other, or hold what is no number."""
    n_features = len(decoder.kept) * len(decoder.windows)
    found = {
        "matrix": (decoder.matrix.shape, (len(decoder.kept), len(decoder.channels))),
        "settled": (decoder.filter.settled.shape, (len(decoder.filter.sos), 2)),
        **{f"weights of {name}": (one.weights.shape, (n_features,)) for name, one in decoder.problems.items()},
    }
    for name, (shape, expected) in found.items():
        if shape != expected:
            raise DataError(
                f"the decoder in {folder} does not fit together: {name} has the shape {shape}, not {expected}",
                cure=cure,
            )
    numbers = [decoder.matrix, decoder.windows, decoder.filter.sos, decoder.filter.settled]
    numbers += [np.append(one.weights, [one.bias, one.slope, one.offset]) for one in decoder.problems.values()]
    if not all(np.isfinite(one).all() for one in numbers):
        raise DataError(f"the decoder in {folder} holds values that are no finite numbers", cure=cure)
