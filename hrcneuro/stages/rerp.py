"""rerp: potentials by regression on what is known of every trial, with neighbours' responses in the same model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro import published
from hrcneuro.analyses import contrasts as of_contrasts
from hrcneuro.analyses import onsets, predictors, regressions, shared_axes
from hrcneuro.analyses.group_tests import FlipOptions, size_warnings
from hrcneuro.contract import Inputs, Of, Read, Stage, Work, option
from hrcneuro.errors import ConfigError
from hrcneuro.paradigm import design

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from hrcneuro.eeg.formula import Predictors
    from hrcneuro.eeg.selection import LabelledEpochs
    from hrcneuro.tables.rerp import Part

    Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Config(FlipOptions):
    """The model, and how its coefficients are tested; below, what the pictures show."""

    formula: str = option(
        "actor / takeover + error + prev_error + turn + soa",
        "right side of a Wilkinson formula on the trial table, takeover (the other partner is next) and soa (soa_s "
        "about its mean, in tenths of a second)",
    )
    overlap: str = option(
        "regress",
        "responses to neighbouring onsets: regress them out in the same model, or keep them",
        choices=("regress", "keep"),
    )
    baseline_s: tuple[float, ...] = option(
        published.BASELINE_S.value, "start and end of the mean that is subtracted from each coefficient", unit="s"
    )
    conditions: dict[str, str] = option(
        design.CONDITIONS, "condition -> pandas query on the trial table", shared="conditions"
    )
    contrasts: dict[str, tuple[str, ...]] = option(
        design.CONTRASTS, "contrast -> [plus, minus], names of conditions", shared="contrasts"
    )
    split: str = option("scenario", "trial column whose values are fitted apart; empty for none", shared="split")
    parts: tuple[str, ...] = option(
        ("*_before",), "which contrasts are taken into the parts of the predictors, as patterns of their names"
    )
    channel: str = option("Cz", "channel of the waveforms in the figures", drawing=True)


def check(config: Config) -> list[str]:
    """Return what is contradictory in the section."""
    if len(config.baseline_s) != 2 or config.baseline_s[0] >= config.baseline_s[1]:
        return [f"baseline_s = {list(config.baseline_s)}: give [start, end] with start before end"]
    return []


def ready(config: Config) -> None:
    """Refuse a formula before anything runs: by the columns of trial tables, and by the rules of the study's task."""
    predictors.check_formula(config.formula)
    if config.split == "scenario":
        predictors.check_study(config.formula)


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Fit one subject's trials, those of each scenario apart."""
    import numpy as np

    from hrcneuro.eeg.selection import ALL, shortest_gap_s
    from hrcneuro.io.tables import write_table
    from hrcneuro.io.trials import read_trials
    from hrcneuro.tables import rerp as tables
    from hrcneuro.tables.contrasts import CHANNELS, positions

    trials = read_trials(inputs)
    table = predictors.with_derived(trials.table)
    others, rows = onsets.without_epoch(inputs, trials) if config.overlap == "regress" else (None, table[:0])
    rows = predictors.with_derived(rows)
    maps: dict[tuple[str, str], Floats] = {}
    fitted: dict[str, Predictors] = {}
    parts: list[Part] = []
    for scenario, members in regressions.fitted_together(table, config.split):
        whose = f"{inputs.unit}, {scenario}"
        inside = np.ones(len(rows), bool) if scenario == ALL else rows[config.split].eq(scenario).to_numpy(bool)
        own, known = predictors.predictors_of(config.formula, table[members], whose, rows[inside])
        beside = None if others is None else regressions.around(trials, members, others, inside, known)
        coefficients = _baselined(regressions.coefficients(trials, members, own, beside, whose), trials.times, config)
        fitted[scenario] = own
        named = dict(zip(own.names, coefficients, strict=True))
        maps |= {(scenario, name): one for name, one in named.items()}
        parts += _parts(config, trials, table, members, own, named, scenario)
    axes = {"channel": trials.info["ch_names"], "times": trials.times}
    gap = float("nan") if others is not None else shortest_gap_s(trials.table)
    tables.write_coefficients(maps, axes, gap, out / "rerp.parquet")
    tables.write_predictors(fitted, out / "predictors.parquet")
    tables.write_parts(parts, axes, out / "parts.parquet")
    write_table(positions(trials.info), out / "channels.parquet", CHANNELS)
    labels = {"channel": trials.info["ch_names"], "time_s": trials.times}
    return {
        "formula": config.formula,
        "overlap": config.overlap,
        "trials": {scenario: int(one.known.sum()) for scenario, one in fitted.items()},
        "unknown": {scenario: int((~one.known).sum()) for scenario, one in fitted.items()},
        "coefficients": {
            scenario: {
                name: {
                    "nonzero": int(np.count_nonzero(one.values[one.known, i])),
                    "inflation": of_contrasts.jsonable(one.inflation[i]),
                    "peak": of_contrasts.peak_of(maps[scenario, name], labels)[0],
                }
                for i, name in enumerate(one.names)
            }
            for scenario, one in fitted.items()
        },
        "shortest_gap_s": of_contrasts.jsonable(gap),
        "warnings": regressions.inflated(fitted),
    }


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Test every coefficient over subjects, and average what plain differences are made of."""
    from hrcneuro.io.tables import read_table, write_table
    from hrcneuro.tables import rerp as tables
    from hrcneuro.tables.contrasts import CHANNELS

    units = inputs.units("rerp")
    subjects = {unit: tables.read_coefficients(inputs.path("rerp", "rerp.parquet", unit=unit)) for unit in units}
    shared, lost = shared_axes.shared_channels({unit: own.channels for unit, own in subjects.items()})
    shared_axes.require_same_times(inputs, {unit: own.times for unit, own in subjects.items()})
    maps = {
        unit: {key: one[[own.channels.index(name) for name in shared]] for key, one in own.maps.items()}
        for unit, own in subjects.items()
    }
    first = next(iter(subjects.values()))
    axes = {"channel": shared, "times": first.times}
    channels = read_table(inputs.path("rerp", "channels.parquet", unit=units[0])).set_index("channel").loc[shared]
    adjacency = None
    if config.correction == "cluster":
        import mne

        neighbours = of_contrasts.channel_adjacency(channels[["x_m", "y_m", "z_m"]])
        adjacency = mne.stats.combine_adjacency(neighbours, len(first.times))
    tested = list(regressions.over_subjects(maps, config, adjacency))
    gap = min((own.gap_s for own in subjects.values()), default=float("nan"))
    tables.write_tested(tested, axes, out / "rerp_stats.parquet", subjects=len(units), gap_s=gap)
    parts = [tables.read_parts(inputs.path("rerp", "parts.parquet", unit=unit), shared) for unit in units]
    tables.write_group_parts(parts, axes, out / "rerp_parts.parquet")
    write_table(channels.reset_index(), out / "channels.parquet", CHANNELS)
    found: dict[str, dict[str, Any]] = {}
    for one in tested:
        labels: dict[str, Any] = {"channel": shared, "time_s": first.times}
        found.setdefault(one.scenario, {})[one.name] = of_contrasts.contrast_summary(one, labels)
    lacking = [
        f"{one.scenario}, {one.name}: without {', '.join(sorted(set(units) - set(one.units)))}, whose trials lack it "
        f"(n = {len(one.units)})"
        for one in tested
        if set(units) - set(one.units)
    ]
    alone = "a coefficient of one subject cannot be tested: it is descriptive"
    return {
        "subjects": list(units),
        "formula": config.formula,
        "overlap": config.overlap,
        "correction": config.correction,
        "alpha": config.alpha,
        "coefficients": found,
        "shortest_gap_s": of_contrasts.jsonable(gap),
        "warnings": lost + lacking + size_warnings((one.result.n for one in tested), config.alpha, of_one=alone),
    }


def _baselined(maps: Floats, times: Floats, config: Config) -> Floats:
    from hrcneuro.eeg.evoked import subtract_baseline

    start, stop = config.baseline_s
    try:
        return subtract_baseline(maps, times, (start, stop))
    except ValueError as error:
        raise ConfigError(str(error), cure="move rerp.baseline_s into the epochs, or widen them (epoch)") from error


def _parts(
    config: Config,
    trials: LabelledEpochs,
    table: pd.DataFrame,
    members: NDArray[np.bool_],
    own: Predictors,
    coefficients: dict[str, Floats],
    scenario: str,
) -> list[Part]:
    """Return what the plain differences of one scenario are made of, among the trials of which all is known."""
    import numpy as np

    from hrcneuro.analyses.conditions import matching
    from hrcneuro.eeg.evoked import averages

    contrasts = regressions.chosen_contrasts(config.contrasts, config.parts)
    names = {name for pair in contrasts.values() for name in pair}
    wanted = {name: query for name, query in config.conditions.items() if name in names}
    sets = {name: mask[members] & own.known for name, mask in matching(table, wanted).items()}
    sets = {name: mask for name, mask in sets.items() if mask.any()}
    if not sets:
        return []
    means = _baselined(averages(trials.data[members], np.stack(list(sets.values()))), trials.times, config)
    return regressions.parts(
        dict(zip(sets, means, strict=True)),
        {name: own.values[mask].mean(axis=0) for name, mask in sets.items()},
        coefficients,
        contrasts,
        scenario,
    )


STAGE = Stage(
    name="rerp",
    title="Potentials by regression",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "pyarrow", "mne", "formulaic"),
    check=check,
    subject=Work(
        run,
        (
            Read("epoch", ("*_epo*.fif",)),
            # The onsets without an epoch.
            Read("acquire", ("trials.parquet",)),
            Read("preprocess", ("*_clean_raw*.fif", "timing.parquet")),
        ),
    ),
    group=Work(
        run_group,
        (
            Read("rerp", ("rerp.parquet", "parts.parquet", "channels.parquet"), Of.INCLUDED),
            Read("preprocess", ("timing.parquet",), Of.INCLUDED),
        ),
    ),
    ready=ready,
    on_demand=True,
)
