"""How often each test finds something where nothing is: ``FILE [STUDIES [KIND]]`` simulates that many small
studies a row, of all kinds or of one (the first column).

Every study takes the way of a real one, from single trials to corrected p values. A study counts once, however many
points or problems are significant. Where a test must hold against a confound, the studies contain it, and a row beside
shows what a test makes of it that does not know: that row fails on purpose.

The studies of a row have their numbers as seeds: the first 60 of 1000 are those of a run of 60.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pandas as pd
from mne.stats import combine_adjacency
from threadpoolctl import threadpool_limits

from hrcneuro.analyses import contrasts, decode_group, strata
from hrcneuro.decoding import problem
from hrcneuro.decoding.decoders import Decoders
from hrcneuro.decoding.recipes import BUILTIN
from hrcneuro.decoding.scheme import Scheme
from hrcneuro.eeg.contrasts import Averages
from hrcneuro.eeg.evoked import averages, subtract_baseline
from hrcneuro.eeg.morlet import Wavelets
from hrcneuro.eeg.morlet_means import mean_magnitudes
from hrcneuro.eeg.selection import trial_sets

Found = dict[str, bool]
"""Name of a test -> whether it found anything in this study."""

SFREQ, TIMES = 40.0, np.arange(-8, 33) / 40.0
CHANNELS = pd.DataFrame(
    {"x_m": [0, -0.06, 0.06, 0], "y_m": [0.06, 0, 0, -0.06], "z_m": [0.07, 0.07, 0.07, 0.07]}, ["Fz", "C3", "C4", "Pz"]
)
GAIN = np.array([1.0, 0.6, 0.6, 0.3])[:, None]
WAVELETS, STEP = Wavelets((4.0, 8.0, 16.0), (2.0, 4.0, 6.0), SFREQ, 0.5), 2

# A subject's trials: of the takeovers 15 of 22 follow an error (68 %), of the continuations 10 of 38 (26 %), as in iC.
TRIALS = pd.DataFrame(
    {
        "condition_before": ["RH"] * 22 + ["RR"] * 38,
        "prev_error": [True] * 15 + [False] * 7 + [True] * 10 + [False] * 28,
    }
)
# Clusters cost time by the flip. Fewer subjects attain the same level: 6 of 128 flips instead of 24 of 512.
AVERAGED, CLUSTERED = 9, 7
OPTIONS = contrasts.ContrastOptions(
    conditions={name: f"condition_before == '{name[:2]}'" for name in ("RH_before", "RR_before")},
    contrasts={"RH-RR_before": ("RH_before", "RR_before")},
    split="",
    strata=("prev_error",),
)
WHOLE = trial_sets(TRIALS, OPTIONS.conditions)
SETS = [*WHOLE, *strata.stratified_sets(TRIALS, WHOLE, OPTIONS)[0]]
MASKS = np.stack([one.mask for one in SETS])
NEIGHBOURS = contrasts.channel_adjacency(CHANNELS)
ADJACENCY = {
    "ERP": combine_adjacency(NEIGHBOURS, len(TIMES)),
    "ERSP": combine_adjacency(NEIGHBOURS, len(WAVELETS.frequencies), len(TIMES[::STEP])),
}
RESPONSE_UV = 6.0

DECODED = 11
PROBLEMS = [(scenario, name) for scenario in ("sC", "iC") for name in ("HHvsHR", "RRvsRH")]
DECODERS = ("rlda", "rlda_600")
SCHEME = Scheme(folds=5, repeats=1, permutations=0)
# Three of sixty labellings, the true one among them: 5 % exactly.
PERMUTED = replace(SCHEME, permutations=59)


def noise(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return epochs with the slow drift and the correlated channels of EEG, shape (trials, channels, samples), µV."""
    shape = (n, len(CHANNELS), len(TIMES))
    drift = np.cumsum(rng.standard_normal(shape), axis=-1)
    return drift + 2 * rng.standard_normal((n, 1, len(TIMES))) + rng.standard_normal(shape)


def response(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return what an error leaves in the next epoch: a positivity and a burst at 8 Hz; each trial has its own size."""
    size = RESPONSE_UV * np.exp(0.5 * rng.standard_normal(n) - 0.125)
    phase = rng.uniform(0, 2 * np.pi, (n, 1, 1))
    wave = np.exp(-0.5 * ((TIMES - 0.3) / 0.1) ** 2) * (1 + np.cos(2 * np.pi * 8 * TIMES + phase))
    return size[:, None, None] * GAIN * wave


def maps(rng: np.random.Generator, *, post_error: bool) -> dict[str, dict[str, Averages]]:
    """Return ERP and ERSP -> subject -> averages of a study; in none does a takeover change anything by itself."""
    found: dict[str, dict[str, Averages]] = {"ERP": {}, "ERSP": {}}
    keys = [(one.scenario, one.condition) for one in SETS]
    for subject in range(AVERAGED):
        data = noise(rng, len(TRIALS))
        if post_error:
            after = TRIALS["prev_error"].to_numpy()
            data[after] += response(rng, int(after.sum()))
        erp = averages(subtract_baseline(data, TIMES, (-0.2, 0.0)), MASKS)
        ersp = mean_magnitudes(data.astype(np.float32), MASKS, WAVELETS, step=STEP)
        found["ERP"][f"s{subject}"] = dict(zip(keys, erp, strict=True))
        found["ERSP"][f"s{subject}"] = dict(zip(keys, ersp, strict=True))
    return found


def tested(averages: dict[str, Averages], kind: str, correction: str) -> Found:
    """Return scenario or stratum -> whether any point is significant there."""
    options = replace(OPTIONS, correction=correction)
    every = contrasts.over_subjects(averages, options, ADJACENCY[kind])
    return {one.scenario: bool(one.result.test.significant.any()) for one in every if one.result.test}


def without_effect(rng: np.random.Generator) -> Found:
    found = {}
    for kind, subjects in maps(rng, post_error=False).items():
        whole = {unit: {key: m[key] for key in m if key[0] == "all"} for unit, m in subjects.items()}
        found[f"{kind}, extreme statistics"] = tested(whole, kind, "max")["all"]
        few = dict(list(whole.items())[:CLUSTERED])
        found[f"{kind}, clusters"] = tested(few, kind, "cluster")["all"]
    return found


def after_errors(rng: np.random.Generator) -> Found:
    found = {}
    for kind, subjects in maps(rng, post_error=True).items():
        by_stratum = tested(subjects, kind, "max")
        found[f"{kind}, all trials (**fails on purpose**)"] = by_stratum["all"]
        found[f"{kind}, trials after an error"] = by_stratum["all, prev_error yes"]
        found[f"{kind}, trials after none"] = by_stratum["all, prev_error no"]
    return found


def scorers(epochs_uv: np.ndarray) -> Iterator[tuple[str, problem.Decode, problem.Decode | None]]:
    recipes = {name: BUILTIN[name] for name in DECODERS}
    made = Decoders(recipes, epochs_uv=lambda rows: epochs_uv[rows], times_s=TIMES)
    return made.of(made.features_of(np.arange(len(epochs_uv))))


def decoding(rng: np.random.Generator) -> Found:
    rows = []
    for scenario, name in PROBLEMS:
        for subject in range(DECODED):
            trials = problem.LabelledTrials(rng.permutation(48) < 17, np.arange(48.0), None)
            plan = problem.draw_plan(trials, SCHEME, rng)
            for decoder, score, _ in scorers(noise(rng, 48)):
                rates = problem.decode(trials, plan, SCHEME, score).fold_rates.mean()
                rows.append(
                    {"scenario": scenario, "problem": name, "decoder": decoder, "subject": subject, "chance": 60.0}
                    | {measure: 100 * rates[measure] for measure in ("tnr", "tpr", "acc", "bacc")}
                )
    scores = pd.DataFrame(rows)
    tests = decode_group.test_table(scores, seed=0)
    compared = decode_group.compare_table(scores, DECODERS, seed=0)
    return {
        "group above chance": bool(tests.loc[tests["decoder"] == DECODERS[0], "significant"].any()),
        "two decoders compared": bool((compared["p_holm"] < 0.05).any()),
    }


def one_subject(rng: np.random.Generator) -> Found:
    # What tells the classes apart is the block: takeovers are commoner in some, and the signal drifts from one to the
    # next.
    blocks = np.repeat(np.arange(4), 12)
    labels = np.concatenate([rng.permutation(12) < takeovers for takeovers in (1, 3, 5, 8)])
    epochs_uv = noise(rng, len(labels)) + 3 * blocks[:, None, None] * GAIN * np.exp(-0.5 * ((TIMES - 0.3) / 0.1) ** 2)
    found = {}
    for name, known in (("within block", blocks), ("over all blocks (**fails on purpose**)", None)):
        trials = problem.LabelledTrials(labels, np.arange(len(labels), dtype=float), known)
        plan = problem.draw_plan(trials, PERMUTED, rng)
        _, _, score = next(scorers(epochs_uv))
        found[f"one subject, labels permuted {name}"] = problem.permutation_test(trials, plan, score).p <= 0.05
    return found


STUDIES: dict[str, Callable[[np.random.Generator], Found]] = {
    "no effect": without_effect,
    "a response to the previous error": after_errors,
    "no effect, decoding": decoding,
    "blocks that differ, decoding": one_subject,
}


def counted(what: str, n: int) -> pd.DataFrame:
    """Return the findings of ``n`` studies, one row a study, one column a test."""
    number = list(STUDIES).index(what)
    return pd.DataFrame([STUDIES[what](np.random.default_rng([number, study])) for study in range(n)])


def main(n: int = 1000, *kinds: str) -> None:
    print("| the studies contain | test | studies | with a finding |\n|---|---|---|---|")
    for what in kinds or STUDIES:
        start = time.process_time()
        for name, share in counted(what, n).mean().items():
            error = 100 * np.sqrt(share * (1 - share) / n)
            print(f"| {what} | {name} | {n} | {100 * share:.1f} ± {error:.1f} % |", flush=True)
        print(f"  {time.process_time() - start:.0f} s of processor time", file=sys.stderr)


if __name__ == "__main__":
    with threadpool_limits(1):
        main(*map(int, sys.argv[1:2]), *sys.argv[2:])
