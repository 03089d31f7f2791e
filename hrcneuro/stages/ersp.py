"""ersp: mean wavelet magnitudes of every condition, 2-30 Hz, differences and their test (paper 2.5.3, 2.6.1)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import published
from hrcneuro.analyses import contrasts as group_contrasts
from hrcneuro.analyses import shared_axes
from hrcneuro.analyses import strata as contrast_strata
from hrcneuro.contract import Inputs, Of, Read, Stage, Work, option
from hrcneuro.eeg.wavelets import WaveletFamily
from hrcneuro.errors import ConfigError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hrcneuro.eeg.morlet import Wavelets

    Maps = dict[tuple[str, str], NDArray[np.float32]]


@dataclass(frozen=True)
class Config(WaveletFamily, group_contrasts.ContrastOptions):
    """The wavelets, and how their magnitudes are tested; below, what the pictures show."""

    decimate: int = option(published.DECIMATION.value, "keep every n-th sample of the magnitudes", low=1)
    channels: tuple[str, ...] = option(
        ("Fz", "C3", "Cz", "C4"), "channels of the figures; the first that exist", drawing=True
    )


def check(config: Config) -> list[str]:
    """Return what is contradictory in the section."""
    mistakes = []
    if config.low_hz > config.high_hz:
        mistakes.append(f"low_hz = {config.low_hz:g} lies above high_hz = {config.high_hz:g}")
    if not config.channels:
        mistakes.append("channels is empty: name at least one for the figures")
    return mistakes


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Average one subject's magnitudes: whole conditions, and within strata."""
    import numpy as np

    from hrcneuro.eeg.morlet_means import mean_magnitudes
    from hrcneuro.eeg.selection import shortest_gap_s
    from hrcneuro.io.tables import write_table
    from hrcneuro.io.trials import read_trials
    from hrcneuro.tables import contrasts as tables

    # The maps are made in single precision, in which the epochs are stored.
    trials = read_trials(inputs, np.float32)
    sets, warnings = group_contrasts.filled_sets(trials, config, inputs.unit)
    strata, lacking = contrast_strata.stratified_sets(trials.table, sets, config)
    wavelets = _wavelets(config, trials.info["sfreq"])
    both = [*sets, *strata]
    means = mean_magnitudes(trials.data, np.stack([one.mask for one in both]), wavelets, step=config.decimate)
    every = {(one.scenario, one.condition): mean for one, mean in zip(both, means, strict=True)}
    maps = {(one.scenario, one.condition): every.pop((one.scenario, one.condition)) for one in sets}
    counts = {(one.scenario, one.condition): (one.n, shortest_gap_s(trials.table[one.mask])) for one in both}
    names = trials.info["ch_names"]
    axes = {"channel": names, "frequency_hz": wavelets.frequencies, "times": trials.times[:: config.decimate]}
    tables.write_magnitudes(maps, counts, axes, out / "ersp.parquet")
    if strata:
        tables.write_magnitudes(every, counts, axes, out / "ersp_strata.parquet", tables.ERSP_STRATA_SUBJECT)
    write_table(tables.positions(trials.info), out / "channels.parquet", tables.CHANNELS)
    labels = {"channel": names, "frequency_hz": axes["frequency_hz"], "time_s": axes["times"]}
    return {
        "trials": group_contrasts.trial_counts(sets),
        "absent": list(group_contrasts.absent(trials, config).items()),
        "contrasts": group_contrasts.subject_peaks(maps, config, labels),
        "frequencies_hz": list(wavelets.frequencies),
        "shortest_gap_s": group_contrasts.shortest_gap(trials.table, sets),
        "warnings": warnings + lacking,
    }


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Average over subjects and test the contrasts of the paper's Figs 2 and 3, whole and within strata."""
    from hrcneuro.tables import contrasts as tables

    averages, axes, gap, lost = _read_group(inputs)
    tables.write_grand(group_contrasts.grand_averages(averages, config), axes, out / "ersp.parquet", tables.ERSP)
    adjacency = _adjacency(inputs, axes) if config.correction == "cluster" else None
    whole: Any = dict(subjects=len(averages), gap_s=gap)
    tested = list(group_contrasts.over_subjects(averages, config, adjacency))
    tables.write_tested(tested, axes, out / "ersp_stats.parquet", tables.ERSP_STATS, **whole)
    labels = {"channel": axes["channel"], "frequency_hz": axes["frequency_hz"], "time_s": axes["times"]}
    summary = group_contrasts.group_summary(averages, tested, labels, config, gap)

    strata = _read_strata(inputs, axes["channel"])
    within = list(group_contrasts.over_subjects(strata, config, adjacency))
    tables.write_tested(within, axes, out / "ersp_strata.parquet", tables.ERSP_STRATA, **whole)
    return summary | {"strata": contrast_strata.summary(within, labels), "warnings": lost + summary["warnings"]}


def _wavelets(config: Config, sfreq: float) -> Wavelets:
    try:
        return config.at(sfreq)
    except ValueError as error:
        raise ConfigError(str(error), cure="lower ersp.high_hz, or raise preprocess.sfreq") from error


def _read_group(inputs: Inputs) -> tuple[dict[str, Maps], dict[str, Any], float, list[str]]:
    """Return subject -> maps on shared channels, their axes, the shortest gap, and warnings."""
    from hrcneuro.tables.maps import read_magnitudes

    subjects = {unit: read_magnitudes(inputs.path("ersp", "ersp.parquet", unit=unit)) for unit in inputs.units("ersp")}
    shared, lost = shared_axes.shared_channels({unit: own.axes["channel"] for unit, own in subjects.items()})
    shared_axes.require_same_times(inputs, {unit: own.axes["times"] for unit, own in subjects.items()})
    averages = {unit: own.on_channels(shared) for unit, own in subjects.items()}
    gaps = [own.gap_s for own in subjects.values() if own.gap_s == own.gap_s]
    first = next(iter(subjects.values()))
    return averages, {**first.axes, "channel": shared}, min(gaps, default=float("nan")), lost


def _read_strata(inputs: Inputs, names: list[str]) -> dict[str, Maps]:
    """Return subject -> maps within strata on these channels; subjects without any are left out."""
    from hrcneuro.tables.maps import read_magnitudes

    return {
        unit: read_magnitudes(inputs.path("ersp", "ersp_strata.parquet", unit=unit)).on_channels(names)
        for unit in inputs.units("ersp")
        if inputs.has("ersp", "ersp_strata.parquet", unit=unit)
    }


def _adjacency(inputs: Inputs, axes: dict[str, Any]) -> Any:
    import mne

    from hrcneuro.io.tables import read_table

    table = read_table(inputs.path("ersp", "channels.parquet", unit=inputs.units("ersp")[0])).set_index("channel")
    channels = group_contrasts.channel_adjacency(table.loc[axes["channel"], ["x_m", "y_m", "z_m"]])
    return mne.stats.combine_adjacency(channels, len(axes["frequency_hz"]), len(axes["times"]))


STAGE = Stage(
    name="ersp",
    title="Rhythms",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "pyarrow", "mne"),
    check=check,
    subject=Work(run, (Read("epoch", ("*_epo*.fif",)),)),
    group=Work(
        run_group,
        (
            Read("ersp", ("ersp*.parquet", "channels.parquet"), Of.INCLUDED),
            Read("preprocess", ("timing.parquet",), Of.INCLUDED),
        ),
    ),
)
