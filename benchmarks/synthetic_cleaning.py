"""Cleans a synthetic study and compares with what was planted: ``python FILE [--seed N ...] [--sfreq HZ] [-j N]``.

Bad channels found by kurtosis and missed, channels replaced, blinks before and after the EOG regression, and the grand
average beside the planted one. s07 is contaminated, as in the study, and left out of every total.
"""

from __future__ import annotations

import argparse
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from hrcneuro.eeg import filters
from hrcneuro.eeg.cleaning import CleaningParams, Signals, clean
from hrcneuro.eeg.interpolation import sphere_centre
from hrcneuro.eeg.synthetic import SyntheticParams, planted_average
from hrcneuro.eeg.synthetic.head import CH_NAMES, EEG, head
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.sources import simulated

FRONTAL = [CH_NAMES.index(name) for name in ("Fp1", "Fp2", "F3", "F4", "F7", "F8", "Fz")]
CONTAMINATED = "s07"
STEP = 1 / 256
TIMES = np.arange(-51, 154) * STEP  # -0.2 to 0.6 s: before the next onset
KINDS = ("flat", "loose", "muscle_bursts", "muscle", "broadband")
SHOWN = {"Fz": ("Fz",), "Cz": ("Cz",), "O1": ("O1",), "fronto-central": ("Fz", "Cz", "FC1", "FC2")}


def subject(unit: str, *, seed: int, sfreq: float) -> dict[str, Any]:
    """Return what was found in one subject."""
    with threadpool_limits(1):
        moves = simulated.simulate_trials(unit, session=SessionParams(), timing=TimingParams(), seed=seed)
        contaminated = unit == CONTAMINATED
        raw, trials, truth = simulated.record(
            moves, unit, eeg=SyntheticParams(), sfreq=sfreq, seed=seed, contaminated=contaminated
        )
        places = head().electrodes[: len(EEG)]
        names = raw.ch_names[: len(EEG)], raw.ch_names[len(EEG) :]
        signals = Signals(raw.data, sfreq, *names, places - sphere_centre(places))
        signals.data *= 1e6
        peaks = np.round(truth["blinks"]["peak_s"].to_numpy() * sfreq).astype(int)
        seen: list[np.ndarray] = []

        def watch(step: str, eeg: np.ndarray) -> None:
            if step in ("filtered", "eog"):
                seen.append(_locked(eeg[FRONTAL], peaks, sfreq))

        cleaned = clean(signals, CleaningParams(sfreq=min(sfreq, 512.0)), on_step=watch)
        bad = truth["bad_channels"].drop_duplicates("channel")
        rejected = {name for name, why in zip(names[0], cleaned.reason, strict=True) if why}
        rate = sfreq * cleaned.ratio.up / cleaned.ratio.down
        used = (~trials["practice"]).to_numpy(bool)
        case = trials["condition_before"].astype(object)
        iC = used & (trials["scenario"] == "iC").to_numpy(bool)
        pick = {"all": used} | {c: iC & (case == c).to_numpy(bool) for c in ("RR", "RH")}
        onset = trials["onset_s"].to_numpy(float)
        return {
            "unit": unit,
            "minutes": raw.duration_s / 60,
            "bad": [(kind, channel in rejected) for channel, kind in zip(bad["channel"], bad["kind"], strict=True)],
            "false": len(rejected - set(bad["channel"])),
            "replaced": int(cleaned.interpolated.sum()),
            "blink_locked": _energy(seen),
            "blink_planted": _planted_blinks(truth, cleaned.weights),
            "erp": {name: _average(cleaned.eeg, onset[rows], rate) for name, rows in pick.items()},
            "planted": {name: _centred(planted_average(truth, TIMES, rows)[: len(EEG)]) for name, rows in pick.items()},
        }


def _locked(eeg: np.ndarray, peaks: np.ndarray, sfreq: float) -> np.ndarray:
    """Return the average around the blinks' peaks, ± 0.3 s."""
    span = int(0.3 * sfreq)
    inside = peaks[(peaks > span) & (peaks < eeg.shape[1] - span)]
    return np.mean([eeg[:, at - span : at + span] for at in inside], axis=0)


def _energy(seen: list[np.ndarray]) -> float:
    before, after = ((x**2).sum() for x in seen)
    return float(100 * (1 - after / before))


def _planted_blinks(truth: dict[str, Any], weights: np.ndarray) -> float:
    """Return by how many percent the regression lowers the energy of the planted blinks themselves."""
    sources, gains = truth["sources"], truth["topographies"]
    rate = 1 / float(np.median(np.diff(sources["time_s"])))
    taps = filters.bandpass_taps(rate, 1.0, 40.0)
    alone = sum(
        np.outer(gains[s], filters.zero_phase(sources[s].to_numpy(float)[None].copy(), taps)[0])
        for s in ("blink", "lid")
    )
    left = alone[: len(EEG)] - weights @ alone[len(EEG) :]
    return float(100 * (1 - (left[FRONTAL] ** 2).sum() / (alone[FRONTAL] ** 2).sum()))


def _average(eeg: np.ndarray, onset_s: np.ndarray, rate: float) -> np.ndarray:
    at = np.round((onset_s[:, None] + TIMES) * rate).astype(int)
    return _centred(np.mean([eeg[:, one] for one in at], axis=0))


def _centred(average: np.ndarray) -> np.ndarray:
    average = average - average.mean(axis=0)
    return average - average[:, TIMES < 0].mean(axis=1, keepdims=True)


def correlations(found: list[dict[str, Any]]) -> dict[str, float]:
    """Return how the grand average correlates with the planted one, channels and times together and by place."""

    def grand(what: str, name: str) -> np.ndarray:
        return np.mean([f[what][name] for f in found], axis=0)

    def r(a: np.ndarray, b: np.ndarray) -> float:
        return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])

    def at(x: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
        return x[[CH_NAMES.index(n) for n in names]].mean(axis=0)

    every, planted = grand("erp", "all"), grand("planted", "all")
    table = {"all 27 channels": r(every, planted)}
    table |= {name: r(at(every, names), at(planted, names)) for name, names in SHOWN.items()}
    effect, meant = (grand(what, "RH") - grand(what, "RR") for what in ("erp", "planted"))
    place = SHOWN["fronto-central"]
    table["iC RH - RR, fronto-central"] = r(at(effect, place), at(meant, place))
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sfreq", type=float, default=1000.0)
    parser.add_argument("--seed", type=int, default=[2023], nargs="+")
    parser.add_argument("-j", type=int, default=1)
    chosen = parser.parse_args()
    units = [f"s{k:02d}" for k in range(1, 13)]
    print("| seed | subject | minutes | planted: found | planted: missed | others replaced | replaced | blinks % |")
    print("|---" * 8 + "|")
    everyone, hits = [], {kind: Counter() for kind in KINDS}
    for seed in chosen.seed:
        with ProcessPoolExecutor(chosen.j) as pool:
            for one in pool.map(partial(subject, seed=seed, sfreq=chosen.sfreq), units):
                lists = [", ".join(kind for kind, hit in one["bad"] if hit == want) or "-" for want in (True, False)]
                blinks = f"{one['blink_locked']:.1f}, {one['blink_planted']:.1f}"
                cells = [seed, one["unit"], f"{one['minutes']:.1f}", *lists, one["false"], one["replaced"], blinks]
                print("| " + " | ".join(map(str, cells)) + " |", flush=True)
                if one["unit"] == CONTAMINATED:
                    continue
                everyone.append(one)
                for kind, hit in one["bad"]:
                    hits[kind][hit] += 1
    report(everyone, hits)


def report(everyone: list[dict[str, Any]], hits: dict[str, Counter]) -> None:
    print(f"\nwithout {CONTAMINATED}, {len(everyone)} recordings:")
    for name, kinds in (("come and go", KINDS[:3]), ("stay", KINDS[3:])):
        found, planted = sum(hits[k][True] for k in kinds), sum(hits[k].total() for k in kinds)
        each = ", ".join(f"{k} {hits[k][True]} of {hits[k].total()}" for k in kinds)
        rate = f"{100 * found / planted:.0f} %" if planted else "none"
        print(f"bad channels that {name}: {found} of {planted} found ({rate}): {each}")
    replaced = [one["replaced"] for one in everyone]
    within = sum(3 <= n <= 6 for n in replaced)
    print(
        f"replaced: mean {np.mean(replaced):.1f}, {min(replaced)} to {max(replaced)}, "
        f"3 to 6 in {within} of {len(replaced)}: {sorted(replaced)}"
    )
    for key, text in (("blink_locked", "average around blinks"), ("blink_planted", "planted blinks themselves")):
        values = [one[key] for one in everyone]
        print(f"blink energy at Fp, F, {text}: falls by {np.mean(values):.1f} %, least {min(values):.1f} %")
    print(
        "grand average against the planted one, r: "
        + ", ".join(f"{k} {v:.3f}" for k, v in correlations(everyone).items())
    )


if __name__ == "__main__":
    main()
