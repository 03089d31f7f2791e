"""What a regression knows of every trial: the columns of the trial table, and two that follow from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hrcneuro.errors import ConfigError, did_you_mean

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from hrcneuro.eeg.formula import Predictors

    Floats = NDArray[np.float64]

DERIVED = {
    "takeover": "the other partner makes the next move, 1 or 0; 0 where this move is an error, since the paper's pairs "
    "have none as their first move (§2.5.1); unknown of an episode's last move",
    "soa": "soa_s less its mean over the trials that have one, in tenths of a second",
}
"""Columns that a formula may name beside those of the trial table."""

_SESSIONS = 3


def known_columns() -> tuple[str, ...]:
    """Return the columns that a formula may name, whatever the study."""
    from hrcneuro.tables.trials import TRIALS

    return (*TRIALS.columns, *DERIVED)


def check_formula(formula: str) -> None:
    """Refuse a formula that cannot be read or names a column that no trial table has.

    Raises:
        ConfigError: As said.
    """
    from hrcneuro.eeg.formula import FormulaError, columns_of

    try:
        named = columns_of(formula)
    except FormulaError as error:
        raise ConfigError(f"rerp.formula = {error}", cure=_example()) from error
    known = known_columns()
    for name in named:
        if name not in known:
            raise ConfigError(
                f"rerp.formula = {formula!r} names the column {name!r}{did_you_mean(name, known)}, which no trial "
                "table has",
                cure=f"use columns among {', '.join(known)}",
            )


def check_study(formula: str) -> None:
    """Refuse a formula whose predictors cannot be told apart by the rules of the study's own task.

    They are tried on a few simulated sessions, before anything is recorded or computed: what is rare, as a wrong key,
    is in one of them.

    Raises:
        ConfigError: As said.
    """
    import numpy as np
    import pandas as pd

    from hrcneuro.eeg.epochs import candidates
    from hrcneuro.paradigm.params import SessionParams, TimingParams
    from hrcneuro.paradigm.session import simulate_session
    from hrcneuro.tables.trials import study_trials

    tables = []
    for seed in range(_SESSIONS):
        moves = simulate_session(SessionParams(), rng=np.random.default_rng(seed), timing=TimingParams())
        table = with_derived(study_trials(moves, f"simulated {seed}", None))
        tables.append(table.loc[candidates(table).index])
    for scenario, rows in pd.concat(tables, ignore_index=True).groupby("scenario"):
        predictors_of(formula, rows, f"simulated sessions of the study's task, {scenario}")


def with_derived(table: pd.DataFrame) -> pd.DataFrame:
    """Return the trial table with :data:`DERIVED`, truth as 0 and 1, and None for NaN in columns of words.

    Args:
        table: All trials, in order.
    """
    import numpy as np
    import pandas as pd

    from hrcneuro.eeg.selection import FLAGS

    lacking = {*FLAGS, "soa_s", "actor", "condition_before"} - set(table.columns)
    table = table.assign(**dict.fromkeys(sorted(lacking)))
    flags = {name: pd.to_numeric(table[name].astype(object), errors="coerce").astype(float) for name in FLAGS}
    follows = table["soa_s"].notna() & table["actor"].notna() & (flags["practice"] == 0)
    handed = table["condition_before"].isin(["HR", "RH"]).astype(float)
    soa = pd.to_numeric(table["soa_s"], errors="coerce").astype(float)
    return table.assign(**flags, takeover=handed.where(follows, np.nan), soa=soa)


def predictors_of(
    formula: str, table: pd.DataFrame, whose: str, others: pd.DataFrame | None = None
) -> tuple[Predictors, Floats]:
    """Return the predictors of trials that are fitted together, and those of other onsets beside them.

    Args:
        formula: Right side of a Wilkinson formula.
        table: Those trials, as :func:`with_derived` returns them.
        whose: Named in errors: ``s01, iC``.
        others: Onsets without an epoch, likewise.

    Returns:
        Of the trials, and of the others an ndarray, shape (n_others, n_predictors), NaN where something is unknown.

    Raises:
        ConfigError: The formula does not fit the table, or its predictors cannot be told apart there.
    """
    import numpy as np
    import pandas as pd

    from hrcneuro.eeg.formula import AbsentColumnError, FormulaError, Predictors, SingularError, predictors

    every = table if others is None or others.empty else pd.concat([table, others], ignore_index=True)
    centred = every.assign(soa=10 * (every["soa"] - table["soa"].mean()))
    try:
        made = predictors(formula, centred, np.arange(len(every)) < len(table))
    except AbsentColumnError as error:
        raise ConfigError(
            f"{whose}: rerp.formula = {error}", cure=f"leave it out, or use columns with values: {_valued(table)}"
        ) from error
    except SingularError as error:
        raise ConfigError(
            f"{whose}: the predictors cannot be told apart; rerp.formula = {error}",
            cure="leave one of them out of rerp.formula, or fit more trials together (study.split)",
        ) from error
    except FormulaError as error:
        raise ConfigError(f"{whose}: rerp.formula = {error}", cure=_example()) from error
    return Predictors(made.names, made.values[: len(table)]), made.values[len(table) :]


def _valued(table: pd.DataFrame) -> str:
    return ", ".join(str(name) for name in table if table[name].notna().any() and table[name].nunique() > 1)


def _example() -> str:
    return "write terms joined by +, : (product), * (both and product) or / (within), such as 'actor / takeover + turn'"
