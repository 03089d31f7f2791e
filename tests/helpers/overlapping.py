"""A recording whose moves follow each other faster than an epoch is long, without noise."""

import mne
import numpy as np
import pandas as pd

from hrcneuro.contract import Inputs
from hrcneuro.io.fif import write_raw
from hrcneuro.io.tables import write_table
from hrcneuro.stages import epoch
from hrcneuro.tables.quality import TIMING
from hrcneuro.tables.trials import TRIALS


def overlapping(folder, n=240, sfreq=128.0, sizes=None):
    """Write a recording in which every move has one response, and epochs of only some; return the response in µV.

    Moves of no condition and rejected ones lie among the others, some at a cut in the recording. Moves are followed
    sooner in some conditions, so that averages hold neighbours' responses and differ. ``sizes`` is a function that
    returns each move's share of the response, of the trial table; without it all have one.
    """
    rng = np.random.default_rng(3)
    before = rng.choice(["HH", "HR", "RR", "RH", None], n, p=[0.25, 0.2, 0.25, 0.2, 0.1])
    gaps = np.where(before == "RH", rng.integers(75, 90, n), rng.integers(95, 150, n))
    before[99:102], gaps[99:101] = ("HH", None, "HR"), 75
    onsets = 200 + np.concatenate([[0], np.cumsum(gaps)[:-1]])
    trials = pd.DataFrame({name: [None] * n for name in TRIALS.columns}).assign(
        subject="s01", event="move", scenario="iC", practice=False, condition_before=before, onset_s=onsets / sfreq,
        onset_sample=onsets, soa_s=gaps / sfreq,
    )  # fmt: skip
    times = np.arange(round(-0.2 * sfreq), round(1.2 * sfreq) + 1) / sfreq
    response = 10 * np.exp(-(((times - 0.4) / 0.25) ** 2)) * np.hanning(len(times))
    signal, cut = np.zeros(onsets[-1] + 400), onsets[100] + 30
    shares = np.ones(n) if sizes is None else sizes(trials)
    for onset, share in zip(onsets, shares, strict=True):
        reach = onset + round(times[0] * sfreq) + np.arange(len(times))
        held = (reach < cut) == (onset < cut)  # no response goes on behind the cut
        signal[reach[held]] += share * response[held]
    signal[onsets[30] + 20] += 5000
    info = mne.create_info(["Fz", "Cz"], sfreq, "eeg")
    raw = mne.io.RawArray(np.stack([signal, 2 * signal]) * 1e-6, info, verbose="error")
    raw.set_annotations(mne.Annotations([cut / sfreq], [0], ["boundary"]))
    for name in ("acquire", "preprocess", "epoch"):
        (folder / name).mkdir(parents=True)
    write_table(trials, folder / "acquire" / "trials.parquet", TRIALS)
    write_raw(raw, folder / "preprocess" / "s01_clean_raw.fif")
    timing = {
        "source_sfreq": sfreq,
        "sfreq": sfreq,
        "up": 1,
        "down": 1,
        "n_source": len(signal),
        "n_samples": len(signal),
    }
    write_table(pd.DataFrame([timing]), folder / "preprocess" / "timing.parquet", TIMING)
    made = epoch.run(
        epoch.Config(), Inputs.of("s01", **{n: folder / n for n in ("acquire", "preprocess")}), folder / "epoch"
    )
    assert set(made["reasons"]) == {"amplitude", "boundary"}
    return response, times
