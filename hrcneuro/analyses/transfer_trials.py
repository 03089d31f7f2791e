"""What transfer reads of a subject: the same trials as the epochs show them, and as a stream would have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from hrcneuro.analyses import calibrated, conditions, event_times
from hrcneuro.contract import Inputs
from hrcneuro.decoding import crossval, features
from hrcneuro.eeg.epochs import candidates
from hrcneuro.eeg.selection import ALL
from hrcneuro.errors import DataError
from hrcneuro.io.fif import read_raw
from hrcneuro.io.tables import read_table
from hrcneuro.tables.transfer import TRIALS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hrcneuro.eeg.params import CausalOptions
    from hrcneuro.eeg.selection import LabelledEpochs

OFFLINE, CAUSAL = "offline", "causal"


@dataclass(frozen=True)
class SeenTrials:
    """The trials that every signal shows, in the order of the recording.

    Attributes:
        table: Their rows of the trial table.
        onsets_s: ndarray, shape (n_trials,), s.
        features: Signal -> ndarray, shape (n_trials, n_channels × n_windows), µV.
        channels: Names of the channels, the same of every signal.
        lost: How many epochs are none of them.
    """

    table: pd.DataFrame
    onsets_s: np.ndarray
    features: Mapping[str, np.ndarray]
    channels: Sequence[str]
    lost: int


def see(inputs: Inputs, epochs: LabelledEpochs, signals: Sequence[str], options: CausalOptions) -> SeenTrials:
    """Return a subject's trials as the signals show them.

    Args:
        inputs: With the recording, its trial table and its quality where the causal signal is asked for.
        epochs: The subject's.
        signals: ``offline``, ``causal`` or both.
        options: How the causal one comes about.

    Raises:
        ValueError: What :func:`.features.window_means`, and filter and channels of the causal signal, refuse.
        DataError: What preprocess said is of another recording, or the signals have no trial in common.
    """
    onsets_s = event_times.marked_s(epochs)
    kept = np.flatnonzero(crossval.distinct(onsets_s))
    found = {}
    if CAUSAL in signals:
        kept, found[CAUSAL] = _causal(inputs, epochs, kept, options)
    if OFFLINE in signals:
        found[OFFLINE] = features.window_means(epochs.data[kept], epochs.times)
    return SeenTrials(
        epochs.table.iloc[kept].reset_index(drop=True),
        onsets_s[kept],
        {signal: found[signal] for signal in signals},
        list(epochs.info["ch_names"]),
        len(epochs.table) - len(kept),
    )


def _causal(
    inputs: Inputs, epochs: LabelledEpochs, kept: np.ndarray, options: CausalOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Return which of the epochs a stream has, too, and their features with the epochs' channels."""
    raw = read_raw(inputs.path("acquire", "{unit}_raw.fif"))
    quality = read_table(inputs.path("preprocess", "quality.parquet"))
    trials = candidates(read_table(inputs.path("acquire", "trials.parquet")))
    decoder = calibrated.bare(options, raw, calibrated.channels(raw, quality, options.interpolation))
    seen = calibrated.see(raw, decoder, trials)
    streamed, cut = (one["onset_sample"].to_numpy(int) for one in (seen.table, epochs.table.iloc[kept]))
    at = pd.Index(streamed).get_indexer(pd.Index(cut))
    channels = [decoder.kept.index(name) for name in epochs.info["ch_names"]]
    common = at[at >= 0]
    if not len(common):
        raise DataError(
            f"{inputs.unit}: none of {len(kept)} epochs is a trial that a stream has; it lacks them for: "
            f"{', '.join(f'{reason} {n}' for reason, n in seen.reasons.items()) or 'no reason'}",
            cure="raise transfer.reject_uv, or decode the epochs alone: transfer.signals = ['offline']",
        )
    taken = seen.features[common].reshape(len(common), len(decoder.kept), -1)[:, channels]
    return kept[at >= 0], taken.reshape(len(common), -1)


def rows(
    seen: SeenTrials, members: Mapping[str, NDArray[np.bool_]], problems: Mapping[str, tuple[str, ...]], split: str
) -> Iterator[pd.DataFrame]:
    """Yield rows of ``TRIALS``, a frame a signal, scenario and problem.

    Args:
        seen: The trials.
        members: Condition -> which trials belong to it, as :func:`.conditions.classes` returns it.
        problems: Problem -> [class 1, class 2].
        split: Column whose values are decoded apart; empty for none.

    Raises:
        ConfigError: The split does not fit the trial table.
    """
    places = conditions.scenarios(seen.table, split) or [(ALL, np.ones(len(seen.table), bool))]
    has_blocks = "block" in seen.table and seen.table["block"].notna().all()
    for signal, values in seen.features.items():
        for scenario, inside in places:
            for problem, (class1, class2) in problems.items():
                which = np.flatnonzero(inside & (members[class1] | members[class2]))
                frame = pd.DataFrame({"onset_s": seen.onsets_s[which]})
                frame["block"] = seen.table["block"].to_numpy()[which] if has_blocks else None
                frame["label"] = members[class2][which].astype(int)
                frame["features_uv"] = list(values[which].astype(np.float32))
                yield frame.assign(signal=signal, scenario=scenario, problem=problem)[list(TRIALS.columns)]
