"""EEGLAB's sample recording, step by step: firfilt, BIOSIG, pop_rejchan and eeg_interp written out from their paramss.

The paramss are in the literature that the modules cite. Nothing of hrcneuro's numerics is used on the expected side,
and the file is read by its own format: single-precision µV. ORIGINAL holds a few of the numbers that the original
functions themselves give, in GNU Octave 7.3 and double precision: pop_eegfiltnew's design and firfilt (as in 1.6.2 to
2.7.1) with windows and firws as synchronised with FieldTrip in firfilt 2.0, BIOSIG's regress_eog with covm, EEGLAB's
rejkurt with kurt, the spheric_spline of eeg_interp, and the matrix of reref.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mne
import numpy as np
import pytest
from numpy.polynomial.legendre import legval
from pymatreader import read_mat

from hrcneuro.contract import Inputs
from hrcneuro.eeg import cleaning, filters
from hrcneuro.io.fif import write_raw
from hrcneuro.stages import preprocess

FOLDER = Path(__file__).parents[3] / "shared/data/eeglab_sample"
REJECTED = ["FPz", "T7", "T8", "P7"]
# Where: taps at TAPS, weights of FPz, z of REJECTED, and each step's signal at SAMPLES (channel, sample), in µV.
TAPS = [0, 100, 180, 212]
SAMPLES = [("FPz", 0), ("FPz", 5000), ("T7", 5000), ("Oz", 15000), ("Oz", 30503)]
ORIGINAL = {
    # pop_eegfiltnew(EEG, 1, 40, 424): the transition band is 3.3 / 424 of the sampling rate.
    "achieved": {
        "taps": [1.5977192947780252e-4, 2.4988998879713737e-5, -6.743595246629097e-5, 0.6249179454639464],
        "weights": [-0.6501782243720102, 1.294804935134052],
        "z": [111.11600692535282, 2.4244832346765643, 5.201001676613442, 2.1228122626239316],
        "filtered": [-0.29049738822252, -0.52225384286069, 5.28040210508388, -18.36469310032177, 2.61455760105985],
        "eog": [-7.89310978002404, -8.41120448948108, 0.48843922000564, -15.9988907032698, 3.56470767209939],
        "interpolated": [-3.17655991193636, 4.5102867352727, 6.37977278167819, -15.9988907032698, 3.56470767209939],
        "reference": [-4.54282187380943, -3.45391742363722, -1.58443137723173, -4.57306491779609, -4.87728473187825],
    },
    # pop_eegfiltnew(EEG, 1, 40): it finds the same order, and keeps the 1 Hz that it asked for.
    "requested": {
        "taps": [1.6304055392619832e-4, -2.470715685236953e-6, -3.038636605752574e-5, 0.6249722274630537],
        "weights": [-0.6498970572694651, 1.2943840838618406],
        "z": [111.16605613535427, 2.422247084126066, 5.197261903470498, 2.1229776126769315],
        "filtered": [-0.26795680750637, -0.49662142755003, 5.28861046181038, -18.38658743384648, 2.60416411651807],
        "eog": [-7.8662070783135, -8.38554433769849, 0.49758838470589, -16.01961157918245, 3.55268233488859],
        "interpolated": [-3.15547957126391, 4.52998943143312, 6.39044887731551, -16.01961157918245, 3.55268233488859],
        "reference": [-4.5310777135974, -3.44238588307991, -1.58192643719753, -4.58316393763854, -4.88364078848042],
    },
}


@dataclass
class Recording:
    eeg: np.ndarray
    eog: np.ndarray
    names: list[str]
    positions: np.ndarray
    sfreq: float


@pytest.fixture(scope="module")
def recording() -> Recording:
    if not FOLDER.exists():
        pytest.skip("EEGLAB's sample recording is not there (../shared/data)")
    header = read_mat(FOLDER / "eeglab_data.set")
    header = header.get("EEG", header)
    shape = int(header["pnts"]), int(header["nbchan"])
    data = np.fromfile(FOLDER / "eeglab_data.fdt", "<f4").reshape(shape).T.astype(float)
    places = header["chanlocs"]
    names = list(places["labels"])
    is_eog = np.array([name.startswith("EOG") for name in names])
    at = np.column_stack([[float(places[axis][i]) for i in np.flatnonzero(~is_eog)] for axis in "XYZ"])
    eeg_names = [n for n, e in zip(names, is_eog, strict=True) if not e]
    return Recording(data[~is_eog], data[is_eog], eeg_names, at, float(header["srate"]))


@pytest.fixture(scope="module")
def expected(recording) -> dict[str, np.ndarray]:
    taps = firfilt_taps(recording.sfreq)
    eeg, eog = (np.array([filtered(x, taps) for x in part]) for part in (recording.eeg, recording.eog))
    noise, signal = eog - eog.mean(axis=1, keepdims=True), eeg - eeg.mean(axis=1, keepdims=True)
    weights = np.linalg.solve(noise @ noise.T, noise @ signal.T).T
    corrected = signal - weights @ noise
    z = normalised_kurtosis(corrected)
    interpolated = spherical(corrected, np.abs(z) > 2, recording.positions)
    return {
        "taps": taps,
        "filtered": eeg,
        "eog_weights": weights,
        "eog": corrected,
        "z": z,
        "interpolated": interpolated,
        "reference": interpolated - interpolated.mean(axis=0),
    }


def firfilt_taps(sfreq: float) -> np.ndarray:
    """pop_eegfiltnew(EEG, 1, 40, 424) at 128 Hz: a transition band of 0.996226 Hz, two low-passes."""
    order = 424
    width = 3.3 / order * sfreq
    assert width == pytest.approx(0.996226, abs=1e-6)
    n = np.arange(order + 1)
    window = 0.54 - 0.46 * np.cos(2 * np.pi * n / order)

    def low_pass(cutoff: float) -> np.ndarray:
        angle = 2 * np.pi * cutoff / sfreq
        centred = n - order // 2
        sinc = np.where(centred == 0, angle, np.sin(angle * centred) / np.where(centred == 0, 1, centred))
        return sinc * window / (sinc * window).sum()

    return low_pass(40 + width / 2) - low_pass(1 - width / 2)


def filtered(x: np.ndarray, taps: np.ndarray) -> np.ndarray:
    half = len(taps) // 2
    return np.convolve(np.concatenate([np.full(half, x[0]), x, np.full(half, x[-1])]), taps, "valid")


def normalised_kurtosis(x: np.ndarray) -> np.ndarray:
    x = x - x.mean(axis=1, keepdims=True)
    value = (x**4).mean(axis=1) / (x**2).mean(axis=1) ** 2 - 3
    cut = round(0.1 * len(value))
    kept = np.sort(value)[max(cut, 1) - 1 : len(value) - cut]
    return (value - kept.mean()) / kept.std(ddof=1)


def spherical(x: np.ndarray, bad: np.ndarray, at: np.ndarray) -> np.ndarray:
    """eeg_interp: 1 - chord for the cosine, m = 4, 7 terms, mean of the good channels off and on again."""
    at = at / np.linalg.norm(at, axis=1, keepdims=True)
    n = np.arange(1, 8)
    series = np.concatenate([[0], (2 * n + 1) / (n**4 * (n + 1.0) ** 4)])

    def g(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return legval(1 - np.linalg.norm(a[:, None] - b[None], axis=-1), series) / (4 * np.pi)

    good = x[~bad]
    mean = good.mean(axis=0)
    system = np.vstack([g(at[~bad], at[~bad]), np.ones(len(good))])
    weights = np.linalg.pinv(system) @ np.vstack([good - mean, np.zeros(x.shape[1])])
    out = x.copy()
    out[bad] = g(at[bad], at[~bad]) @ weights + mean
    return out


def test_in_memory_to_a_millionth_of_a_microvolt(recording, expected):
    found, steps = cleaned(recording, "achieved")
    for name in cleaning.STEPS:
        np.testing.assert_allclose(steps[name], expected[name], rtol=0, atol=1e-6, err_msg=name)
    np.testing.assert_allclose(found.weights, expected["eog_weights"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.z, expected["z"], rtol=0, atol=1e-9)
    assert [n for n, bad in zip(recording.names, found.interpolated, strict=True) if bad] == REJECTED


@pytest.mark.parametrize("transition", sorted(ORIGINAL))
def test_numbers_of_the_original_functions(recording, transition):
    original = ORIGINAL[transition]
    taps = filters.bandpass_taps(128, 1, 40, transition=transition)
    np.testing.assert_allclose(taps[TAPS], original["taps"], rtol=0, atol=1e-14)
    found, steps = cleaned(recording, transition)
    np.testing.assert_allclose(found.weights[recording.names.index("FPz")], original["weights"], rtol=0, atol=1e-11)
    np.testing.assert_allclose(found.z[found.interpolated], original["z"], rtol=0, atol=1e-9)
    rows, columns = [recording.names.index(name) for name, _ in SAMPLES], [sample for _, sample in SAMPLES]
    for name in cleaning.STEPS:
        np.testing.assert_allclose(steps[name][rows, columns], original[name], rtol=0, atol=1e-10, err_msg=name)


def cleaned(recording: Recording, transition: str) -> tuple[cleaning.Cleaned, dict[str, np.ndarray]]:
    data = np.vstack([recording.eeg, recording.eog])
    signals = cleaning.Signals(data, recording.sfreq, recording.names, ["EOG1", "EOG2"], recording.positions)
    steps: dict[str, np.ndarray] = {}
    params = cleaning.CleaningParams(sfreq=128, transition=transition)
    found = cleaning.clean(signals, params, on_step=lambda name, eeg: steps.update({name: eeg.copy()}))
    return found, steps


@pytest.mark.filterwarnings("ignore:The inplace keyword")
def test_through_artifacts_to_a_tenthousandth(recording, expected, tmp_path):
    raw = mne.io.read_raw_eeglab(FOLDER / "eeglab_data.set", preload=True, verbose="error")
    raw.set_channel_types({name: "eog" for name in raw.ch_names if name.startswith("EOG")})
    (tmp_path / "acquire").mkdir()
    (tmp_path / "out").mkdir()
    write_raw(raw, tmp_path / "acquire" / "demo_raw.fif")
    config = preprocess.Config(sfreq=128.0, keep_steps=True)
    preprocess.run(config, Inputs.of("demo", acquire=tmp_path / "acquire"), tmp_path / "out")
    steps = np.load(tmp_path / "out" / "steps.npz")
    np.testing.assert_allclose(steps["taps"], expected["taps"], rtol=0, atol=1e-12)
    for name in cleaning.STEPS:
        assert steps[name].dtype == np.float64
        np.testing.assert_allclose(steps[name], expected[name], rtol=0, atol=1e-4, err_msg=name)
    np.testing.assert_allclose(steps["eog_weights"], expected["eog_weights"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(steps["z"], expected["z"], rtol=0, atol=1e-4)
    assert steps["channels"][steps["rejected"]].tolist() == REJECTED
