"""Planted responses against regression ERPs: ``python FILE [--sfreq HZ] [--seed N ...] [--larger TIMES] [-j N]``.

Eleven synthetic subjects of full length go through the paper's chain. Planted: anticipation (before a human's
takeover), a response to an error, one after an error, one before a turn, each at its own place, and whose move it is.
The truth of a coefficient is the response that was planted, passed through the same filter, EOG regression, repair of
channels and reference. Held against it: the regression's coefficient, and the plain contrast of takeover and
continuation. The maps go into ``regression_recovery.npz`` in the working folder.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.figure import Figure
from threadpoolctl import threadpool_limits

from hrcneuro.analyses import predictors
from hrcneuro.eeg import filters, interpolation
from hrcneuro.eeg.cleaning import Cleaned, CleaningParams, Signals, clean
from hrcneuro.eeg.epochs import Window, candidates, cut, judge
from hrcneuro.eeg.evoked import averages, standard_error, subtract_baseline
from hrcneuro.eeg.interpolation import sphere_centre
from hrcneuro.eeg.regression import OtherOnsets, deconvolved
from hrcneuro.eeg.synthetic import SyntheticParams
from hrcneuro.eeg.synthetic.head import EEG, head
from hrcneuro.eeg.synthetic.responses import WAVES
from hrcneuro.figures import style
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.sources import simulated
from hrcneuro.stages.rerp import Config

SCENARIO = "iC"
# Coefficient -> source whose gains it has, peak in µV, its Gaussians (weight, centre, SD; s).
ADDED = {
    "prev_error": ("error", 7.0, WAVES["error"]),
    "turn": ("visual", 5.0, ((1.0, 0.35, 0.06),)),
}
FRONTAL = ("Fz", "Cz", "FC1", "FC2")
# Coefficient -> what was planted, and the channels above its source.
COEFFICIENTS = {
    "actor[robot]:takeover": ("anticipation", FRONTAL),
    "error": ("error", FRONTAL),
    "prev_error": ("after an error", FRONTAL),
    "turn": ("turn ahead", ("O1", "O2")),
    "actor[T.robot]": ("robot less human", ("C3",)),
}


def wave(gaussians: Any, times: np.ndarray, delays: np.ndarray) -> np.ndarray:
    """Return the mean wave over trials with these delays (s)."""
    t = times[None] - delays[:, None]
    return np.mean([sum(w * np.exp(-0.5 * ((one - c) / sd) ** 2) for w, c, sd in gaussians) for one in t], axis=0)


def subject(place: tuple[str, int], *, sfreq: float, larger: float) -> dict[str, Any]:
    """Return coefficients, plain contrast and truths of one subject."""
    unit, seed = place
    with threadpool_limits(1):
        moves = simulated.simulate_trials(unit, session=SessionParams(), timing=TimingParams(), seed=seed)
        default = SyntheticParams(effect="anticipation")
        params = replace(
            default,
            effect_uv=larger * default.size_uv,
            error_uv=larger * default.error_uv,
            motor_uv=larger * default.motor_uv,
        )
        raw, trials, truth = simulated.record(moves, unit, eeg=params, sfreq=sfreq, seed=seed, contaminated=False)
        onset_s = truth["trials"]["onset_s"].to_numpy(float)
        rng = np.random.default_rng([seed, int(unit[1:])])
        sizes = {}
        for name, (source, peak, gaussians) in ADDED.items():
            sizes[name] = larger * peak * np.exp(0.2 * rng.standard_normal())
            each = sizes[name] * np.exp(0.25 * rng.standard_normal(len(trials)) - 0.03) * trials[name].to_numpy(float)
            course = np.zeros(raw.data.shape[1])
            for at, size in zip(onset_s, each, strict=True):
                first = int((at - 0.1) * sfreq)
                span = np.arange(first, first + int(1.2 * sfreq))
                course[span] += size * wave(gaussians, span / sfreq - at, np.zeros(1))
            raw.data += 1e-6 * truth["topographies"][source].to_numpy()[:, None] * course
        places = head().electrodes[: len(EEG)]
        names = raw.ch_names[: len(EEG)], raw.ch_names[len(EEG) :]
        signals = Signals(raw.data * 1e6, sfreq, *names, places - sphere_centre(places))
        cleaned = clean(signals, CleaningParams(sfreq=min(sfreq, 512.0)))
        rate = sfreq * cleaned.ratio.up / cleaned.ratio.down
        window = Window.of(rate, -0.2, 1.2)
        times = (window.first + np.arange(window.length)) / rate
        found = estimates(trials, cleaned.eeg, rate, window, times)
        planted = truths(truth, trials, sizes, rate)
        at = signals.positions
        passed = {name: _passed(one, rate, cleaned, at, times) for name, one in planted.items()}
        return {"found": found, "truth": passed, "times": times}


def estimates(trials: pd.DataFrame, eeg: np.ndarray, rate: float, window: Window, times: np.ndarray) -> dict[str, Any]:
    """Return the regression's coefficients in one scenario and the plain contrast, baseline corrected."""
    table = predictors.with_derived(trials.reset_index(drop=True))
    onsets = np.round(table["onset_s"].to_numpy(float) * rate).astype(int)
    wanted = candidates(table).index
    rows = wanted[(table.loc[wanted, "scenario"] == SCENARIO).to_numpy(bool)].to_numpy()
    good = judge(eeg, onsets[rows], window, borders=(), marked=(), limit=1000.0) == ""
    rows = rows[good]
    rest = np.delete(np.arange(len(table)), rows)
    here = (table.loc[rest, "scenario"] == SCENARIO).to_numpy(bool)
    own, known = predictors.predictors_of(Config().formula, table.loc[rows], SCENARIO, table.loc[rest[here]])
    values = np.full((len(rest), len(own.names)), np.nan)
    values[here] = known
    data = cut(eeg, onsets[rows], window)
    around = OtherOnsets(onsets[rest], np.tile([0, window.length], (len(rest), 1)), values)
    maps = dict(zip(own.names, deconvolved(data, onsets[rows], own.values, around), strict=True))
    case = table.loc[rows, "condition_before"]
    plus, minus = averages(data, np.stack([(case == one).to_numpy(bool) for one in ("RH", "RR")]))
    return {name: _baselined(one, times) for name, one in {**maps, "plain": plus - minus}.items()}


def truths(truth: Mapping[str, Any], trials: pd.DataFrame, sizes: Mapping[str, float], rate: float) -> dict[str, Any]:
    """Return coefficient -> its planted response at the 30 channels from -4 to 5 s, µV against the mastoids."""
    times = np.arange(-int(4 * rate), int(5 * rate) + 1) / rate
    gains, table = truth["topographies"], truth["trials"]
    inside = (trials["scenario"] == SCENARIO).to_numpy(bool) & ~trials["practice"].to_numpy(bool)
    carrying = inside & (table["extra_uv"] > 0).to_numpy()
    zero = np.zeros(1)

    def at(source: str, course: np.ndarray) -> np.ndarray:
        return gains[source].to_numpy()[:, None] * course

    extra, delays = (table.loc[carrying, name].to_numpy() for name in ("extra_uv", "latency_ms"))
    wrong = inside & (table["error_uv"] > 0).to_numpy()
    human = inside & (table["motor_uv"] > 0).to_numpy()
    found = {
        "actor[robot]:takeover": at("positivity", extra.mean() * wave(WAVES["positivity"], times, delays / 1000)),
        "error": at("error", table.loc[wrong, "error_uv"].mean() * wave(WAVES["error"], times, zero)),
        "actor[T.robot]": -at("motor", table.loc[human, "motor_uv"].mean() * wave(WAVES["motor"], times, zero)),
    }
    for name, (source, _, gaussians) in ADDED.items():
        found[name] = at(source, sizes[name] * wave(gaussians, times, zero))
    return found


def _passed(planted: np.ndarray, rate: float, cleaned: Cleaned, at: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return a response as the chain leaves it: band-pass, EOG regression, repair, common average, baseline."""
    taps = filters.bandpass_taps(rate, 1.0, 40.0)
    filtered = filters.zero_phase(planted.copy(), taps)
    eeg = filtered[: len(EEG)] - cleaned.weights @ filtered[len(EEG) :]
    bad, good = np.flatnonzero(cleaned.interpolated), np.flatnonzero(~cleaned.interpolated)
    if len(bad):
        interpolation.apply(
            eeg, bad, good, interpolation.weights(at[good], at[bad], method=CleaningParams().interpolation)
        )
    eeg = eeg - eeg.mean(axis=0)
    first = int(4 * rate) + round(times[0] * rate)
    return _baselined(eeg[:, first : first + len(times)], times)


def _baselined(one: np.ndarray, times: np.ndarray) -> np.ndarray:
    return subtract_baseline(one[None], times, (-0.2, 0.0))[0]


def compared(found: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """Return r over all channels and times, and how many times the truth is in what was found."""
    r = float(np.corrcoef(found.ravel(), truth.ravel())[0, 1])
    return r, float((found * truth).sum() / (truth * truth).sum())


def picture(path: Path) -> None:
    """Draw what was planted and what was found, from ``regression_recovery.npz``."""
    kept = np.load("regression_recovery.npz")
    ms = 1000 * kept["times"]
    with rc_context(style.STYLE):
        figure = Figure(figsize=(7.2, 4.6))
        axes = figure.subplots(2, 2, sharex=True, sharey=True)
        for one, name, hue in zip(axes.flat, list(COEFFICIENTS)[:4], style.COLOURS, strict=False):
            text, place = COEFFICIENTS[name]
            rows = [EEG.index(channel) for channel in place]
            truth, found, plain = (
                kept[key][:, rows].mean(axis=1) for key in (f"truth {name}", f"found {name}", "found plain")
            )
            mean, error = found.mean(axis=0), standard_error(found)
            one.axhline(0, color="0.6", lw=0.5)
            one.axvline(0, color="0.6", lw=0.5)
            one.plot(ms, plain.mean(axis=0), color="0.65", lw=1.1, label="plain contrast RH - RR")
            one.fill_between(ms, mean - error, mean + error, color=hue, alpha=0.2, lw=0)
            one.plot(ms, mean, color=hue, lw=1.3, label=name)
            one.plot(ms, truth.mean(axis=0), color="k", lw=1.0, ls="--", label="planted")
            one.set_title(f"{text}, {' '.join(place)}", loc="left")
            one.legend(loc="upper right")
            one.set_xlim(ms[0], ms[-1])
        for one in axes[:, 0]:
            one.set_ylabel("µV")
        for one in axes[-1]:
            one.set_xlabel("time from onset (ms)")
        figure.subplots_adjust(left=0.08, right=0.985, top=0.94, bottom=0.1, hspace=0.22, wspace=0.08)
        figure.savefig(path, dpi=style.DPI, metadata={"Software": None})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sfreq", type=float, default=256.0)
    parser.add_argument("--seed", type=int, default=[2023], nargs="+")
    parser.add_argument("--larger", type=float, default=1.0, help="all planted responses so many times as large")
    parser.add_argument("-j", type=int, default=1)
    parser.add_argument("--picture", type=Path, help="only draw the picture of the last run into this file")
    chosen = parser.parse_args()
    if chosen.picture:
        picture(chosen.picture)
        return
    units = [(f"s{k:02d}", seed) for seed in chosen.seed for k in range(1, 13) if k != 7]
    work = partial(subject, sfreq=chosen.sfreq, larger=chosen.larger)
    with ProcessPoolExecutor(chosen.j) as pool:
        every = list(pool.map(work, units))
    np.savez_compressed(
        "regression_recovery.npz",
        times=every[0]["times"],
        **{f"found {name}": np.stack([one["found"][name] for one in every]) for name in (*COEFFICIENTS, "plain")},
        **{f"truth {name}": np.stack([one["truth"][name] for one in every]) for name in COEFFICIENTS},
    )
    print(
        f"{len(units)} subjects, seeds {chosen.seed}, {chosen.sfreq:g} Hz, {SCENARIO}, planted {chosen.larger:g} times"
    )
    print("r over -0.2 to 1.2 s, of the group's mean; size: how often the truth is in it; subjects: median, range")
    print("| planted | estimate | its channels: r | size | r, subjects | 27 channels: r | size | r, subjects |")
    print("|---" * 8 + "|")
    rows = [(name, name) for name in COEFFICIENTS] + [(name, "plain") for name in list(COEFFICIENTS)[:4]]
    for name, source in rows:
        text, place = COEFFICIENTS[name]
        cells = [text, "plain contrast RH - RR" if source == "plain" else f"`{name}`"]
        own = [EEG.index(channel) for channel in place]
        for channels, mean in ((own, True), (range(len(EEG)), False)):
            pairs = [(one["found"][source][list(channels)], one["truth"][name][list(channels)]) for one in every]
            if mean:
                pairs = [(found.mean(axis=0), truth.mean(axis=0)) for found, truth in pairs]
            r, size = compared(*(np.mean(side, axis=0) for side in zip(*pairs, strict=True)))
            each = sorted(compared(found, truth)[0] for found, truth in pairs)
            cells += [f"{r:.3f}", f"{size:.2f}", f"{np.median(each):.2f} ({each[0]:.2f} to {each[-1]:.2f})"]
        print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
