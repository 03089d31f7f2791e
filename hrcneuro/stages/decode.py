"""decode: how well anticipated takeovers are told from continuation, trial by trial (paper 2.5.4, 2.6.2)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.analyses import conditions as configured
from hrcneuro.contract import Inputs, Of, Read, Stage, Work, option
from hrcneuro.decoding.recipes import BUILTIN, Recipe, misfits
from hrcneuro.errors import ConfigError, did_you_mean
from hrcneuro.paradigm.design import CONDITIONS, PROBLEMS

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    from hrcneuro.decoding.problem import Trials


FIGURES = {
    "decoding.png": "Balanced accuracy of every subject with its 95 % interval, the group's mean and the published one"
}

_CONDITIONS = {name: CONDITIONS[name] for pair in PROBLEMS.values() for name in pair}


@dataclass(frozen=True)
class Config:
    """Cross-validation, classifier and chance."""

    conditions: dict[str, str] = option(
        _CONDITIONS, "condition -> pandas query on the trial table", shared="conditions"
    )
    problems: dict[str, tuple[str, ...]] = option(
        PROBLEMS, "decoding problem -> [class 1, class 2 (takeover)]", shared="problems"
    )
    split: str = option("scenario", "trial column whose values are decoded apart; empty for none", shared="split")
    decoders: tuple[str, ...] = option(
        ("rlda", "rlda_600"), "names of recipes; the first enters the summary, the others are compared with it"
    )
    recipes: dict[str, Recipe] = option({}, "recipes of your own, [decode.recipes.NAME], beside the built-in ones")
    mean_window_s: tuple[float, ...] = option((0.0, 0.8), "start and end of the mean that is removed", unit="s")
    shrinkage: float = option(0.9, "lambda of the regularised LDA", low=0, high=1, open_low=True)
    folds: int = option(10, "folds; fewer where the smaller class has fewer trials", low=2, high=1000)
    repeats: int = option(10, "how often the folds are drawn anew", low=1, high=1000)
    balance: str = option(
        "undersample",
        "how training sets are balanced; oversampling biases towards the larger class",
        choices=("undersample", "oversample", "none"),
    )
    permutations: int = option(199, "label permutations for a subject's p value; 0 for none", low=0, high=100000)
    min_stratum: int = option(5, "trials a class below which a stratum is not scored", low=1)
    seed: int = option(2023, "seed of folds, draws and permutations", low=0)


def check(config: Config) -> list[str]:
    """Return what is contradictory in the section."""
    found = []
    known = {**BUILTIN, **config.recipes}
    for name in config.decoders:
        if name not in known:
            hint = did_you_mean(name, known)
            found.append(f"decoders names {name!r}{hint}, which is no recipe; allowed: {', '.join(known)}")
    for name, recipe in config.recipes.items():
        found += [f"recipes.{name}.{misfit}" for misfit in misfits(recipe)]
    if not config.decoders or len(set(config.decoders)) < len(config.decoders):
        found.append(f"decoders = {list(config.decoders)}: give at least one name, and each only once")
    for problem, classes in config.problems.items():
        if len(classes) != 2 or classes[0] == classes[1]:
            found.append(f"problem {problem} = {list(classes)}: it needs two different conditions")
        for name in classes:
            if name not in config.conditions:
                hint = did_you_mean(name, config.conditions)
                found.append(f"problem {problem} names the condition {name!r}{hint}, which is not in [conditions]")
    if len(config.mean_window_s) != 2 or config.mean_window_s[0] >= config.mean_window_s[-1]:
        found.append(f"mean_window_s = {list(config.mean_window_s)}: give start and end, start first")
    return found


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Decode every problem of one subject in each scenario."""
    import numpy as np

    from hrcneuro.decoding import problem as problems
    from hrcneuro.decoding.decoders import Decoders
    from hrcneuro.eeg.selection import ALL
    from hrcneuro.io.trials import read_trials
    from hrcneuro.tables.decode import SubjectTables

    epochs = read_trials(inputs)
    table = epochs.table
    members = _members(config, table)
    tables = SubjectTables(config.decoders[0])
    if not config.problems:
        tables.warn("no decoding problems are configured: nothing was decoded")
    scheme = problems.Scheme(config.folds, config.repeats, config.balance, config.permutations, config.min_stratum)
    decoders = Decoders(
        {name: {**BUILTIN, **config.recipes}[name] for name in config.decoders},
        epochs_uv=lambda rows: epochs.data[rows],
        times_s=epochs.times,
        mean_window_s=(config.mean_window_s[0], config.mean_window_s[1]),
        shrinkage=config.shrinkage,
    )
    for scenario, inside in configured.scenarios(table, config.split) or [(ALL, np.ones(len(table), bool))]:
        for name, (class1, class2) in config.problems.items():
            rows = np.flatnonzero(inside & (members[class1] | members[class2]))
            trials = _trials(table.iloc[rows], members[class2][rows])
            rng = np.random.default_rng([config.seed, *inputs.unit.encode(), 0, *scenario.encode(), 0, *name.encode()])
            plan = problems.draw_plan(trials, scheme, rng)
            place = tables.open(scenario, name, (class1, class2), trials, plan, table.iloc[rows])
            if not plan.shuffled:
                continue
            for decoder, score, quick in decoders.of(rows):
                place.add(decoder, problems.decode(trials, plan, scheme, score, permute=quick), permuted=quick)
    tables.write(out)
    return tables.summary()


def run_group(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Put the subjects together: Table 2 beside the published one, tests, and a figure."""
    import pandas as pd

    from hrcneuro.analyses import decode_group
    from hrcneuro.io.tables import read_table

    scores = pd.concat(
        [
            read_table(inputs.path("decode", "scores.parquet", unit=unit)).assign(subject=unit)
            for unit in inputs.units("decode")
        ],
        ignore_index=True,
    )
    return decode_group.write(scores, config, config.seed, out)


def _members(config: Config, table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return condition -> which rows belong to it, for the conditions that problems use."""
    used = {name for classes in config.problems.values() for name in classes}
    found = configured.matching(table, {name: query for name, query in config.conditions.items() if name in used})
    for problem, classes in config.problems.items():
        both = int((found[classes[0]] & found[classes[1]]).sum())
        if both:
            raise ConfigError(
                f"problem {problem}: {both} trials belong to both {classes[0]} and {classes[1]}",
                cure="make the two conditions exclude each other",
            )
    return found


def _trials(rows: pd.DataFrame, labels: np.ndarray) -> Trials:
    """Return the problem's trials; columns that a study does not have are left out."""
    import pandas as pd

    from hrcneuro.decoding.problem import CUES, Trials

    blocks = rows["block"] if "block" in rows and rows["block"].notna().all() else None
    cues = {cue: rows[cue].to_numpy(dtype=bool) for cue in CUES if cue in rows and rows[cue].notna().all()}
    return Trials(labels, None if blocks is None else pd.factorize(blocks, sort=True)[0], cues)


STAGE = Stage(
    name="decode",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "mne", "pyarrow", "scikit-learn", "pyriemann", "matplotlib"),
    check=check,
    subject=Work(run, (Read("epoch", ("*_epo*.fif",)),)),
    group=Work(run_group, (Read("decode", ("scores.parquet",), Of.INCLUDED),)),
)
