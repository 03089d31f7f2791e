"""decode: how well anticipated takeovers are told from continuation, trial by trial (paper 2.5.4, 2.6.2)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.analyses import conditions as configured
from hrcneuro.analyses import event_times
from hrcneuro.contract import Inputs, Of, Read, Stage, Work, option
from hrcneuro.decoding.recipes import BUILTIN, Recipe, misfits
from hrcneuro.decoding.refusals import (
    EmptyWindowError,
    EstimatorError,
    MissingLibraryError,
    NoSignalError,
    NotFiniteTrialsError,
    TwinTrialsError,
    VoltsError,
    WindowOutsideError,
)
from hrcneuro.decoding.scheme import Scheme
from hrcneuro.errors import ConfigError, Cures, DataError, cured, did_you_mean
from hrcneuro.paradigm.design import CUES, DECODED, PROBLEMS

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    from hrcneuro.decoding.problem import LabelledTrials


_CURES: Cures = {
    WindowOutsideError: (DataError, "make the epochs longer (epoch.tmin, epoch.tmax) or the window shorter"),
    EmptyWindowError: (DataError, "use a higher sampling rate"),
    NotFiniteTrialsError: (
        DataError,
        "look at the upstream stages: name the channel as bad (acquire.bads), then decode again",
    ),
    NoSignalError: (
        DataError,
        "look at quality.png of preprocess: all channels are flat, or the only one was referenced to itself "
        "(preprocess.reference)",
    ),
    VoltsError: (
        DataError,
        "they seem to be in volts: multiply by 1e6 (the regularisation has a unit: microvolt squared)",
    ),
    TwinTrialsError: (DataError, "make one event of them (acquire.twins = 'merge')"),
    EstimatorError: (ConfigError, "correct [decode.recipes]"),
    MissingLibraryError: (ConfigError, "pip install pyriemann, or leave xdawn_tangent out of decode.decoders"),
}


@dataclass(frozen=True)
class Config(Scheme):
    """What is decoded, by which decoders; how, is the scheme's."""

    conditions: dict[str, str] = option(DECODED, "condition -> pandas query on the trial table", shared="conditions")
    problems: dict[str, tuple[str, ...]] = option(
        PROBLEMS, "decoding problem -> [class 1, class 2 (takeover)]", shared="problems"
    )
    split: str = option("scenario", "trial column whose values are decoded apart; empty for none", shared="split")
    decoders: tuple[str, ...] = option(
        ("rlda", "rlda_600"), "names of recipes; the first is the study's, the others are compared with it"
    )
    recipes: dict[str, Recipe] = option({}, "recipes of your own, [decode.recipes.NAME], beside the built-in ones")
    seed: int = option(2023, "seed of folds, draws and permutations", low=0)

    @property
    def known(self) -> dict[str, Recipe]:
        """The built-in recipes and those of the configuration, by name."""
        return {**BUILTIN, **self.recipes}

    @property
    def foreign(self) -> dict[str, Recipe]:
        """The recipes that run and whose estimator is not of this program, by name."""
        return {name: self.known[name] for name in self.decoders if self.known[name].foreign}


def check(config: Config) -> list[str]:
    """Return what is contradictory in the section."""
    mistakes = []
    known = config.known
    for name in config.decoders:
        if name not in known:
            hint = did_you_mean(name, known)
            mistakes.append(f"decoders names {name!r}{hint}, which is no recipe; allowed: {', '.join(known)}")
    for name, recipe in config.recipes.items():
        mistakes += [f"recipes.{name}.{misfit}" for misfit in misfits(recipe)]
    if not config.decoders or len(set(config.decoders)) < len(config.decoders):
        mistakes.append(f"decoders = {list(config.decoders)}: give at least one name, and each only once")
    if len(config.mean_window_s) != 2 or config.mean_window_s[0] >= config.mean_window_s[-1]:
        mistakes.append(f"mean_window_s = {list(config.mean_window_s)}: give start and end, start first")
    return mistakes


def sources(config: Config, unit: str) -> dict[str, Path]:
    """Return label -> the user's own Python files, whose content decides the result.

    Raises:
        ConfigError: One is not there.
    """
    from hrcneuro.analyses import estimators

    found: dict[str, Path] = {}
    for name, recipe in config.foreign.items():
        if recipe.file:
            file = Path(recipe.file)
            if not file.is_file():
                raise ConfigError(
                    f"{file}, the file of {recipe.estimator}, does not exist", cure="correct [decode.recipes]"
                )
            found |= {f"{name}/{one}": path for one, path in estimators.files(file).items()}
    return found


def ready(config: Config) -> None:
    """Make each estimator of other people once.

    Raises:
        ConfigError: Some cannot be imported or made, each with its recipe's name.
    """
    from hrcneuro.analyses import estimators

    sources(config, "")
    mistakes = []
    for name, recipe in config.foreign.items():
        try:
            if not recipe.file:
                estimators.distribution(recipe.estimator)
            estimators.maker(recipe, seed=config.seed)
        except EstimatorError as error:
            mistakes.append(f"decode.recipes.{name}: {error}")
    if mistakes:
        raise ConfigError("\n".join(mistakes), cure="correct [decode.recipes]")


def packages(config: Config) -> tuple[str, ...]:
    """Return the installed distributions of estimators, whose version decides the result.

    Raises:
        ConfigError: An import path belongs to none.
    """
    from hrcneuro.analyses import estimators

    with cured(_CURES):
        return tuple(
            sorted({estimators.distribution(one.estimator) for one in config.foreign.values() if not one.file})
        )


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Decode every problem of one subject in each scenario.

    Raises:
        DataError: The epochs are too short, at too low a rate, not finite, without a signal or not in microvolt.
        ConfigError: Conditions do not fit the trial table, or an estimator cannot be made.
    """
    import numpy as np

    from hrcneuro.analyses import estimators
    from hrcneuro.analyses.decode_subject import SubjectRows
    from hrcneuro.decoding import crossval, patterns
    from hrcneuro.decoding import problem as problems
    from hrcneuro.decoding.decoders import Decoders
    from hrcneuro.eeg.selection import ALL
    from hrcneuro.io.tables import write_table
    from hrcneuro.io.trials import read_trials
    from hrcneuro.tables.contrasts import CHANNELS, positions

    epochs = read_trials(inputs)
    table = epochs.table
    members, onsets_s = configured.classes(table, config.conditions, config.problems), event_times.marked_s(epochs)
    absent = configured.absent(table, config.conditions, members)
    rows_of = SubjectRows(config.decoders[0])
    rows_of.warnings += [f"no trial is of {text}" for text in absent.values()]
    if not config.problems:
        rows_of.warnings.append("no decoding problems are configured: nothing was decoded")
    with cured(_CURES):
        decoders = Decoders(
            {name: config.known[name] for name in config.decoders},
            epochs_uv=lambda rows: epochs.data[rows],
            times_s=epochs.times,
            scheme=config,
            foreign=estimators.makers(config.foreign, seed=config.seed),
        )
        for scenario, inside in configured.scenarios(table, config.split) or [(ALL, np.ones(len(table), bool))]:
            for name, (class1, class2) in config.problems.items():
                rows = np.flatnonzero(inside & (members[class1] | members[class2]))
                own = crossval.distinct(onsets_s[rows])
                if not own.all():
                    rows_of.warnings.append(_twins(f"{scenario} {name}", (class1, class2), members[class2][rows], own))
                rows = rows[own]
                trials = _trials(table.iloc[rows], members[class2][rows], onsets_s[rows])
                seed = [config.seed, *inputs.unit.encode(), 0, *scenario.encode(), 0, *name.encode()]
                plan = problems.draw_plan(trials, config, np.random.default_rng(seed))
                results = rows_of.begin(scenario, name, (class1, class2), trials, plan, table.iloc[rows])
                if not plan.shuffled:
                    continue
                seen = decoders.features_of(rows)
                for decoder, score, quick in decoders.of(seen):
                    decoded = problems.decode(trials, plan, config, score, permuted=quick)
                    results.add(decoder, decoded, permuted=quick is not None)
                for found in patterns.of_problem(decoders, seen, trials.labels):
                    results.add_patterns(found, epochs.info["ch_names"])
    for file, (schema, frame) in rows_of.tables().items():
        write_table(frame, out / file, schema)
    write_table(positions(epochs.info), out / "channels.parquet", CHANNELS)
    return rows_of.summary() | ({"absent": list(absent.items())} if absent else {})


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Put the subjects together: Table 2 beside the published one, and tests."""
    import pandas as pd

    from hrcneuro.analyses import decode_group
    from hrcneuro.io.tables import read_table, write_table

    scores = pd.concat(
        [
            read_table(inputs.path("decode", "scores.parquet", unit=unit)).assign(subject=unit)
            for unit in inputs.units("decode")
        ],
        ignore_index=True,
    )
    tables = decode_group.tables(scores, config.decoders, config.seed)
    for file, (schema, frame) in tables.items():
        write_table(frame, out / file, schema)
    return decode_group.summary(scores, tables["group_tests.parquet"][1], config.decoders[0])


def _twins(problem: str, classes: tuple[str, str], second: np.ndarray, own: np.ndarray) -> str:
    """Return a sentence on the trials that are left out, since they are events of other trials."""
    from hrcneuro.decoding.crossval import ONE_EVENT_S

    counts = [int((~own & of_class).sum()) for of_class in (~second, second)]
    return (
        f"{problem}: {counts[0]} trials of {classes[0]} and {counts[1]} of {classes[1]} are left out: they begin less "
        f"than {ONE_EVENT_S:g} s after another trial and hold its samples"
    )


def _trials(rows: pd.DataFrame, labels: np.ndarray, onsets_s: np.ndarray) -> LabelledTrials:
    """Return the problem's trials; columns that a study does not have are left out."""
    import pandas as pd

    from hrcneuro.decoding.problem import LabelledTrials

    blocks = rows["block"] if "block" in rows and rows["block"].notna().all() else None
    cues = {cue: rows[cue].to_numpy(dtype=bool) for cue in CUES if cue in rows and rows[cue].notna().all()}
    return LabelledTrials(labels, onsets_s, None if blocks is None else pd.factorize(blocks, sort=True)[0], cues)


STAGE = Stage(
    name="decode",
    title="Single-trial decoding",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "mne", "pyarrow", "scikit-learn", "pyriemann"),
    check=check,
    sources=sources,
    packages=packages,
    ready=ready,
    subject=Work(run, (Read("epoch", ("*_epo*.fif",)),)),
    group=Work(run_group, (Read("decode", ("scores.parquet",), Of.INCLUDED),)),
)
