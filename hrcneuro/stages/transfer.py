"""transfer: takeovers decoded in people of whom no decoder has seen a trial, and what calibration adds to that."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrcneuro.analyses import conditions as configured
from hrcneuro.contract import Inputs, Of, Read, Reads, Stage, Work, option
from hrcneuro.decoding.refusals import (
    EmptyWindowError,
    MissingLibraryError,
    NoSignalError,
    NotFiniteTrialsError,
    VoltsError,
    WindowOutsideError,
)
from hrcneuro.decoding.transfer_scheme import RECENTRING, TransferScheme
from hrcneuro.eeg.params import CausalOptions
from hrcneuro.eeg.refusals import BandError, LoneChannelError, NoPositionError
from hrcneuro.errors import ConfigError, Cures, DataError, cured
from hrcneuro.paradigm.design import DECODED, PROBLEMS

_SIGNALS = ("offline", "causal")

_CURES: Cures = {
    WindowOutsideError: (DataError, "make the epochs longer (epoch.tmin, epoch.tmax)"),
    EmptyWindowError: (DataError, "use a higher sampling rate"),
    NotFiniteTrialsError: (DataError, "look at the recording: hrcneuro acquire SUBJECT --inspect"),
    NoSignalError: (DataError, "look at quality.png of preprocess: all channels are flat"),
    VoltsError: (DataError, "they seem to be in volts: multiply by 1e6"),
    BandError: (ConfigError, "set transfer.l_freq and transfer.h_freq inside 0–{nyquist:g} Hz"),
    NoPositionError: (DataError, "give positions (acquire.montage)"),
    LoneChannelError: (DataError, "set transfer.reference = 'none'"),
    MissingLibraryError: (
        ConfigError,
        "pip install 'hrcneuro[decoders]', or leave recentred and joint out of transfer.ways",
    ),
}


@dataclass(frozen=True)
class Config(TransferScheme, CausalOptions):
    """What is decoded, and the signals that decoders see; how, is the scheme's."""

    conditions: dict[str, str] = option(DECODED, "condition -> pandas query on the trial table", shared="conditions")
    problems: dict[str, tuple[str, ...]] = option(
        PROBLEMS, "decoding problem -> [class 1, class 2 (takeover)]", shared="problems"
    )
    split: str = option("scenario", "trial column whose values are decoded apart; empty for none", shared="split")
    signals: tuple[str, ...] = option(
        _SIGNALS,
        "offline: the epochs of epoch; causal: the recording as a stream would bring it, ready 600 ms after an onset",
        choices=_SIGNALS,
    )


def check(config: Config) -> list[str]:
    """Return what is contradictory in the section."""
    mistakes = [
        f"{name} = {list(values)}: give at least one name, and each only once"
        for name, values in (("ways", config.ways), ("signals", config.signals))
        if not values or len(set(values)) < len(values)
    ]
    if list(config.pairs) != sorted(set(config.pairs)):
        mistakes.append(f"pairs = {list(config.pairs)}: give numbers in rising order, each only once")
    return mistakes + config.of_band()


def ready(config: Config) -> None:
    """Refuse to recentre without the library that does it, before anything runs."""
    if set(RECENTRING) & set(config.ways):
        from hrcneuro.decoding import recentring

        with cured(_CURES):
            recentring.tools()


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Write one subject's trials as decoders see them.

    Raises:
        DataError: The epochs are too short, not finite, without a signal or not in microvolt; or the recording is not
            the one that preprocess has cleaned.
        ConfigError: Conditions do not fit the trial table, or the band not the sampling rate.
    """
    import pandas as pd

    from hrcneuro.analyses import transfer_trials
    from hrcneuro.io.tables import write_table
    from hrcneuro.io.trials import read_trials
    from hrcneuro.tables.contrasts import CHANNELS, positions
    from hrcneuro.tables.transfer import TRIALS

    epochs = read_trials(inputs)
    with cured(_CURES):
        seen = transfer_trials.see(inputs, epochs, config.signals, config)
    members = configured.classes(seen.table, config.conditions, config.problems)
    rows = list(transfer_trials.rows(seen, members, config.problems, config.split))
    every = pd.concat(rows, ignore_index=True) if rows else pd.DataFrame(columns=list(TRIALS.columns))
    write_table(every, out / "trials.parquet", TRIALS)
    write_table(positions(epochs.info), out / "channels.parquet", CHANNELS)
    absent = configured.absent(seen.table, config.conditions, members)
    trials: dict[str, dict[str, list[int]]] = {}
    for frame in rows[: len(rows) // len(config.signals)]:
        if len(frame):
            place, n2 = frame.iloc[0], int(frame["label"].sum())
            trials.setdefault(place["scenario"], {})[place["problem"]] = [len(frame) - n2, n2]
    return {
        "signals": list(config.signals),
        "trials": trials,
        "lost": seen.lost,
        "channels": len(seen.channels),
        "warnings": [f"no trial is of {text}" for text in absent.values()],
    }


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Decode every subject by decoders of the others, and by its own after so many calibration trials.

    Raises:
        DataError: There is one subject alone, or the subjects have no channel in common.
    """
    from hrcneuro.analyses import transfer_group, transfer_scores
    from hrcneuro.io.tables import write_table

    units = inputs.units("transfer")
    if len(units) < 2:
        raise DataError(
            f"nobody is left to learn from: the group is {', '.join(units)} alone",
            cure="give two subjects or more (study.subjects), or leave transfer out of study.stages",
        )
    files = ({unit: inputs.path("transfer", name, unit=unit) for unit in units} for name in _FILES)
    group = transfer_scores.read(*files)
    with cured(_CURES):
        scores = transfer_scores.scores(group, config)
    tables = transfer_group.tables(scores, config.seed)
    for file, (schema, frame) in tables.items():
        write_table(frame, out / file, schema)
    few = [f"{', '.join(place)}: one subject has enough trials" for place, own in group.people.items() if len(own) < 2]
    warnings = [*group.warnings, *few]
    if config.shuffled:
        warnings.append("labels were shuffled (transfer.shuffled): nothing here is a result")
    return transfer_group.summary(scores, tables) | {"shuffled": config.shuffled, "warnings": warnings}


def _reads(config: Config) -> Reads:
    epochs = Read("epoch", ("*_epo*.fif",))
    if "causal" not in config.signals:
        return (epochs,)
    return (
        epochs,
        Read("acquire", ("*_raw*.fif", "trials.parquet")),
        Read("preprocess", ("quality.parquet",)),
    )


_FILES = ("trials.parquet", "channels.parquet")

STAGE = Stage(
    name="transfer",
    title="Decoders without calibration",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "mne", "pyarrow", "scikit-learn", "pyriemann"),
    check=check,
    ready=ready,
    subject=Work(run, _reads),
    group=Work(run_group, (Read("transfer", _FILES, Of.INCLUDED),)),
    on_demand=True,
)
