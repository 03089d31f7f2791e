"""What was planted is what the truth says, and analysis finds it again."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from hrcneuro.eeg.synthetic import SyntheticParams, generate, planted_average
from hrcneuro.eeg.synthetic.background import dipole_mixing, shaped_noise
from hrcneuro.eeg.synthetic.defects import INTERMITTENT, THROUGHOUT
from hrcneuro.eeg.synthetic.head import CH_NAMES, head, to_mastoids
from hrcneuro.eeg.synthetic.responses import carries
from hrcneuro.paradigm.session import SessionParams, simulate_session

SFREQ = 128.0


def session(seed: int) -> pd.DataFrame:
    small = SessionParams(practice_episodes=1, blocks=4, episodes_per_block=8)
    return simulate_session(small, rng=np.random.default_rng([9, seed]))


@pytest.fixture(scope="module")
def study():
    """Six subjects of a third of the study's length, with an effect that so few trials can show."""
    tables = [session(s) for s in range(6)]
    params = SyntheticParams(effect_uv=20.0, bad_channels=0, noisy_channels=0)
    return [
        (t, generate(t, params=params, sfreq=SFREQ, rng=np.random.default_rng([4, s]))) for s, t in enumerate(tables)
    ]


def filtered(x: np.ndarray) -> np.ndarray:
    import mne

    return mne.filter.filter_data(x.astype(float), SFREQ, 1.0, 40.0, verbose="error")


def without_eyes(x: np.ndarray) -> np.ndarray:
    weights = np.linalg.lstsq(x[27:].T, x[:27].T, rcond=None)[0]
    return x[:27] - weights.T @ x[27:]


def test_carriers_are_the_moves_that_each_effect_names():
    trials = pd.DataFrame(
        {
            "condition_before": ["RH", "RR", None, pd.NA, "HR"],
            "prev_error": [True, True, False, None, np.nan],
            "turn": [False, True, False, None, True],
        }
    )
    assert carries(trials, "anticipation").tolist() == [1, 0, 0, 0, 0]
    assert carries(trials, "post_error").tolist() == [1, 1, 0, 0, 0]
    assert carries(trials, "turn").tolist() == [0, 1, 0, 0, 1]
    assert carries(trials, "both").tolist() == [2, 1, 0, 0, 0]
    assert carries(trials, "none").tolist() == [0, 0, 0, 0, 0]


def test_planted_sizes_follow_the_parameters():
    trials = pd.concat([session(s) for s in range(3)], ignore_index=True)
    trials["onset_s"] = 5 + 0.9 * np.arange(len(trials))
    params = SyntheticParams(effect_uv=6.0, sequential_share=0.5, variability=0.0)
    made = generate(trials, params=params, sfreq=SFREQ, rng=np.random.default_rng(0)).truth["trials"]
    carrying = made["carries"].to_numpy()
    assert carrying.tolist() == [c == "RH" for c in trials["condition_before"]]
    for scenario, size in (("iC", 6.0), ("sC", 3.0)):
        extra = made["extra_uv"][carrying & (trials["scenario"] == scenario).to_numpy()]
        assert extra.mean() == pytest.approx(size, rel=0.15)
        assert np.log(extra).std() == pytest.approx(0.4, rel=0.2)
    assert made["positivity_uv"][~carrying].mean() == pytest.approx(4.0, rel=0.05)
    assert made["latency_ms"].mean() == pytest.approx(500.0, abs=6)
    assert made["latency_ms"].std() == pytest.approx(40.0, rel=0.1)
    assert ((made["error_uv"] > 0) == trials["error"]).all()
    assert ((made["motor_uv"] > 0) == (trials["actor"] == "human")).all()


def test_grand_average_recovers_the_planted_responses(study):
    times = np.arange(-0.2, 0.6, 1 / SFREQ)
    found, planted, extra, planted_extra = [], [], [], []
    for trials, made in study:
        clean = without_eyes(filtered(made.data_uv))
        index = made.onset_samples[:, None] + np.round(times * SFREQ).astype(int)
        epochs = clean[:, index] - clean[:, index[:, times < 0]].mean(axis=2, keepdims=True)
        epochs -= epochs.mean(axis=0)
        ahead = trials["condition_before"].astype(object)
        takeover, same = (ahead == "RH").to_numpy(bool), (ahead == "RR").to_numpy(bool)
        found.append(epochs.mean(axis=1))
        planted.append(planted_average(made.truth, times)[:27])
        extra.append(epochs[:, takeover].mean(axis=1) - epochs[:, same].mean(axis=1))
        truth = made.truth
        planted_extra.append((planted_average(truth, times, takeover) - planted_average(truth, times, same))[:27])
    for measured, true, regions in (
        (found, planted, (["Fz"], ["Cz"], ["FC1"], ["FC2"], ["O1"], ["O2"])),
        (extra, planted_extra, (["Fz", "Cz", "FC1", "FC2"],)),
    ):
        mean, target = np.mean(measured, axis=0), np.mean(true, axis=0)
        target = target - target[:, times < 0].mean(axis=1, keepdims=True)
        target -= target.mean(axis=0)
        for names in regions:
            at = [CH_NAMES.index(c) for c in names]
            assert np.corrcoef(mean[at].mean(axis=0), target[at].mean(axis=0))[0, 1] >= 0.95, names


def test_blinks_are_where_and_as_large_as_the_truth_says(study):
    for _, made in study:
        x = filtered(made.data_uv)
        blinks = made.truth["blinks"]
        at = np.round(blinks["peak_s"].to_numpy() * SFREQ).astype(int)
        forehead = x[CH_NAMES.index("EOG3"), at]
        # The band-pass takes a part of a blink's height.
        ratio = np.median(forehead / blinks["amplitude_uv"])
        assert 0.6 < ratio < 1.2
        gain = made.truth["topographies"]["blink"]
        assert 0.4 < gain["Fp1"] < 1.2
        assert gain["Fp1"] > gain["F3"] > gain["C3"] > gain["O1"] > -0.1
        sideways = made.truth["topographies"]["horizontal"]
        assert sideways["EOG1"] < -0.5 < 0.5 < sideways["EOG2"]
        per_min = 60 * len(blinks) / (made.data_uv.shape[1] / SFREQ)
        assert 7 < per_min < 25


def test_regression_on_the_eog_channels_takes_nine_tenths_of_the_blinks(study):
    frontal = [CH_NAMES.index(c) for c in ("Fp1", "Fp2", "F3", "F4", "F7", "F8", "Fz")]
    for _, made in study:
        weights = np.linalg.lstsq(filtered(made.data_uv[27:]).T, filtered(made.data_uv[:27]).T, rcond=None)[0]
        sources, gains = made.truth["sources"], made.truth["topographies"]
        alone = sum(np.outer(gains[s], sources[s]) for s in ("blink", "lid"))
        left = alone[:27] - weights.T @ alone[27:]
        assert (left[frontal] ** 2).sum() < 0.1 * (alone[frontal] ** 2).sum()


def test_sources_times_topographies_are_the_recording_without_its_noise():
    trials = session(0).iloc[:60]
    off = dict.fromkeys(("background_uv", "sensor_uv", "drift_uv", "bad_channels", "noisy_channels"), 0)
    made = generate(trials, params=SyntheticParams(**off), sfreq=SFREQ, rng=np.random.default_rng(2))
    sources = made.truth["sources"].drop(columns="time_s")
    rebuilt = made.truth["topographies"][sources.columns].to_numpy() @ sources.to_numpy().T
    offsets = made.data_uv - rebuilt  # what is left are the electrodes' constant offsets
    assert np.abs(offsets - offsets.mean(axis=1, keepdims=True)).max() < 0.01


def test_thirty_processes_stand_for_many_dipoles():
    """The mixing's covariance is that of explicitly drawn dipoles: same draws, same matrix up to scale."""
    mixing = dipole_mixing(np.random.default_rng(3), 200)
    rng, model = np.random.default_rng(3), head()
    place = rng.integers(len(model.dipoles), size=200)
    moment = rng.standard_normal((200, 3))
    moment /= np.linalg.norm(moment, axis=1, keepdims=True)
    moment *= np.exp(0.5 * rng.standard_normal(200))[:, None]
    gain = to_mastoids(np.einsum("cdk,dk->cd", model.gain[:, place], moment))
    explicit = gain @ gain.T
    explicit /= np.diag(explicit)[:27].mean()
    np.testing.assert_allclose(mixing @ mixing.T, explicit, atol=1e-9)


def test_a_dipole_looks_as_volume_conduction_has_it():
    model = head()
    below_cz = np.argmax(
        model.dipoles @ (model.electrodes[CH_NAMES.index("Cz")] / np.linalg.norm(model.electrodes[25]))
    )
    radial = model.gain[:, below_cz] @ (model.dipoles[below_cz] / np.linalg.norm(model.dipoles[below_cz]))
    assert CH_NAMES[int(radial[:27].argmax())] == "Cz"
    assert radial[CH_NAMES.index("Cz")] > 2 * np.abs(radial[[CH_NAMES.index("Fp1"), CH_NAMES.index("O1")]]).max()
    # Some tens of nA·m give some microvolts, as in the literature.
    assert 0.01 < radial.max() < 1.0


def kurtosis(x: np.ndarray) -> float:
    x = x - x.mean()
    return float((x**4).mean() / (x**2).mean() ** 2)


def planted_kurtosis(plant, seed: int) -> float:
    rng = np.random.default_rng(seed)
    f = np.fft.rfftfreq(2 * 30000, 1 / SFREQ).astype(np.float32)
    row = 10 * shaped_noise(rng, np.maximum(f, 0.2) ** np.float32(-0.65), 60000, SFREQ)
    before = row.copy()
    spans = plant(rng, row, SFREQ)
    inside = np.zeros(len(row), dtype=bool)
    for start, stop in spans:
        assert 0 <= start < stop <= len(row) / SFREQ + 1e-9
        inside[int(start * SFREQ) : int(stop * SFREQ)] = True
    assert np.array_equal(row[~inside], before[~inside])
    assert not np.array_equal(row, before)
    return kurtosis(filtered(row))


@pytest.mark.parametrize("kind", INTERMITTENT)
def test_kurtosis_sees_what_comes_and_goes(kind):
    # Real channels lie between 3.2 and 4.5.
    assert min(planted_kurtosis(INTERMITTENT[kind], seed) for seed in range(6)) > 4.5


@pytest.mark.parametrize("kind", THROUGHOUT)
def test_kurtosis_does_not_see_what_stays(kind):
    assert max(planted_kurtosis(THROUGHOUT[kind], seed) for seed in range(6)) < 3.6


def test_bad_channels_are_few_and_never_the_mastoids():
    trials = session(1).iloc[:60]
    counts, noisy = set(), set()
    for seed in range(25):
        made = generate(trials, params=SyntheticParams(), sfreq=100.0, rng=np.random.default_rng(seed))
        bad = made.truth["bad_channels"]
        assert not set(bad["channel"]) & {"TP9", "TP10", "EOG1", "EOG2", "EOG3"}
        counts.add(bad.loc[bad["intermittent"], "channel"].nunique())
        noisy.add(bad.loc[~bad["intermittent"], "channel"].nunique())
        assert set(bad["kind"][bad["intermittent"]]) <= set(INTERMITTENT)
        assert set(bad["kind"][~bad["intermittent"]]) <= set(THROUGHOUT)
    assert counts == {0, 1, 2, 3}
    assert noisy == {0, 1}


def test_channels_of_a_sound_recording_have_the_kurtosis_of_real_ones(study):
    values = [kurtosis(row) for _, made in study for row in without_eyes(filtered(made.data_uv))]
    assert 3.1 < np.median(values) < 3.8
    assert np.percentile(values, 90) < 5
