"""Decodes synthetic studies with each planted effect, as the paper does: ``python FILE [--effect NAME:UV ...]``.

One table: the four problems, and for RR against RH in iC what tells the effects apart. Run it after changing a default
of hrcneuro.eeg.synthetic, and set the sizes in its ``params`` anew where RR against RH leaves 57.1 %.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
from scipy.stats import nct
from scipy.stats import t as student
from threadpoolctl import threadpool_limits

from hrcneuro.decoding.decoders import rlda
from hrcneuro.decoding.features import window_means
from hrcneuro.decoding.problem import LabelledTrials, decode, draw_plan
from hrcneuro.decoding.scheme import Scheme
from hrcneuro.eeg.cleaning import CleaningParams, Signals, clean
from hrcneuro.eeg.interpolation import sphere_centre
from hrcneuro.eeg.synthetic import EFFECTS, SyntheticParams
from hrcneuro.eeg.synthetic.head import head
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.sources import simulated

PROBLEMS = [(s, *p) for s in ("iC", "sC") for p in (("HH", "HR"), ("RR", "RH"))]
SHOWN = ("iC HHvsHR", "iC RRvsRH", "sC HHvsHR", "sC RRvsRH")
CUES = ("prev_error", "turn")


def subject(unit: str, *, effect: str, size: float | None, sfreq: float, seed: int, repeats: int) -> dict[str, float]:
    """Return percentages of one subject, by name of problem and of what was measured."""
    with threadpool_limits(1):
        moves = simulated.simulate_trials(unit, session=SessionParams(), timing=TimingParams(), seed=seed)
        eeg = SyntheticParams(effect=effect, effect_uv=size)
        raw, trials, _ = simulated.record(moves, unit, eeg=eeg, sfreq=sfreq, seed=seed, contaminated=False)
        places = head().electrodes[:27]
        signals = Signals(raw.data * 1e6, sfreq, raw.ch_names[:27], raw.ch_names[27:], places - sphere_centre(places))
        cleaned = clean(signals, CleaningParams(sfreq=min(sfreq, 512.0)))
        found = {"replaced": float(cleaned.interpolated.sum())}
        rate = sfreq * cleaned.ratio.up / cleaned.ratio.down
        start = np.round(trials["onset_s"].to_numpy() * rate).astype(int)
        window = np.arange(int(np.ceil(0.8 * rate)) + 1)
        for scenario, first, second in PROBLEMS:
            case = trials["condition_before"].astype(object)
            rows = ((trials["scenario"] == scenario) & case.isin([first, second])).to_numpy(bool)
            features = window_means(cleaned.eeg[:, start[rows][:, None] + window].transpose(1, 0, 2), window / rate)
            cues = {c: trials.loc[rows, c].to_numpy(bool) for c in CUES}
            blocks = trials.loc[rows, "block"].to_numpy(int)
            onsets = trials.loc[rows, "onset_s"].to_numpy(float)
            problem = LabelledTrials((case[rows] == second).to_numpy(bool), onsets, blocks, cues)
            scheme = Scheme(repeats=repeats, permutations=0)
            plan = draw_plan(problem, scheme, np.random.default_rng([seed, 1]))
            result = decode(problem, plan, scheme, rlda(features, shrinkage=0.9))
            name = f"{scenario} {first}vs{second}"
            found[name] = 100 * result.fold_rates.mean()["acc"]
            found[f"{name} matched"] = 100 * result.matched_bacc
            for s in result.strata:
                found[f"{name} {s.cue}={'yes' if s.value else 'no'}"] = 100 * s.bacc
            by_error = [100 * s.bacc for s in result.strata if s.cue == "prev_error"]
            found[f"{name} strata"] = float(np.mean(by_error))
    return found


def power(values: np.ndarray) -> float:
    """Return the power, in percent, of a one-sided t test at 5 % of eleven subjects like these against 50 %."""
    n = 11
    shift = (values.mean() - 50) / values.std(ddof=1) * np.sqrt(n)
    return float(100 * nct.sf(student.ppf(0.95, n - 1), n - 1, shift))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sfreq", type=float, default=256.0)
    parser.add_argument("--seed", type=int, default=[2023], nargs="+")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--effect", nargs="+", default=list(EFFECTS), help="NAME, or NAME:MICROVOLT")
    parser.add_argument("-j", type=int, default=2)
    chosen = parser.parse_args()
    units = [f"s{k:02d}" for k in range(1, 13) if k != 7]
    strata = [f"iC RRvsRH {m}" for m in ("prev_error=yes", "prev_error=no", "strata", "turn=yes", "matched")]
    print(f"{len(units)} subjects, seeds {chosen.seed}, {chosen.sfreq:g} Hz; mean ± SD in percent, [power]")
    print("| effect | µV | " + " | ".join((*SHOWN, *(s.removeprefix("iC ") for s in strata), "replaced")) + " |")
    print("|---" * (len(SHOWN) + len(strata) + 3) + "|")
    for effect in chosen.effect:
        name, _, size = effect.partition(":")
        uv = float(size) if size else None
        rows: list[dict[str, float]] = []
        for seed in chosen.seed:
            work = partial(subject, effect=name, size=uv, sfreq=chosen.sfreq, seed=seed, repeats=chosen.repeats)
            with ProcessPoolExecutor(chosen.j) as pool:
                rows += pool.map(work, units)
        cells = [name, f"{SyntheticParams(effect=name, effect_uv=uv).size_uv:g}"]
        for key in (*SHOWN, *strata):
            values = np.array([r[key] for r in rows])
            cells.append(
                f"{values.mean():.1f} ± {values.std(ddof=1):.1f}" + (f" [{power(values):.0f}]" if key in strata else "")
            )
        replaced = [int(r["replaced"]) for r in rows]
        print("| " + " | ".join([*cells, f"{min(replaced)}-{max(replaced)}"]) + " |", flush=True)


if __name__ == "__main__":
    main()
