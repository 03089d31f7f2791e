"""Cut the clean EEG into epochs around every onset, check their amplitude, count the conditions (paper §2.5.1)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import published
from hrcneuro.analyses import onsets as onsets_of
from hrcneuro.contract import Inputs, Read, Stage, Work, option
from hrcneuro.errors import DataError

if TYPE_CHECKING:
    import mne
    import numpy as np
    import pandas as pd

    from hrcneuro.eeg.epochs import Window
    from hrcneuro.eeg.resample import Ratio


@dataclass(frozen=True)
class Config:
    """Options of the stage; the defaults are the paper's."""

    tmin: float = option(published.EPOCH_S.value[0], "start of an epoch, from the onset", unit="s", low=-10, high=10)
    tmax: float = option(published.EPOCH_S.value[1], "end of an epoch, from the onset", unit="s", low=-10, high=30)
    reject_uv: float = option(
        published.IMPLAUSIBLE_UV.value,
        "an epoch with a larger |amplitude| on any channel is rejected",
        unit="µV",
        low=0,
        open_low=True,
    )
    outlier_share: float = option(
        0.1,
        "share of epochs rejected for their amplitude above which a subject is called an outlier",
        low=0,
        high=1,
        share=True,
    )


def check(config: Config) -> list[str]:
    """Return what contradicts itself in the options."""
    if config.tmin >= config.tmax:
        return [f"epoch.tmin = {config.tmin:g} s must lie before epoch.tmax = {config.tmax:g} s"]
    return []


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Cut one subject's epochs.

    Raises:
        DataError: The trials do not fit the recording, there is no trial to cut, or no epoch is good.
    """
    from hrcneuro.eeg.epochs import Window, candidates, cut, judge, largest, tags, tally
    from hrcneuro.io.fif import read_raw, read_samples, write_epochs
    from hrcneuro.io.tables import read_table
    from hrcneuro.tables.epoch import write_conditions, write_drop_log

    trials = candidates(read_table(inputs.path("acquire", "trials.parquet"))).reset_index(drop=True)
    if trials.empty:
        raise DataError(
            "trials.parquet has no trial to cut an epoch around: no move has a condition, or no event was mapped",
            cure="look at the events: hrcneuro acquire SUBJECT --inspect",
        )
    raw = read_raw(inputs.path("preprocess", "{unit}_clean_raw.fif"))
    data, ratio = read_samples(raw, range(len(raw.ch_names))), onsets_of.ratio(inputs, raw)
    window = Window.of(ratio.sfreq, config.tmin, config.tmax)
    onsets = onsets_of.samples(trials, ratio)
    breaks, marked = onsets_of.borders(raw, ratio), _marked(raw, ratio)
    limit = config.reject_uv * 1e-6
    reasons = judge(data, onsets, window, borders=breaks, marked=marked, limit=limit)
    kept = reasons == ""
    counts = tally(trials, reasons)
    summary = _summary(config, trials, reasons, counts, window)
    if not kept.any():
        raise DataError(
            f"none of {len(kept)} epochs is good: {_listed(summary['reasons'])}",
            cure="look at quality.png of preprocess; epoch.reject_uv, epoch.tmin and epoch.tmax set the limits",
        )
    peaks, rows = largest(data, onsets, window)
    write_drop_log(trials, tags(trials), reasons, (1e6 * peaks, rows), raw.ch_names, out)
    pieces = cut(data, onsets[kept], window)
    del data
    write_epochs(_to_mne(pieces, raw, trials, onsets, reasons, window), out / f"{inputs.unit}_epo.fif")
    write_conditions(counts, out)
    return summary


def _marked(raw: mne.io.BaseRaw, ratio: Ratio) -> list[tuple[int, int]]:
    """Return the stretches marked bad, in samples of the clean signal."""
    from hrcneuro.eeg import breaks

    marks = raw.annotations
    return breaks.marked(marks.onset, marks.duration, marks.description, ratio.sfreq)


def _to_mne(
    cut: np.ndarray,
    raw: mne.io.BaseRaw,
    trials: pd.DataFrame,
    onsets: np.ndarray,
    reasons: np.ndarray,
    window: Window,
) -> mne.EpochsArray:
    """Return the good epochs (volts) as MNE's type, the trials as their metadata, the others in the drop log."""
    import mne
    import numpy as np

    from hrcneuro.eeg.epochs import tags

    kept = np.flatnonzero(reasons == "")
    metadata = trials.iloc[kept].reset_index(drop=True)
    names = tags(metadata)
    event_id = {name: code for code, name in enumerate(sorted(set(names)), start=1)}
    codes = [event_id[name] for name in names]
    events = np.column_stack([_distinct(onsets[kept]), np.zeros(len(kept), int), codes])
    return mne.EpochsArray(
        cut,
        raw.info,
        events,
        tmin=window.tmin,
        event_id=event_id,
        baseline=None,
        metadata=metadata,
        selection=kept,
        drop_log=tuple((why,) if why else () for why in reasons),
        verbose="error",
    )


def _distinct(samples: np.ndarray) -> np.ndarray:
    """Return ascending, distinct event samples: MNE allows one event a sample, a slow recording may hold two."""
    import numpy as np

    steps = np.arange(len(samples))
    return np.maximum.accumulate(samples - steps) + steps


def _summary(
    config: Config, trials: pd.DataFrame, reasons: np.ndarray, counts: pd.DataFrame, window: Window
) -> dict[str, Any]:
    first = counts[counts["position"].isin(["before", "event"])]
    per_scenario = {
        scenario: dict(zip(rows["case"], map(int, rows["kept"]), strict=True))
        for scenario, rows in first.groupby("scenario", sort=True)
    }
    total: dict[str, int] = {}
    for cases in per_scenario.values():
        for case, n in cases.items():
            total[case] = total.get(case, 0) + n
    why = {str(reason): int((reasons == reason).sum()) for reason in sorted(set(reasons) - {""})}
    share = why.get("amplitude", 0) / len(reasons)
    outlier = share > config.outlier_share
    warnings = [
        f"no epoch of {row.case} ({row.position}) in {row.scenario}" for row in counts.itertuples() if not row.kept
    ]
    if outlier:
        warnings.append(
            f"{share:.1%} of the epochs exceed {config.reject_uv:g} µV (limit {config.outlier_share:.0%}): an outlier; "
            "study.exclude leaves a subject out"
        )
    return {
        "counts": per_scenario,
        # Of another study events are counted here: what its conditions are, erp, ersp and decode find out.
        "counted": "events" if counts["position"].eq("event").all() else "conditions",
        "total": total,
        "epochs": int((reasons == "").sum()),
        "rejected": int((reasons != "").sum()),
        "reasons": why,
        "amplitude_share": share,
        "outlier": outlier,
        "sfreq": window.sfreq,
        "samples": window.length,
        "warnings": warnings,
    }


def _listed(reasons: dict[str, int]) -> str:
    return ", ".join(f"{n} {reason}" for reason, n in reasons.items())


STAGE = Stage(
    name="epoch",
    title="Trials and conditions",
    config=Config,
    libraries=("numpy", "mne", "pandas", "pyarrow"),
    check=check,
    subject=Work(
        run, (Read("preprocess", ("*_clean_raw*.fif", "timing.parquet")), Read("acquire", ("trials.parquet",)))
    ),
)
