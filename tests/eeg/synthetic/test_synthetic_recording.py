"""The synthetic recording from outside: shape, units, determinism, spectra, amplitudes, errors."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys

import mne
import numpy as np
import pandas as pd
import pytest
from scipy.signal import welch

from hrcneuro.eeg.refusals import MovesError, SlowSamplingError
from hrcneuro.eeg.synthetic import EFFECTS, Synthetic, SyntheticParams, generate, generator
from hrcneuro.paradigm.session import SessionParams, simulate_session

QUIET = {
    f"{name}_uv": 0.0
    for name in ("positivity", "visual", "motor", "error", "background", "sensor", "alpha", "mu", "blink", "saccade")
} | {"line_uv": 0.0, "drift_uv": 0.0, "bad_channels": 0, "noisy_channels": 0}


@pytest.fixture(scope="module")
def trials() -> pd.DataFrame:
    small = SessionParams(practice_episodes=1, blocks=4, episodes_per_block=7)
    return simulate_session(small, rng=np.random.default_rng(5))


def make(
    trials: pd.DataFrame, *, seed: int = 1, sfreq: float = 128.0, contaminated: bool = False, **params
) -> Synthetic:
    chosen = SyntheticParams(**params)
    return generate(trials, params=chosen, sfreq=sfreq, rng=np.random.default_rng(seed), contaminated=contaminated)


@pytest.fixture(scope="module")
def recording(trials) -> Synthetic:
    return make(trials, sfreq=256.0)


def band_passed(x: np.ndarray, sfreq: float) -> np.ndarray:
    return mne.filter.filter_data(x.astype(float), sfreq, 1.0, 40.0, verbose="error")


def channel(recording: Synthetic, name: str) -> np.ndarray:
    return recording.data_uv[recording.ch_names.index(name)]


@pytest.mark.parametrize("sfreq", [100.0, 128.0, 250.0, 1000.0])
def test_has_thirty_channels_at_any_rate(trials, sfreq):
    few = trials.iloc[:40]
    made = make(few, sfreq=sfreq)
    assert made.data_uv.shape == (30, np.ceil((few["onset_s"].iloc[-1] + 5) * sfreq))
    assert made.data_uv.dtype == np.float32
    assert np.isfinite(made.data_uv).all()
    assert made.ch_names[:4] == ("Fp1", "Fp2", "F3", "F4")
    assert made.ch_names[-3:] == ("EOG1", "EOG2", "EOG3")
    assert made.ch_types == ("eeg",) * 27 + ("eog",) * 3
    assert np.abs(made.onset_samples / sfreq - few["onset_s"]).max() < 0.012 + 0.5 / sfreq


def test_a_single_move_makes_a_recording(trials):
    assert make(trials.iloc[:1]).data_uv.shape[1] == int(np.ceil((trials["onset_s"].iloc[0] + 5) * 128))


def test_reference_is_the_mean_of_the_mastoids(trials):
    made = make(trials.iloc[:100], bad_channels=0, noisy_channels=0)
    np.testing.assert_allclose(channel(made, "TP9"), -channel(made, "TP10"), atol=1e-3)


def test_equal_seeds_give_equal_bytes_and_others_do_not(trials):
    one, two, other = make(trials), make(trials), make(trials, seed=2)
    assert one.data_uv.tobytes() == two.data_uv.tobytes()
    assert one.onset_samples.tobytes() == two.onset_samples.tobytes()
    for name, table in one.truth.items():
        same = table.equals(two.truth[name]) if isinstance(table, pd.DataFrame) else table == two.truth[name]
        assert same, name
    assert not np.array_equal(one.data_uv, other.data_uv)


@pytest.mark.parametrize("block", [777, 4096])
def test_bytes_do_not_depend_on_the_size_of_the_blocks(trials, monkeypatch, block):
    few = trials.iloc[:60]
    whole = make(few).data_uv.tobytes()
    monkeypatch.setattr(generator, "_BLOCK", block)
    assert make(few).data_uv.tobytes() == whole


SCRIPT = """
import hashlib, numpy as np, pandas as pd
from hrcneuro.eeg.synthetic import SyntheticParams, generate
n = 20
trials = pd.DataFrame({"onset_s": 5 + 0.9 * np.arange(n), "actor": ["human", "robot"] * (n // 2), "error": False,
    "prev_error": False, "condition_before": "RH", "turn": False, "scenario": "iC"})
made = generate(trials, params=SyntheticParams(), sfreq=1000.0, rng=np.random.default_rng(1))
print(hashlib.sha256(made.data_uv.tobytes()).hexdigest())
"""


def test_bytes_do_not_depend_on_the_number_of_threads_nor_on_the_processor_of_the_matrix_products():
    hashes = set()
    for threads, processor in (("1", "Nehalem"), ("2", "Haswell")):
        env = os.environ | {"OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads, "MKL_NUM_THREADS": threads}
        env |= {"OPENBLAS_CORETYPE": processor}
        done = subprocess.run([sys.executable, "-c", SCRIPT], env=env, capture_output=True, text=True, check=True)
        hashes.add(done.stdout)
    assert len(hashes) == 1
    assert len(hashes.pop().strip()) == len(hashlib.sha256().hexdigest())


def test_parameters_load_without_numeric_libraries():
    code = "import sys, hrcneuro.eeg.synthetic as s; s.SyntheticParams(); print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_another_effect_changes_nothing_but_the_moves_that_carry_it(trials):
    with_, without = (make(trials, seed=2, effect=effect) for effect in ("anticipation", "none"))
    difference = np.abs(with_.data_uv[:27] - without.data_uv[:27]).max(axis=0)
    touched = np.zeros(len(difference), dtype=bool)
    for onset in trials["onset_s"][with_.truth["trials"]["carries"].to_numpy()]:
        touched[int(onset * 128) : int((onset + 1.2) * 128)] = True
    held = with_.truth["bad_channels"]["kind"].eq("flat")
    assert not held.any(), "take a seed without a flat channel, which keeps what it had at its start"
    assert 0 < touched.mean() < 0.5
    assert difference[~touched].max() < 1e-3
    assert difference[touched].max() > 5


def test_background_falls_as_the_power_law_says(trials):
    made = make(trials, sfreq=256.0, **QUIET | {"background_uv": 10.0})
    f, power = welch(made.data_uv[:27], 256.0, nperseg=1024)
    inside = (f >= 2) & (f <= 60)
    slopes = np.polyfit(np.log(f[inside]), np.log(power[:, inside]).T, 1)[0]
    np.testing.assert_allclose(slopes, -made.truth["subject"]["exponent"], atol=0.08)
    rms = np.sqrt((band_passed(made.data_uv[:27], 256.0) ** 2).mean())
    # Patches wax and wane, which adds to the power; a short recording scatters.
    assert rms == pytest.approx(made.truth["subject"]["background_uv"], rel=0.4)


def test_alpha_peaks_over_the_occiput_at_the_subjects_frequency(recording):
    f, power = welch(channel(recording, "O1"), 256.0, nperseg=1024)
    band = (f >= 7) & (f <= 13)
    peak = f[band][power[band].argmax()]
    assert peak == pytest.approx(recording.truth["subject"]["alpha_hz"], abs=0.6)
    flank = power[(f >= 5) & (f < 6.5) | (f > 14) & (f <= 16)].mean()
    assert power[band].max() > 2.5 * flank


@pytest.mark.parametrize("line_hz", [50.0, 60.0])
def test_hum_stands_out_at_the_power_lines_frequency(trials, line_hz):
    made = make(trials.iloc[:100], sfreq=256.0, line_hz=line_hz)
    f, power = welch(made.data_uv[:27], 256.0, nperseg=1024)
    assert np.median(power[:, f == line_hz] / power[:, f == line_hz - 5]) > 10
    assert made.truth["sources"]["hum_sin"].abs().max() > 0


def test_hum_above_the_nyquist_frequency_is_left_out(trials):
    made = make(trials.iloc[:40], sfreq=100.0)
    assert made.truth["sources"]["hum_sin"].abs().max() == 0


def test_amplitudes_are_those_of_eeg(recording):
    eeg = band_passed(recording.data_uv, 256.0)
    assert 8 < np.median(eeg[:27].std(axis=1)) < 14
    raw = np.abs(recording.data_uv)
    assert 50 < np.median(raw) < 300  # offsets and drift
    assert np.abs(np.corrcoef(eeg[[16, 18, 22]])).min() > 0.3  # P3, P7 and O1 are neighbours


def test_central_rhythm_sinks_around_the_humans_moves(trials):
    made = make(trials, sfreq=128.0, variability=0.0)
    wave, t = made.truth["sources"]["mu_C3"].to_numpy(), made.truth["sources"]["time_s"].to_numpy()
    human = trials.loc[trials["actor"] == "human", "onset_s"].to_numpy()
    near = np.abs(t[:, None] - human[None]).min(axis=1)
    assert (wave[near < 0.25] ** 2).mean() < 0.5 * (wave[near > 0.8] ** 2).mean()


def test_contaminated_recordings_exceed_a_millivolt_and_others_do_not(trials):
    share = {}
    for contaminated in (False, True):
        made = make(trials, contaminated=contaminated)
        x = band_passed(made.data_uv[:27], 128.0)
        epochs = x[:, np.clip(made.onset_samples[:, None] + np.arange(-26, 154), 0, x.shape[1] - 1)]
        share[contaminated] = (np.abs(epochs).max(axis=(0, 2)) > 1000).mean()
        assert bool(len(made.truth["jolts"])) is contaminated
    assert share[False] == 0
    assert share[True] > 0.2


def test_subjects_differ_unless_told_not_to(trials):
    few = trials.iloc[:40]
    alike = [make(few, seed=s, variability=0.0).truth["subject"] for s in (1, 2)]
    assert alike[0] == alike[1]
    values = [make(few, seed=s).truth["subject"]["alpha_hz"] for s in range(8)]
    assert 0.2 < np.std(values) < 1.2


@pytest.mark.parametrize("effect", EFFECTS)
def test_every_effect_has_a_calibrated_size(effect):
    assert (SyntheticParams(effect=effect).size_uv > 0) is (effect != "none")
    assert SyntheticParams(effect=effect, effect_uv=3.0).size_uv == 3.0


def test_mistakes_are_named(trials):
    with pytest.raises(ValueError, match=r"'anticipaton'; allowed: anticipation, "):
        SyntheticParams(effect="anticipaton")
    with pytest.raises(ValueError, match="blink_uv = -1"):
        SyntheticParams(blink_uv=-1)
    with pytest.raises(SlowSamplingError, match="64 Hz"):
        make(trials, sfreq=64.0)
    with pytest.raises(MovesError, match="got none"):
        make(trials.iloc[:0])
    with pytest.raises(MovesError, match="move 0 has onset_s = nan"):
        make(trials.assign(onset_s=np.nan))
    with pytest.raises(MovesError, match=r"move 2 has onset_s = .*temporal order"):
        make(trials.iloc[[0, 5, 1]])
