"""How often the regression finds a takeover's own response, where it is and where it is not: ``FILE [STUDIES [UV]]``.

Small studies of nine subjects: moves as the rules of the game make them (iC of simulated sessions), four channels at
40 Hz, noise as slow as EEG's. In the null studies errors, previous errors, turns and whose move it is have responses,
takeovers have none, and neighbours' responses overlap. In the others takeovers have one of UV µV, with and without the
rest. Beside the regression stand the plain contrast, the strata, and the stratum of both at once (turn ahead, no error
before).

The studies of a row have their numbers as seeds: the first 60 of 1000 are those of a run of 60.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.signal import lfilter
from threadpoolctl import threadpool_limits

from hrcneuro.analyses import predictors
from hrcneuro.analyses.group_tests import FlipOptions, group_contrast
from hrcneuro.eeg.epochs import candidates
from hrcneuro.eeg.evoked import averages, subtract_baseline
from hrcneuro.eeg.formula import Predictors
from hrcneuro.eeg.regression import OtherOnsets, deconvolved
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.paradigm.session import simulate_session
from hrcneuro.stages.rerp import Config
from hrcneuro.tables.trials import study_trials

SFREQ, FIRST, LENGTH = 40.0, -8, 57
TIMES = (FIRST + np.arange(LENGTH)) / SFREQ
GAIN = np.array([1.0, 0.6, 0.6, 0.3])
SUBJECTS = 9
OPTIONS = FlipOptions()
TAKEOVER = "actor[robot]:takeover"
# Peak in µV, centre and SD in s; of a subject's own mean size. The first two are what a takeover comes with more often.
CONFOUNDS = {
    "prev_error": (6.0, 0.40, 0.09),
    "turn": (3.0, 0.50, 0.10),
    "error": (6.0, 0.33, 0.06),
    "human": (-4.0, 0.05, 0.10),
}
ANTICIPATION = (0.50, 0.08)


@dataclass(frozen=True)
class Subject:
    """What is the same in every study: the moves, the predictors, and which trials a contrast compares."""

    moves: pd.DataFrame
    onsets: np.ndarray
    trials: np.ndarray
    own: Predictors
    rest: np.ndarray
    pairs: Mapping[str, np.ndarray]


def subject(seed: int) -> Subject:
    """Return a subject of the study's iC."""
    drawn = simulate_session(SessionParams(), rng=np.random.default_rng(seed), timing=TimingParams())
    table = predictors.with_derived(study_trials(drawn, f"s{seed}", None))
    table = table[(table["scenario"] == "iC") & ~table["practice"].astype(bool)].reset_index(drop=True)
    wanted = candidates(table).index.to_numpy()
    own, rest = predictors.predictors_of(Config().formula, table.loc[wanted], f"s{seed}", table.drop(wanted))
    rows = table.loc[wanted]
    case, turn, error = rows["condition_before"], rows["turn"] == 1, rows["prev_error"] == 1
    every = np.ones(len(rows), bool)
    kinds = {
        "plain contrast": every,
        "after an error": error,
        "after none": ~error,
        "turn ahead": turn,
        "turn ahead, after none": turn & ~error,
    }
    pairs = {
        name: np.stack([(case == one).to_numpy(bool) & np.asarray(kind, bool) for one in ("RH", "RR")])
        for name, kind in kinds.items()
    }
    onsets = np.round((table["onset_s"].to_numpy(float) - table["onset_s"].min()) * SFREQ).astype(int) + 40
    return Subject(table, onsets, wanted, own, rest, pairs)


def recording(one: Subject, rng: np.random.Generator, *, uv: float, confounds: bool) -> np.ndarray:
    """Return a subject's signal, ndarray, shape (n_channels, n_samples), µV."""
    n = one.onsets[-1] + 2 * LENGTH
    noise = lfilter([1.0], [1.0, -0.9], 3.0 * rng.standard_normal((len(GAIN), n))) + 2 * rng.standard_normal((1, n))
    sizes = {"takeover": one.moves["condition_before"].eq("RH").to_numpy(float) * uv}
    shapes = {"takeover": ANTICIPATION}
    for name, (peak, *shape) in CONFOUNDS.items() if confounds else ():
        values = one.moves["actor"].eq("human") if name == "human" else one.moves[name]
        sizes[name], shapes[name] = peak * values.to_numpy(float), tuple(shape)
    for name, size in sizes.items():
        own = np.exp(0.3 * rng.standard_normal()) * np.exp(0.4 * rng.standard_normal(len(size)) - 0.08)
        centre, sd = shapes[name]
        wave = np.exp(-0.5 * ((TIMES - centre) / sd) ** 2)
        for onset, by in zip(one.onsets, size * own, strict=True):
            if by:
                noise[:, onset + FIRST : onset + FIRST + LENGTH] += by * GAIN[:, None] * wave
    return noise


def maps(one: Subject, signal: np.ndarray) -> dict[str, np.ndarray]:
    """Return what a subject has of each estimate of the takeover's response."""
    onsets = one.onsets[one.trials]
    data = np.stack([signal[:, o + FIRST : o + FIRST + LENGTH] for o in onsets])
    rest = np.delete(one.onsets, one.trials)
    around = OtherOnsets(rest, np.tile([0, LENGTH], (len(rest), 1)), one.rest)
    fitted = dict(zip(one.own.names, deconvolved(data, onsets, one.own.values, around), strict=True))
    found = {"regression": fitted[TAKEOVER], "regression, the human's takeover": fitted["actor[human]:takeover"]}
    for name, pair in one.pairs.items():
        plus, minus = averages(data, pair)
        found[name] = plus - minus
    return {name: subtract_baseline(own[None], TIMES, (-0.2, 0.0))[0] for name, own in found.items()}


def study(subjects: list[Subject], seed: list[int], *, uv: float, confounds: bool) -> dict[str, bool]:
    """Return estimate -> whether anything of it is significant in a study."""
    rng = np.random.default_rng(seed)
    found = [maps(one, recording(one, rng, uv=uv, confounds=confounds)) for one in subjects]
    tests = {
        name: group_contrast(np.stack([own[name] for own in found]), OPTIONS, None, stream=("iC", name)).test
        for name in found[0]
    }
    return {name: bool(test.significant.any()) for name, test in tests.items() if test is not None}


def main(n: int = 1000, uv: float = 1.4) -> None:
    subjects = [subject(seed) for seed in range(SUBJECTS)]
    for one in subjects[:1]:
        print("first subject:", {name: pair.sum(axis=1).tolist() for name, pair in one.pairs.items()}, "trials RH, RR")
        factor = dict(zip(one.own.names, one.own.inflation, strict=True))[TAKEOVER]
        print(f"variance inflation of {TAKEOVER}: {factor:.2f}")
    worlds = {
        "null, all confounds": dict(uv=0.0, confounds=True),
        f"{uv:g} µV, all confounds": dict(uv=uv, confounds=True),
        f"{uv:g} µV, none": dict(uv=uv, confounds=False),
    }
    print("| the studies contain | estimate | studies | with a finding |\n|---|---|---|---|")
    for number, (world, what) in enumerate(worlds.items()):
        start = time.process_time()
        table = pd.DataFrame([study(subjects, [number, i], **what) for i in range(n)])
        for name, share in table.mean().items():
            error = 100 * np.sqrt(share * (1 - share) / n)
            print(f"| {world} | {name} | {n} | {100 * share:.1f} ± {error:.1f} % |", flush=True)
        print(f"  {time.process_time() - start:.0f} s of processor time", file=sys.stderr)


if __name__ == "__main__":
    with threadpool_limits(1):
        main(*(kind(value) for kind, value in zip((int, float), sys.argv[1:], strict=False)))
