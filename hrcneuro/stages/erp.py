"""erp: averages time-locked to the onset, differences between conditions and their test (paper 2.5.2, 2.6.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.analyses import alike, onsets
from hrcneuro.analyses import contrasts as group_contrasts
from hrcneuro.analyses import strata as contrast_strata
from hrcneuro.contract import Inputs, Of, Read, Stage, Work, option
from hrcneuro.errors import ConfigError, DataError

if TYPE_CHECKING:
    import mne
    import numpy as np
    from numpy.typing import NDArray

    from hrcneuro.eeg.selection import Cell, Trials


FIGURES = {
    "erp_subject.png": "One subject's potentials with standard errors over trials; their difference with its "
    "confidence interval, and maps of it (of the potential itself where the study has no contrast)",
    "erp.png": "Grand averages of each contrast, its first condition in colour, its second in grey, with standard "
    "errors over subjects; below them the mean difference with its confidence interval, above them maps of it; grey "
    "spans and white electrodes: significant (as in the paper's Fig 2)",
    "erp_scenarios.png": "The same contrasts in each scenario alone (the paper's Fig 3)",
    "erp_strata.png": "The contrasts among trials that are alike in what went before (previous error) and in what is "
    "coming (turn): what remains of the difference does not stem from that",
}


@dataclass(frozen=True)
class Config(group_contrasts.Options):
    """Averages, test and figure."""

    baseline_s: tuple[float, ...] = option(
        (-0.2, 0.0), "start and end of the mean that is subtracted from each trial and channel", unit="s"
    )
    overlap: str = option(
        "keep",
        "responses to neighbouring onsets: keep them in the average, or regress them out",
        choices=("keep", "regress"),
    )
    channel: str = option("Cz", "channel of the waveforms in the figures")
    map_times_s: tuple[float, ...] = option((), "times of the maps; empty for the largest differences", unit="s")


def check(config: Config) -> list[str]:
    """Return what is contradictory in the section."""
    found = group_contrasts.check(config)
    if len(config.baseline_s) != 2 or config.baseline_s[0] >= config.baseline_s[1]:
        found.append(f"baseline_s = {list(config.baseline_s)}: give [start, end] with start before end")
    if len(config.map_times_s) > 4:
        found.append(f"map_times_s has {len(config.map_times_s)} times; at most 4 fit")
    return found


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Average one subject's epochs and draw them."""
    import numpy as np
    import pandas as pd

    from hrcneuro.eeg.evoked import averages
    from hrcneuro.eeg.selection import nearest_channel, shortest_gap_s
    from hrcneuro.figures import erp as erp_figures
    from hrcneuro.figures import erp_panels
    from hrcneuro.io.fif import write_evokeds
    from hrcneuro.io.tables import write_table
    from hrcneuro.tables import contrasts as contrast_tables

    trials = group_contrasts.read_trials(inputs)
    cells, warnings = group_contrasts.filled_cells(trials, config, inputs.unit)
    means, data = _averages(trials, [cell.mask for cell in cells], config, inputs)
    write_evokeds(_evokeds(trials, cells, means, config), out / f"{inputs.unit}_ave.fif")
    gaps = {cell.label: shortest_gap_s(trials.table[cell.mask]) for cell in cells}
    rows = [(cell.scenario, cell.condition, cell.n, gaps[cell.label]) for cell in cells]
    table = pd.DataFrame(rows, columns=list(contrast_tables.AVERAGES.columns))
    write_table(table, out / "averages.parquet", contrast_tables.AVERAGES)
    if config.overlap == "keep":
        strata, notes = contrast_strata.cells(trials.table, cells, config)
        warnings += notes
        if strata:
            within = averages(data, np.stack([cell.mask for cell in strata]))
            write_evokeds(_evokeds(trials, strata, within, config), out / f"{inputs.unit}_strata_ave.fif")
        contrast_tables.write_strata(strata, trials.table, out / "strata.parquet")
    elif contrast_strata.chosen(config) and config.strata:
        warnings.append("no strata: erp.overlap = 'regress' is offered for whole conditions only")

    channel = nearest_channel(config.channel, trials.info["ch_names"])
    if channel.lower() != config.channel.lower():
        warnings.append(f"there is no channel {config.channel}: the figure shows {channel}")
    gap = shortest_gap_s(trials.table)
    panels = erp_panels.of_subject(trials, data, cells, means, config, channel, gap)
    erp_figures.draw(
        panels,
        trials.times,
        trials.info,
        out / "erp_subject.png",
        channel=channel,
        gap_s=gap,
        note=f"{inputs.unit}; {_bands(config)}",
    )
    counts: dict[str, dict[str, int]] = {}
    for cell in cells:
        counts.setdefault(cell.scenario, {})[cell.condition] = cell.n
    return {"trials": counts, "shortest_gap_s": None if gap != gap else gap, "channel": channel, "warnings": warnings}


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Average over subjects, test the contrasts, and draw the paper's Figs 2 and 3."""
    from hrcneuro.eeg.selection import ALL, nearest_channel
    from hrcneuro.figures import erp as erp_figures
    from hrcneuro.figures import erp_panels
    from hrcneuro.tables import contrasts as contrast_tables

    averages, times, info, gap, lost = _read_group(inputs)
    names = info["ch_names"]
    axes = {"channel": names, "times": times}
    pairs = group_contrasts.in_order((pair for maps in averages.values() for pair in maps), config.conditions)
    contrast_tables.write_grand(averages, pairs, axes, out / "erp.parquet", contrast_tables.ERP)

    adjacency = None
    if config.correction == "cluster":
        import mne

        positions = contrast_tables.positions(info).set_index("channel")
        adjacency = mne.stats.combine_adjacency(group_contrasts.channel_adjacency(positions), len(times))
    tested = list(group_contrasts.over_subjects(averages, config, adjacency))
    contrast_tables.write_tested(tested, axes, out / "erp_stats.parquet", contrast_tables.ERP_STATS)

    channel = nearest_channel(config.channel, names)
    drawing = erp_panels.Group(averages, times, names, channel, gap, config.map_times_s, config.confidence)
    bands = f"bands: standard error, of the difference its {100 * config.confidence:g}% interval"
    note = f"{bands}; {group_contrasts.named_test(config, subjects=len(averages))}"
    for name, chosen in (
        ("erp.png", [t for t in tested if t.scenario == ALL]),
        (
            "erp_scenarios.png",
            sorted((t for t in tested if t.scenario != ALL), key=lambda t: list(config.contrasts).index(t.name)),
        ),
    ):
        if chosen:
            panels = drawing.panels(chosen)
            erp_figures.draw(panels, times, info, out / name, channel=channel, gap_s=gap, note=note)
    labels = {"channel": names, "time_s": times}
    summary = group_contrasts.group_summary(averages, tested, labels, config)
    strata = _read_strata(inputs, names)
    within = list(group_contrasts.over_subjects(strata, config, adjacency))
    contrast_tables.write_tested(within, axes, out / "erp_strata.parquet", contrast_tables.ERP_STRATA)
    if shown := group_contrasts.held_by_half(within, len(averages)):
        panels = replace(drawing, averages=strata).panels(shown)
        erp_figures.draw(panels, times, info, out / "erp_strata.png", channel=channel, gap_s=gap, note=note)
    return summary | {"strata": contrast_strata.summary(within, labels), "warnings": lost + summary["warnings"]}


def _bands(config: Config) -> str:
    if config.overlap == "regress":
        return "overlap of responses regressed out, which leaves no standard error"
    return f"bands: standard error over trials, of the difference its {100 * config.confidence:g}% interval"


def _averages(
    trials: Trials, masks: list[NDArray[np.bool_]], config: Config, inputs: Inputs
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the average of each cell, and the epochs with their baseline subtracted: ``trials.data`` itself."""
    import numpy as np

    from hrcneuro.eeg import evoked
    from hrcneuro.eeg.overlap import regressed_averages

    start, stop = config.baseline_s
    means = None
    if config.overlap == "regress":
        others = onsets.without_epoch(inputs, trials)
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


def _evokeds(trials: Trials, cells: list[Cell], means: NDArray[np.float64], config: Config) -> list[mne.Evoked]:
    import mne

    start, stop = config.baseline_s
    return [
        mne.EvokedArray(
            mean * 1e-6,
            trials.info,
            tmin=float(trials.times[0]),
            comment=cell.label,
            nave=cell.n,
            baseline=(max(start, trials.times[0]), min(stop, trials.times[-1])),
            verbose="error",
        )
        for cell, mean in zip(cells, means, strict=True)
    ]


def _read_group(
    inputs: Inputs,
) -> tuple[dict[str, dict[tuple[str, str], NDArray[np.float64]]], NDArray[np.float64], mne.Info, float, list[str]]:
    """Return subject -> averages (µV) on shared channels, times, these channels, the shortest gap, and warnings."""
    import mne
    import numpy as np

    from hrcneuro.io.fif import read_evokeds
    from hrcneuro.io.tables import read_table

    units = inputs.units("erp")
    evokeds = {unit: read_evokeds(inputs.path("erp", f"{unit}_ave.fif", unit=unit)) for unit in units}
    first = evokeds[units[0]][0]
    shared, lost = alike.shared_channels({unit: found[0].ch_names for unit, found in evokeds.items()})
    alike.require_same_times(inputs, {unit: found[0].times for unit, found in evokeds.items()})
    averages, gaps = {}, []
    for unit, found in evokeds.items():
        picked = [found[0].ch_names.index(name) for name in shared]
        averages[unit] = {_pair(e.comment): e.data[picked] * 1e6 for e in found}
        gaps.append(read_table(inputs.path("erp", "averages.parquet", unit=unit))["gap_s"].min())
    info = mne.pick_info(first.info, [first.ch_names.index(name) for name in shared])
    known = [gap for gap in gaps if np.isfinite(gap)]
    return averages, first.times, info, min(known, default=float("nan")), lost


def _read_strata(inputs: Inputs, names: list[str]) -> dict[str, dict[tuple[str, str], NDArray[np.float64]]]:
    """Return subject -> averages within strata (µV) on these channels; subjects without any are left out."""
    from hrcneuro.io.fif import read_evokeds

    found = {}
    for unit in inputs.units("erp"):
        if inputs.has("erp", "{unit}_strata_ave.fif", unit=unit):
            evokeds = read_evokeds(inputs.path("erp", f"{unit}_strata_ave.fif", unit=unit))
            picked = [evokeds[0].ch_names.index(name) for name in names]
            found[unit] = {_pair(e.comment): e.data[picked] * 1e6 for e in evokeds}
    return found


def _pair(comment: str) -> tuple[str, str]:
    scenario, _, condition = comment.partition("/")
    return scenario, condition


STAGE = Stage(
    name="erp",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "pyarrow", "mne", "matplotlib"),
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
