"""erp: averages time-locked to the onset, differences between conditions and their test (paper 2.5.2, 2.6.1)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import published
from hrcneuro.analyses import contrasts as group_contrasts
from hrcneuro.analyses import onsets, shared_axes
from hrcneuro.analyses import strata as contrast_strata
from hrcneuro.contract import Inputs, Of, Read, Stage, Work, option
from hrcneuro.errors import ConfigError, DataError

if TYPE_CHECKING:
    import mne
    import numpy as np
    from numpy.typing import NDArray

    from hrcneuro.eeg.selection import LabelledEpochs, TrialSet

    Floats = NDArray[np.float64]
    Maps = dict[tuple[str, str], Floats]


@dataclass(frozen=True)
class Config(group_contrasts.ContrastOptions):
    """How averages are made and tested; below, what their pictures show."""

    baseline_s: tuple[float, ...] = option(
        published.BASELINE_S.value, "start and end of the mean that is subtracted from each trial and channel", unit="s"
    )
    overlap: str = option(
        "keep",
        "responses to neighbouring onsets: keep them in the average, or regress them out",
        choices=("keep", "regress"),
    )
    channel: str = option("Cz", "channel of the waveforms in the figures", drawing=True)
    map_times_s: tuple[float, ...] = option(
        (), "times of the maps; empty for the largest differences", unit="s", drawing=True
    )


def check(config: Config) -> list[str]:
    """Return what is contradictory in the section."""
    mistakes = []
    if len(config.baseline_s) != 2 or config.baseline_s[0] >= config.baseline_s[1]:
        mistakes.append(f"baseline_s = {list(config.baseline_s)}: give [start, end] with start before end")
    if len(config.map_times_s) > 4:
        mistakes.append(f"map_times_s has {len(config.map_times_s)} times; at most 4 fit")
    return mistakes


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Average one subject's epochs: whole conditions, and within strata."""
    import numpy as np

    from hrcneuro.eeg.evoked import averages
    from hrcneuro.eeg.selection import shortest_gap_s
    from hrcneuro.io.fif import write_evokeds
    from hrcneuro.io.tables import write_table
    from hrcneuro.io.trials import read_trials
    from hrcneuro.tables import contrasts as tables

    trials = read_trials(inputs)
    sets, warnings = group_contrasts.filled_sets(trials, config, inputs.unit)
    means, data = _averages(trials, [one.mask for one in sets], config, inputs)
    write_evokeds(_evokeds(trials, sets, means, config), out / f"{inputs.unit}_ave.fif")
    gaps = [shortest_gap_s(trials.table[one.mask]) for one in sets]
    tables.write_averages(sets, gaps, out / "averages.parquet")
    _write_waveforms(trials, data, sets, means, gaps, config, out)
    write_table(tables.positions(trials.info), out / "channels.parquet", tables.CHANNELS)
    if config.overlap == "keep":
        strata, lacking = contrast_strata.stratified_sets(trials.table, sets, config)
        warnings += lacking
        if strata:
            within = averages(data, np.stack([one.mask for one in strata]))
            write_evokeds(_evokeds(trials, strata, within, config), out / f"{inputs.unit}_strata_ave.fif")
        gaps = [shortest_gap_s(trials.table[one.mask]) for one in strata]
        tables.write_strata(strata, gaps, out / "strata.parquet")
    elif contrast_strata.stratified_contrasts(config) and config.strata:
        warnings.append("no strata: erp.overlap = 'regress' is offered for whole conditions only")
    maps = {(one.scenario, one.condition): mean for one, mean in zip(sets, means, strict=True)}
    axes = {"channel": trials.info["ch_names"], "time_s": trials.times}
    return {
        "trials": group_contrasts.trial_counts(sets),
        "absent": list(group_contrasts.absent(trials, config).items()),
        "contrasts": group_contrasts.subject_peaks(maps, config, axes),
        "shortest_gap_s": group_contrasts.shortest_gap(trials.table, sets),
        "warnings": warnings,
    }


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Average over subjects and test the contrasts of the paper's Figs 2 and 3, whole and within strata."""
    from hrcneuro.io.tables import write_table
    from hrcneuro.tables import contrasts as tables

    averages, times, info, gap, lost = _read_group(inputs)
    names = info["ch_names"]
    axes = {"channel": names, "times": times}
    tables.write_grand(group_contrasts.grand_averages(averages, config), axes, out / "erp.parquet", tables.ERP)
    positions = tables.positions(info)
    write_table(positions, out / "channels.parquet", tables.CHANNELS)

    adjacency = None
    if config.correction == "cluster":
        import mne

        neighbours = group_contrasts.channel_adjacency(positions.set_index("channel"))
        adjacency = mne.stats.combine_adjacency(neighbours, len(times))
    whole: Any = dict(subjects=len(averages), gap_s=gap)
    tested = list(group_contrasts.over_subjects(averages, config, adjacency))
    own = [group_contrasts.own_averages(averages, one) for one in tested]
    tables.write_tested(tested, axes, out / "erp_stats.parquet", tables.ERP_STATS, own=own, **whole)
    labels = {"channel": names, "time_s": times}
    summary = group_contrasts.group_summary(averages, tested, labels, config, gap)

    strata = _read_strata(inputs, names)
    within = list(group_contrasts.over_subjects(strata, config, adjacency))
    own = [group_contrasts.own_averages(strata, one) for one in within]
    tables.write_tested(within, axes, out / "erp_strata.parquet", tables.ERP_STRATA, own=own, **whole)
    return summary | {"strata": contrast_strata.summary(within, labels), "warnings": lost + summary["warnings"]}


def _write_waveforms(
    trials: LabelledEpochs,
    data: Floats,
    sets: list[TrialSet],
    means: Floats,
    gaps: list[float],
    config: Config,
    out: Path,
) -> None:
    """Write means and standard errors of the conditions over all scenarios, which a subject's picture shows."""
    import numpy as np

    from hrcneuro.eeg.evoked import standard_errors
    from hrcneuro.eeg.selection import ALL
    from hrcneuro.tables import contrasts as tables

    rows = [i for i, one in enumerate(sets) if one.scenario == ALL]
    chosen = [sets[i] for i in rows]
    # Single trials still hold their neighbours' responses, so regressed averages have no such error.
    errors = np.full(means[rows].shape, np.nan)
    if config.overlap == "keep":
        errors = standard_errors(data, np.stack([one.mask for one in chosen]), means[rows])
    axes = {"channel": trials.info["ch_names"], "times": trials.times}
    tables.write_waveforms(chosen, [gaps[i] for i in rows], (means[rows], errors), axes, out / "waveforms.parquet")


def _averages(
    trials: LabelledEpochs, masks: list[NDArray[np.bool_]], config: Config, inputs: Inputs
) -> tuple[Floats, Floats]:
    """Return the average of each set, and the epochs with their baseline subtracted: ``trials.data`` itself."""
    import numpy as np

    from hrcneuro.eeg import evoked
    from hrcneuro.eeg.overlap import regressed_averages

    start, stop = config.baseline_s
    means = None
    if config.overlap == "regress":
        others, _ = onsets.without_epoch(inputs, trials)
        try:
            means = regressed_averages(trials.data, trials.onsets, np.stack(masks), others)
        except (ValueError, np.linalg.LinAlgError) as error:
            raise DataError(
                f"the overlap of responses cannot be regressed out: {error}", cure="use erp.overlap = 'keep'"
            ) from error
    try:
        data = evoked.subtract_baseline(trials.data, trials.times, (start, stop), in_place=True)
    except ValueError as error:
        raise ConfigError(str(error), cure="move erp.baseline_s into the epochs, or widen them (epoch)") from error
    if means is None:
        return evoked.averages(data, np.stack(masks)), data
    return evoked.subtract_baseline(means, trials.times, (start, stop)), data


def _evokeds(trials: LabelledEpochs, sets: list[TrialSet], means: Floats, config: Config) -> list[mne.Evoked]:
    import mne

    start, stop = config.baseline_s
    return [
        mne.EvokedArray(
            mean * 1e-6,
            trials.info,
            tmin=float(trials.times[0]),
            comment=one.label,
            nave=one.n,
            baseline=(max(start, trials.times[0]), min(stop, trials.times[-1])),
            verbose="error",
        )
        for one, mean in zip(sets, means, strict=True)
    ]


def _read_group(inputs: Inputs) -> tuple[dict[str, Maps], Floats, mne.Info, float, list[str]]:
    """Return subject -> averages (µV) on shared channels, times, these channels, the shortest gap, and warnings."""
    import mne
    import numpy as np

    from hrcneuro.io.fif import read_evokeds
    from hrcneuro.io.tables import read_table

    units = inputs.units("erp")
    evokeds = {unit: read_evokeds(inputs.path("erp", f"{unit}_ave.fif", unit=unit)) for unit in units}
    first = evokeds[units[0]][0]
    shared, lost = shared_axes.shared_channels({unit: own[0].ch_names for unit, own in evokeds.items()})
    shared_axes.require_same_times(inputs, {unit: own[0].times for unit, own in evokeds.items()})
    averages = {unit: _on_channels(own, shared) for unit, own in evokeds.items()}
    gaps = [read_table(inputs.path("erp", "averages.parquet", unit=unit))["gap_s"].min() for unit in units]
    info = mne.pick_info(first.info, [first.ch_names.index(name) for name in shared])
    known = [gap for gap in gaps if np.isfinite(gap)]
    return averages, first.times, info, min(known, default=float("nan")), lost


def _read_strata(inputs: Inputs, names: list[str]) -> dict[str, Maps]:
    """Return subject -> averages within strata (µV) on these channels; subjects without any are left out."""
    from hrcneuro.io.fif import read_evokeds

    return {
        unit: _on_channels(read_evokeds(inputs.path("erp", "{unit}_strata_ave.fif", unit=unit)), names)
        for unit in inputs.units("erp")
        if inputs.has("erp", "{unit}_strata_ave.fif", unit=unit)
    }


def _on_channels(evokeds: Iterable[mne.Evoked], names: list[str]) -> Maps:
    """Return (scenario, condition) -> ndarray, shape (n_channels, n_times), µV, of these channels."""
    return {_pair(one.comment): one.data[[one.ch_names.index(name) for name in names]] * 1e6 for one in evokeds}


def _pair(comment: str) -> tuple[str, str]:
    scenario, _, condition = comment.partition("/")
    return scenario, condition


STAGE = Stage(
    name="erp",
    title="Potentials",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "pyarrow", "mne"),
    check=check,
    subject=Work(
        run,
        (
            Read("epoch", ("*_epo*.fif",)),
            # The onsets without an epoch, for overlap = "regress".
            Read("acquire", ("trials.parquet",)),
            Read("preprocess", ("*_clean_raw*.fif", "timing.parquet")),
        ),
    ),
    group=Work(
        run_group,
        (
            Read("erp", ("*_ave.fif", "averages.parquet"), Of.INCLUDED),
            Read("preprocess", ("timing.parquet",), Of.INCLUDED),
        ),
    ),
)
