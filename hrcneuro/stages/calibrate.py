"""calibrate: a decoder that can work live, learned from a recording through the filter that a stream goes through."""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.analyses import conditions as configured
from hrcneuro.contract import Inputs, Read, Stage, Work, option, params
from hrcneuro.decoding.frozen_refusals import FewTrialsError
from hrcneuro.decoding.refusals import EmptyWindowError, NotFiniteTrialsError
from hrcneuro.decoding.scheme import SHRINKAGE
from hrcneuro.eeg.params import CausalOptions
from hrcneuro.eeg.refusals import BandError, LoneChannelError, NoPositionError
from hrcneuro.errors import ConfigError, Cures, DataError, cured, did_you_mean
from hrcneuro.paradigm.design import CUES, DECODED, PROBLEMS

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    from hrcneuro.analyses.calibrated import Seen
    from hrcneuro.analyses.calibration_rows import Rows
    from hrcneuro.decoding.frozen import FrozenProblem


_CURES: Cures = {
    BandError: (ConfigError, "set calibrate.l_freq and calibrate.h_freq inside 0–{nyquist:g} Hz"),
    EmptyWindowError: (DataError, "record at a higher sampling rate"),
    NotFiniteTrialsError: (DataError, "look at the recording: hrcneuro acquire SUBJECT --inspect"),
    FewTrialsError: (
        DataError,
        "calibrate on more blocks (calibrate.blocks, calibrate.scenarios), or with fewer strata (calibrate.matched)",
    ),
    NoPositionError: (DataError, "give positions (acquire.montage)"),
    LoneChannelError: (DataError, "set calibrate.reference = 'none'"),
}


@dataclass(frozen=True)
class Config(CausalOptions):
    """What the decoder learns from, and how."""

    conditions: dict[str, str] = option(DECODED, "condition -> pandas query on the trial table", shared="conditions")
    problems: dict[str, tuple[str, ...]] = option(
        PROBLEMS, "decoding problem -> [class 1, class 2 (takeover)]", shared="problems"
    )
    split: str = option("scenario", "trial column that scenarios are values of; empty for none", shared="split")
    scenarios: tuple[str, ...] = option((), "values of that column whose trials count, such as iC; none: all")
    blocks: tuple[int, ...] = option((), "main blocks whose trials count; none: all", low=1)
    matched: tuple[str, ...] = option(
        (), "cues (prev_error, turn) within whose strata both classes train with equally many trials; none: plain"
    )
    shrinkage: float = option(SHRINKAGE, "lambda of the regularised LDA", low=0, high=1, share=True, open_low=True)
    draws: int = option(10, "balanced training sets that are drawn; the decoder is their mean", low=1, high=1000)
    min_stratum: int = option(5, "trials a class below which a stratum is not scored", low=1)
    seed: int = option(2023, "seed of the draws", low=0)


def check(config: Config) -> list[str]:
    """Return what is contradictory in the section."""
    mistakes = [
        f"matched names {cue!r}{did_you_mean(cue, CUES)}; allowed: {', '.join(CUES)}, each once"
        for cue in dict.fromkeys(config.matched)
        if cue not in CUES or config.matched.count(cue) > 1
    ]
    mistakes += config.of_band()
    if config.scenarios and not config.split:
        mistakes.append(f"scenarios = {list(config.scenarios)}, and study.split, the column of scenarios, is empty")
    return mistakes


def run(config: Config, inputs: Inputs, out: Path) -> dict[str, Any]:
    """Write a subject's frozen decoder, and how such decoders do on blocks that they have not seen.

    Raises:
        DataError: There are too few trials, the recording is too slow, or channels do not fit what preprocess said.
        ConfigError: Conditions do not fit the trial table, or the band not the sampling rate.
    """
    from dataclasses import replace

    import mne

    from hrcneuro.analyses import calibrated
    from hrcneuro.analyses.calibration_rows import Rows
    from hrcneuro.io.decoders import write_decoder
    from hrcneuro.io.fif import read_raw
    from hrcneuro.io.tables import read_table, write_table
    from hrcneuro.tables.contrasts import CHANNELS, positions

    raw = read_raw(inputs.path("acquire", "{unit}_raw.fif"))
    quality = read_table(inputs.path("preprocess", "quality.parquet"))
    trials = _wanted(config, read_table(inputs.path("acquire", "trials.parquet")))
    rows = Rows(config.min_stratum, config.matched)
    with cured(_CURES):
        decoder = calibrated.bare(config, raw, calibrated.channels(raw, quality, config.interpolation))
        seen = calibrated.see(raw, decoder, trials)
        decoder = replace(decoder, problems=_learned(config, inputs.unit, seen, rows))
    for file, (schema, frame) in rows.tables(decoder, seen).items():
        write_table(frame, out / file, schema)
    kept = mne.pick_info(raw.info, [raw.ch_names.index(name) for name in decoder.kept])
    write_table(positions(kept), out / "channels.parquet", CHANNELS)
    summary = rows.summary(decoder, seen)
    about = {"subject": inputs.unit, "options": params(config), "learned_from": _hashes(inputs), "summary": summary}
    write_decoder(decoder, out, about=about)
    return summary


def _wanted(config: Config, trials: pd.DataFrame) -> pd.DataFrame:
    """Return the trials of the configured blocks and scenarios that belong to a condition of a problem.

    Raises:
        DataError: None does.
        ConfigError: The split, a scenario or a condition is none of the trial table.
    """
    import numpy as np

    from hrcneuro.eeg.epochs import candidates

    found = candidates(trials).reset_index(drop=True)
    inside = np.ones(len(found), bool)
    if config.scenarios:
        known = dict(configured.scenarios(found, config.split))
        for name in config.scenarios:
            if name not in known:
                raise ConfigError(
                    f"calibrate.scenarios names {name!r}{did_you_mean(name, known)}; allowed: {', '.join(known)}",
                    cure="name scenarios of the trial table, or none for all",
                )
        inside &= np.logical_or.reduce([known[name] for name in config.scenarios])
    if config.blocks:
        inside &= found["block"].isin(config.blocks).to_numpy()
    used = {name: config.conditions[name] for pair in config.problems.values() for name in pair}
    of_any = np.logical_or.reduce(list(configured.matching(found, used).values()) or [np.zeros(len(found), bool)])
    chosen = found[inside & of_any]
    if chosen.empty:
        raise DataError(
            f"no trial to calibrate on: of {len(found)} trials, {int(inside.sum())} lie in the blocks and scenarios "
            f"asked for, and {int(of_any.sum())} belong to a condition of [problems]",
            cure="name others (calibrate.blocks, calibrate.scenarios), or other [problems]",
        )
    return chosen


def _learned(config: Config, unit: str, seen: Seen, rows: Rows) -> dict[str, FrozenProblem]:
    """Return how each problem is decided, and add what was found to the rows."""
    import numpy as np

    from hrcneuro.analyses import calibrated
    from hrcneuro.decoding import calibration
    from hrcneuro.decoding.frozen import FrozenProblem

    problems = {}
    for name, (class1, class2) in config.problems.items():
        members = configured.matching(seen.table, {one: config.conditions[one] for one in (class1, class2)})
        both = int((members[class1] & members[class2]).sum())
        if both:
            raise ConfigError(
                f"problem {name}: {both} trials belong to both {class1} and {class2}",
                cure="make the two conditions exclude each other",
            )
        chosen = np.flatnonzero(members[class1] | members[class2])
        table = seen.table.iloc[chosen].reset_index(drop=True)
        labels = members[class2][chosen]
        cells = calibration.strata_cells(_cues(config, name, table), len(table))
        try:
            held_out, by_block = calibration.held_out(labels, calibrated.blocks_of(table), cells)
        except FewTrialsError as error:
            raise FewTrialsError(f"{name}: {error}") from error
        training = calibration.Training(seen.features[chosen], labels, held_out, cells)
        rng = np.random.default_rng([config.seed, *unit.encode(), 0, *name.encode()])
        found = calibration.calibrate(training, shrinkage=config.shrinkage, draws=config.draws, rng=rng)
        problems[name] = FrozenProblem(
            (class1, class2), calibrated.actor_of(table), found.weights, found.bias, found.slope, found.offset
        )
        rows.add(name, problems[name], training, found, table, "" if by_block else _IN_PARTS)
    return problems


def _cues(config: Config, problem: str, table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return the cues whose strata are matched.

    Raises:
        DataError: The trials have no value of one.
    """
    from hrcneuro.analyses.calibrated import cues_of

    known = cues_of(table)
    lacking = [cue for cue in config.matched if cue not in known]
    if lacking:
        raise DataError(
            f"{problem}: not all trials have a value of {' and '.join(lacking)}, whose strata are to be matched",
            cure="leave it out of calibrate.matched",
        )
    return {cue: known[cue] for cue in config.matched}


def _hashes(inputs: Inputs) -> dict[str, str]:
    """Return stage/file -> sha256 of what the decoder was learned from."""
    import hashlib

    found = {}
    for stage, units in sorted(inputs.files.items()):
        for name, path in sorted(units[inputs.unit].items()):
            if any(fnmatchcase(name, pattern) for read in _READS if read.stage == stage for pattern in read.files):
                with path.open("rb") as file:
                    found[f"{stage}/{name}"] = hashlib.file_digest(file, "sha256").hexdigest()
    return found


_IN_PARTS = "fifths of the recording were held out in the place of blocks, of which there are too few to leave one out"

_READS = (Read("acquire", ("*_raw*.fif", "trials.parquet")), Read("preprocess", ("quality.parquet",)))

STAGE = Stage(
    name="calibrate",
    title="A decoder for live use",
    config=Config,
    libraries=("numpy", "scipy", "pandas", "mne", "pyarrow"),
    check=check,
    subject=Work(run, _READS),
    on_demand=True,
)
