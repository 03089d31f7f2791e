"""What subjects must have in common before their maps are averaged: channels and times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from hrcneuro.contract import Inputs
from hrcneuro.errors import DataError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# So many names are listed; of more, the number says enough.
_LISTED = 8


def shared_channels(names: Mapping[str, Sequence[str]]) -> tuple[list[str], list[str]]:
    """Return the channels that all subjects have, in the first one's order, and a sentence on those left out.

    Args:
        names: Subject -> its channels.

    Raises:
        DataError: The subjects have no channel in common.
    """
    everyone = list(dict.fromkeys(name for mine in names.values() for name in mine))
    shared = [name for name in everyone if all(name in mine for mine in names.values())]
    if not shared:
        having = "; ".join(f"{unit} has {_listed(mine)}" for unit, mine in names.items())
        raise DataError(
            f"the subjects have no EEG channel in common, so there is nothing to average: {having}",
            cure="give the channels the same names in all recordings (acquire.channel_map), or leave out the subject "
            "that differs (study.exclude)",
        )
    lacking = {unit: [name for name in everyone if name not in mine] for unit, mine in names.items()}
    lacks = "; ".join(f"{unit} lacks {_listed(without)}" for unit, without in lacking.items() if without)
    return shared, [f"the group has {len(shared)} of {len(everyone)} channels, those of all: {lacks}"] if lacks else []


def require_same_times(inputs: Inputs, times: Mapping[str, NDArray[np.float64]]) -> None:
    """Refuse to average over subjects whose epochs differ.

    Args:
        inputs: With each subject's ``timing.parquet`` of preprocess, which tells the rate it was recorded at.
        times: Subject -> the times of its maps, ndarray, shape (n_times,), s.

    Raises:
        DataError: Number or times of the samples differ.
    """
    import numpy as np

    unit, first = next(iter(times.items()))
    for other, others in times.items():
        if len(first) != len(others) or not np.allclose(first, others, atol=1e-6):
            rates, cure = _rates(inputs, unit, other)
            raise DataError(
                f"{unit} has {len(first)} samples from {first[0]:g} to {first[-1]:g} s, {other} {len(others)} from "
                f"{others[0]:g} to {others[-1]:g} s{rates}; a group needs the same",
                cure=cure,
            )


def _rates(inputs: Inputs, unit: str, other: str) -> tuple[str, str]:
    """Return what two subjects' sampling rates explain of a difference of their times, and the cure."""
    from hrcneuro.eeg.resample import common_rate
    from hrcneuro.io.tables import read_table

    timing = {
        u: read_table(inputs.path("preprocess", "timing.parquet", unit=u)).iloc[0] for u in inputs.units("preprocess")
    }
    leave_out = "leave out the subject that differs (study.exclude)"
    if not {unit, other} <= set(timing) or timing[unit]["sfreq"] == timing[other]["sfreq"]:
        return "", f"rerun both from preprocess on with --force, or {leave_out}"
    rates = " and ".join(
        f"{u} was recorded at {timing[u]['source_sfreq']:.7g} Hz and is at {timing[u]['sfreq']:.7g} Hz now"
        for u in (unit, other)
    )
    rate = common_rate([float(one["source_sfreq"]) for one in timing.values()])
    reach = f"set preprocess.sfreq = {rate}, which all recordings reach alike, or {leave_out}" if rate else leave_out
    return f": {rates}", reach


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return ", ".join(names[:_LISTED]) + more
