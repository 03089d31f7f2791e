"""The empirical decoder of the stage simulate: the paper's rates, this run's rates, or this run's held-out trials."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.contract import Inputs
from hrcneuro.errors import DataError, did_you_mean
from hrcneuro.io.tables import read_table
from hrcneuro.learning.decoder import CoinFlips, Decoder
from hrcneuro.learning.params import RateParams, values_of
from hrcneuro.learning.rates import Rates
from hrcneuro.learning.replay import DecodedRepeat, HeldOutTrials, Replay, mean_rates


@dataclass(frozen=True)
class Empirical:
    """What stands for "emp": a decoder, its mean rates, and a decoder for each subject where there are any."""

    decoder: Decoder
    rates: Rates
    subjects: dict[str, Decoder] = field(default_factory=dict)


def empirical(config: Any, inputs: Inputs) -> Empirical:
    """Return the decoder that ``rates`` asks for.

    Raises:
        DataError: This run's decode artifacts lack a subject, a scenario, a problem, a decoder or a rate.
    """
    if config.rates == "paper":
        rates = Rates(**values_of(RateParams, config))
        return Empirical(CoinFlips(rates), rates)
    units = inputs.units("decode")
    if not units:
        raise DataError(
            f"rates = {config.rates!r} needs decoded subjects and there are none",
            cure="run 'hrcneuro decode' first, or use --set simulate.rates=paper",
        )
    if config.rates == "decode":
        by_subject = {unit: _rates(config, inputs, unit) for unit in units}
        # As the paper did: rates averaged over subjects, then simulated.
        rr, rh, hr, hh = (float(v) for v in np.mean([r.by_case for r in by_subject.values()], axis=0))
        rates = Rates(tnr_hh=hh, tpr_hr=hr, tnr_rr=rr, tpr_rh=rh)
        return Empirical(CoinFlips(rates), rates, {unit: CoinFlips(r) for unit, r in by_subject.items()})
    repeats = {unit: _repeats(config, inputs, unit) for unit in units}
    every = [s for some in repeats.values() for s in some]
    return Empirical(Replay(every), mean_rates(every), {unit: Replay(some) for unit, some in repeats.items()})


def _rates(config: Any, inputs: Inputs, unit: str) -> Rates:
    table = read_table(inputs.path("decode", "scores.parquet", unit=unit))
    by_problem: dict[str, tuple[float, float]] = {}
    for problem in (config.after_human, config.after_robot):
        row = _only(table, config, problem, unit).iloc[0]
        if not (np.isfinite(row["tnr"]) and np.isfinite(row["tpr"])):
            raise DataError(
                f"decode of {unit} has no rates of {problem} in scenario {config.scenario}: {row['note']}",
                cure=f"exclude the subject (study.exclude), or look at it: hrcneuro decode {unit}",
            )
        by_problem[problem] = (float(row["tnr"]), float(row["tpr"]))
    (hh, hr), (rr, rh) = by_problem[config.after_human], by_problem[config.after_robot]
    return Rates(tnr_hh=hh, tpr_hr=hr, tnr_rr=rr, tpr_rh=rh)


def _repeats(config: Any, inputs: Inputs, unit: str) -> list[DecodedRepeat]:
    table = read_table(inputs.path("decode", "predictions.parquet", unit=unit))
    human, robot = (_held_out(config, table, problem, unit) for problem in (config.after_human, config.after_robot))
    return [DecodedRepeat(after_robot=robot[r], after_human=human[r]) for r in sorted(robot.keys() & human.keys())]


def _held_out(config: Any, table: pd.DataFrame, problem: str, unit: str) -> dict[int, HeldOutTrials]:
    """Return repeat -> its held-out trials in recorded order."""
    rows = _only(table, config, problem, unit).sort_values(["repeat", "epoch"], kind="stable")
    if rows["label"].nunique() < 2:
        raise DataError(
            f"decode of {unit} holds no trials of one class of {problem} in scenario {config.scenario}",
            cure=f"exclude the subject (study.exclude), or look at it: hrcneuro decode {unit}",
        )
    by_repeat = {}
    for repeat, part in rows.groupby("repeat"):
        block = part["block"].fillna(0).to_numpy(dtype=int)
        by_repeat[int(str(repeat))] = HeldOutTrials(
            part["label"].to_numpy(dtype=int), part["score"].to_numpy(dtype=float), block
        )
    return by_repeat


def _only(table: pd.DataFrame, config: Any, problem: str, unit: str) -> pd.DataFrame:
    """Return the rows of one scenario, problem and decoder."""
    wanted: list[tuple[str, str, Callable[[pd.DataFrame], str]]] = [
        ("scenario", "scenario", lambda _: config.scenario),
        ("problem", "problem", lambda _: problem),
        ("decoder", "decoder", lambda rows: config.decoder or str(rows["decoder"].iloc[0])),
    ]
    for column, what, value_of in wanted:
        have = list(dict.fromkeys(table[column].dropna()))
        value = value_of(table) if have else ""
        if value not in have:
            hint = did_you_mean(value, have)
            raise DataError(
                f"decode of {unit} has no {what} {value!r}{hint}; it has {', '.join(have) or 'none'}",
                cure="decode it (see [problems] and decode.decoders), or name another in [simulate]",
            )
        table = table[table[column] == value]
    return table
