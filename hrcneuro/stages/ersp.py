"""ersp: mean wavelet magnitudes of every condition, 2-30 Hz, differences and their test (paper 2.5.3, 2.6.1)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.analyses import alike
from hrcneuro.analyses import contrasts as group_contrasts
from hrcneuro.analyses import strata as contrast_strata
from hrcneuro.contract import Inputs, Of, Read, Stage, Work, option
from hrcneuro.errors import ConfigError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hrcneuro.eeg.morlet import Wavelets


FIGURES = {
    "ersp_subject.png": "One subject's difference of mean magnitudes (of the magnitude itself, over its mean in time, "
    "where the study has no contrast)",
    "ersp.png": "Differences of mean magnitudes over subjects; full colour where significant (as in the paper's Fig 2)",
    "ersp_scenarios.png": "The same contrasts in each scenario alone (the paper's Fig 3)",
    "ersp_strata.png": "The contrasts among trials that are alike in what went before (previous error) and in what is "
    "coming (turn)",
}


@dataclass(frozen=True)
class Config(group_contrasts.Options):
    """Wavelets, test and figure."""

    low_hz: float = option(2.0, "lowest frequency", unit="Hz", low=0, open_low=True)
    high_hz: float = option(30.0, "highest frequency", unit="Hz", low=0, open_low=True)
    step_hz: float = option(2.0, "distance of the frequencies", unit="Hz", low=0, open_low=True)
    low_cycles: float = option(2.0, "cycles of the lowest frequency's wavelet", low=0, open_low=True)
    high_cycles: float = option(10.0, "cycles of the highest one's; evenly spaced between", low=0, open_low=True)
    kernel_s: float = option(1.0, "length of the wavelets", unit="s", low=0, open_low=True)
    decimate: int = option(2, "keep every n-th sample of the magnitudes", low=1)
    channels: tuple[str, ...] = option(("Fz", "C3", "Cz", "C4"), "channels of the figures; the first that exist")


def check(config: Config) -> list[str]:
    """Return what is contradictory in the section."""
    found = group_contrasts.check(config)
    if config.low_hz > config.high_hz:
        found.append(f"low_hz = {config.low_hz:g} lies above high_hz = {config.high_hz:g}")
    if not config.channels:
        found.append("channels is empty: name at least one for the figures")
    return found


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Average one subject's magnitudes and draw them."""
    import numpy as np

    from hrcneuro.eeg.morlet_means import mean_magnitudes
    from hrcneuro.eeg.selection import shortest_gap_s
    from hrcneuro.figures import ersp as ersp_figures
    from hrcneuro.io.tables import write_table
    from hrcneuro.tables import contrasts as contrast_tables

    # The maps are made in single precision, in which the epochs are stored.
    trials = group_contrasts.read_trials(inputs, np.float32)
    cells, warnings = group_contrasts.filled_cells(trials, config, inputs.unit)
    strata, notes = contrast_strata.cells(trials.table, cells, config)
    wavelets = _wavelets(config, trials.info["sfreq"])
    both = [*cells, *strata]
    means = mean_magnitudes(trials.data, np.stack([cell.mask for cell in both]), wavelets, step=config.decimate)
    every = {(cell.scenario, cell.condition): mean for cell, mean in zip(both, means, strict=True)}
    maps = {(cell.scenario, cell.condition): every.pop((cell.scenario, cell.condition)) for cell in cells}
    counts = {(cell.scenario, cell.condition): (cell.n, shortest_gap_s(trials.table[cell.mask])) for cell in both}
    names = trials.info["ch_names"]
    axes = {"channel": names, "frequency_hz": wavelets.frequencies, "times": trials.times[:: config.decimate]}
    contrast_tables.write_magnitudes(maps, counts, axes, out / "ersp.parquet")
    if strata:
        path, table = out / "ersp_strata.parquet", contrast_tables.ERSP_STRATA_SUBJECT
        contrast_tables.write_magnitudes(every, counts, axes, path, table)
    write_table(contrast_tables.positions(trials.info), out / "channels.parquet", contrast_tables.CHANNELS)

    gap = shortest_gap_s(trials.table)
    shown, missing = _figure_channels(config, names)
    drawing = ersp_figures.Drawing(axes, shown, gap)
    drawing.subject(maps, config.contrasts, out / "ersp_subject.png", unit=inputs.unit)
    trial_counts: dict[str, dict[str, int]] = {}
    for cell in cells:
        trial_counts.setdefault(cell.scenario, {})[cell.condition] = cell.n
    return {
        "trials": trial_counts,
        "frequencies_hz": list(wavelets.frequencies),
        "shortest_gap_s": None if gap != gap else gap,
        "warnings": warnings + notes + missing,
    }


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Average over subjects, test the contrasts, and draw the lower halves of the paper's Figs 2 and 3."""
    from hrcneuro.eeg.selection import ALL
    from hrcneuro.figures import ersp as ersp_figures
    from hrcneuro.tables import contrasts as contrast_tables

    averages, axes, gap, lost = _read_group(inputs)
    pairs = group_contrasts.in_order((pair for maps in averages.values() for pair in maps), config.conditions)
    contrast_tables.write_grand(averages, pairs, axes, out / "ersp.parquet", contrast_tables.ERSP)
    adjacency = _adjacency(inputs, axes) if config.correction == "cluster" else None
    tested = list(group_contrasts.over_subjects(averages, config, adjacency))
    contrast_tables.write_tested(tested, axes, out / "ersp_stats.parquet", contrast_tables.ERSP_STATS)

    shown, missing = _figure_channels(config, axes["channel"])
    drawing = ersp_figures.Drawing(axes, shown, gap)
    test = group_contrasts.named_test(config, subjects=len(averages))
    drawing.group([t for t in tested if t.scenario == ALL], out / "ersp.png", test=test)
    apart = [t for t in tested if t.scenario != ALL]
    order = list(config.contrasts)
    drawing.group(
        sorted(apart, key=lambda t: (order.index(t.name), t.scenario)),
        out / "ersp_scenarios.png",
        test=test,
    )
    labels = {"channel": axes["channel"], "frequency_hz": axes["frequency_hz"], "time_s": axes["times"]}
    summary = group_contrasts.group_summary(averages, tested, labels, config)
    strata = _read_strata(inputs, axes["channel"])
    within = list(group_contrasts.over_subjects(strata, config, adjacency))
    contrast_tables.write_tested(within, axes, out / "ersp_strata.parquet", contrast_tables.ERSP_STRATA)
    drawing.group(group_contrasts.held_by_half(within, len(averages)), out / "ersp_strata.png", test=test)
    warnings = lost + summary["warnings"] + missing
    return summary | {"strata": contrast_strata.summary(within, labels), "warnings": warnings}


def _wavelets(config: Config, sfreq: float) -> Wavelets:
    import numpy as np

    from hrcneuro.eeg.morlet import Wavelets, linear_cycles

    count = int((config.high_hz - config.low_hz) / config.step_hz + 1 + 1e-9)
    frequencies = tuple(float(f) for f in config.low_hz + config.step_hz * np.arange(count))
    cycles = linear_cycles(frequencies, first=config.low_cycles, last=config.high_cycles)
    try:
        return Wavelets(frequencies, cycles, sfreq, config.kernel_s)
    except ValueError as error:
        raise ConfigError(str(error), cure="lower ersp.high_hz, or raise preprocess.sfreq") from error


def _figure_channels(config: Config, names: list[str]) -> tuple[list[str], list[str]]:
    """Return the channels to draw, and a sentence on those that are not there."""
    from hrcneuro.eeg.selection import nearest_channel

    by_lower = {name.lower(): name for name in names}
    shown = [by_lower[wanted.lower()] for wanted in config.channels if wanted.lower() in by_lower]
    missing = [wanted for wanted in config.channels if wanted.lower() not in by_lower]
    shown = shown or [nearest_channel(config.channels[0], names)]
    return shown, [f"the figures lack {', '.join(missing)}: no such channel"] if missing else []


def _read_group(
    inputs: Inputs,
) -> tuple[dict[str, dict[tuple[str, str], NDArray[np.float32]]], dict[str, Any], float, list[str]]:
    """Return subject -> maps on shared channels, their axes, the shortest gap, and warnings."""
    from hrcneuro.tables.contrasts import read_magnitudes

    found = {u: read_magnitudes(inputs.path("ersp", "ersp.parquet", unit=u)) for u in inputs.units("ersp")}
    shared, lost = alike.shared_channels({unit: axes["channel"] for unit, (_, axes, _) in found.items()})
    alike.require_same_times(inputs, {unit: axes["times"] for unit, (_, axes, _) in found.items()})
    averages = {}
    for unit, (maps, axes, _) in found.items():
        picked = [axes["channel"].index(name) for name in shared]
        averages[unit] = {pair: value[picked] for pair, value in maps.items()}
    gaps = [gap for _, _, gap in found.values() if gap == gap]
    _, first, _ = next(iter(found.values()))
    return averages, first | {"channel": shared}, min(gaps, default=float("nan")), lost


def _read_strata(inputs: Inputs, names: list[str]) -> dict[str, dict[tuple[str, str], NDArray[np.float32]]]:
    """Return subject -> maps within strata on these channels; subjects without any are left out."""
    from hrcneuro.tables.contrasts import read_magnitudes

    found = {}
    for unit in inputs.units("ersp"):
        if inputs.has("ersp", "ersp_strata.parquet", unit=unit):
            maps, axes, _ = read_magnitudes(inputs.path("ersp", "ersp_strata.parquet", unit=unit))
            picked = [axes["channel"].index(name) for name in names]
            found[unit] = {pair: value[picked] for pair, value in maps.items()}
    return found


def _adjacency(inputs: Inputs, axes: dict[str, Any]) -> Any:
    import mne

    from hrcneuro.io.tables import read_table

    table = read_table(inputs.path("ersp", "channels.parquet", unit=inputs.units("ersp")[0])).set_index("channel")
    channels = group_contrasts.channel_adjacency(table.loc[axes["channel"], ["x_m", "y_m", "z_m"]])
    return mne.stats.combine_adjacency(channels, len(axes["frequency_hz"]), len(axes["times"]))


STAGE = Stage(
    name="ersp",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "pyarrow", "mne", "matplotlib"),
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
