import dataclasses
from itertools import pairwise
from pathlib import Path

import mne
import numpy as np
import pytest

from hrcneuro.eeg import channels, cleaning, filters, interpolation, ocular, refusals, resample

SAMPLE = Path(__file__).parents[2] / "../shared/data/eeglab_sample/eeglab_data.set"
PARAMS = cleaning.CleaningParams()


@pytest.fixture(scope="module")
def sample():
    if not SAMPLE.exists():
        pytest.skip("EEGLAB's sample recording is not there (../shared/data)")
    raw = mne.io.read_raw_eeglab(SAMPLE, preload=True, eog=["EOG1", "EOG2"], verbose="error")
    return raw.reorder_channels([n for n in raw.ch_names if "EOG" not in n] + ["EOG1", "EOG2"])


def signals_of(raw):
    eeg = raw.ch_names[:-2]
    at = np.array([ch["loc"][:3] for ch in raw.info["chs"][:-2]])
    return cleaning.Signals(raw.get_data() * 1e6, raw.info["sfreq"], eeg, raw.ch_names[-2:], at)


@pytest.fixture
def signals():
    rng = np.random.default_rng(11)
    points = rng.standard_normal((8, 3))
    points *= 0.085 / np.linalg.norm(points, axis=1, keepdims=True)
    eog = 30 * rng.standard_normal((2, 6000))
    eeg = 10 * rng.standard_normal((8, 6000)) + rng.uniform(-1, 1, (8, 2)) @ eog + 4000
    eeg[2, 3000:3050] += 3000 * rng.standard_normal(50)
    names = [f"c{i}" for i in range(8)]
    return cleaning.Signals(np.vstack([eeg, eog]), 1000.0, names, ["EOG1", "EOG2"], points, borders=[2000])


def step_by_step(signals, params):
    """The chain written out without blocks, views and in-place work."""
    data = signals.data.copy()
    taps = filters.bandpass_taps(signals.sfreq, params.l_freq, params.h_freq)
    half, edges, parts = len(taps) // 2, [0, *signals.borders, data.shape[1]], []
    for a, b in pairwise(edges):
        padded = np.pad(data[:, a:b], ((0, 0), (half, half)), mode="edge")
        parts.append(np.array([np.convolve(channel, taps, mode="valid") for channel in padded]))
    filtered = np.hstack(parts)
    n = len(signals.eeg_names)
    noise, eeg = filtered[n:], filtered[:n]
    design = np.vstack([np.ones(noise.shape[1]), noise])
    eog = eeg - np.linalg.lstsq(design.T, eeg.T)[0].T @ design
    z = channels.trimmed_z(np.array([channels.kurtosis(channel) for channel in eog]))
    bad, good = np.flatnonzero(np.abs(z) > params.threshold), np.flatnonzero(np.abs(z) <= params.threshold)
    at = signals.positions
    interpolated = eog.copy()
    interpolated[bad] = interpolation.weights(at[good], at[bad], method=params.interpolation) @ eog[good]
    return {
        "filtered": eeg,
        "eog": eog,
        "interpolated": interpolated,
        "reference": interpolated - interpolated.mean(axis=0),
    }, np.array(signals.eeg_names)[bad].tolist()


def run(signals, params=PARAMS):
    steps = {}
    cleaned = cleaning.clean(signals, params, on_step=lambda name, eeg: steps.update({name: eeg.copy()}))
    return cleaned, steps


@pytest.mark.parametrize("method", ["eeglab", "perrin"])
def test_the_chain_is_its_steps_written_out(signals, method):
    params = dataclasses.replace(PARAMS, interpolation=method)
    expected, bad = step_by_step(signals, params)
    cleaned, steps = run(signals, params)
    assert tuple(steps) == cleaning.STEPS
    for name, eeg in expected.items():
        np.testing.assert_allclose(steps[name], eeg, rtol=0, atol=1e-7, err_msg=name)
    assert [n for n, yes in zip(signals.eeg_names, cleaned.interpolated, strict=True) if yes] == bad
    assert "c2" in bad
    made = resample.ratio(1000, 512)
    np.testing.assert_allclose(
        cleaned.eeg,
        resample.resample(steps["reference"].copy(), made, pass_freq=40.5, borders=[2000]),
        atol=1e-12,
    )


def test_real_recording_loses_the_channels_that_eeglab_rejects(sample):
    expected, bad = step_by_step(signals_of(sample), PARAMS)
    cleaned, steps = run(signals_of(sample))
    names = np.array(sample.ch_names[:-2])
    assert names[cleaned.interpolated].tolist() == bad == ["FPz", "T7", "T8", "P7"]
    for name, eeg in expected.items():
        np.testing.assert_allclose(steps[name], eeg, rtol=0, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(cleaned.eeg.mean(axis=0), 0, atol=1e-9)
    assert cleaned.ratio.sfreq == 128
    # Without the trimming one channel would hide the three others (design/eeg.md).
    plain = (cleaned.kurtosis - cleaned.kurtosis.mean()) / cleaned.kurtosis.std(ddof=1)
    assert (np.abs(plain) > 2).sum() == 1


def test_real_recording_step_by_step_against_mne(sample):
    made = filters.design(128, 1, 40)
    theirs = sample.copy().filter(
        1, 40, picks="all", l_trans_bandwidth=made.transition, h_trans_bandwidth=made.transition,
        filter_length=made.order + 1, pad="edge", verbose="error",
    )  # fmt: skip
    _, steps = run(signals_of(sample), dataclasses.replace(PARAMS, eog_offset=False, interpolation="perrin"))
    np.testing.assert_allclose(steps["filtered"], theirs.get_data(picks="eeg") * 1e6, rtol=0, atol=1e-11)
    theirs.set_eeg_reference([], verbose="error")
    model = mne.preprocessing.EOGRegression().fit(theirs)
    theirs = model.apply(theirs)
    np.testing.assert_allclose(steps["eog"], theirs.get_data(picks="eeg") * 1e6, rtol=0, atol=1e-10)
    weights, _ = ocular.regression_weights(steps["filtered"], theirs.get_data(picks="eog") * 1e6)
    np.testing.assert_allclose(weights, model.coef_, rtol=0, atol=1e-12)
    theirs.info["bads"] = ["FPz", "T7", "T8", "P7"]
    theirs.interpolate_bads(origin=(0.0, 0.0, 0.0), verbose="error")
    np.testing.assert_allclose(steps["interpolated"], theirs.get_data(picks="eeg") * 1e6, rtol=0, atol=1e-8)
    theirs.set_eeg_reference("average", verbose="error")
    np.testing.assert_allclose(steps["reference"], theirs.get_data(picks="eeg") * 1e6, rtol=0, atol=1e-8)


def test_real_recording_interpolations_differ_as_measured(sample):
    made = {m: run(signals_of(sample), dataclasses.replace(PARAMS, interpolation=m))[1] for m in interpolation.SPLINES}
    bad = [sample.ch_names.index(name) for name in ("FPz", "T7", "T8", "P7")]
    eeglab, perrin = (made[m]["interpolated"][bad] for m in interpolation.SPLINES)
    assert np.sqrt(np.mean((eeglab - perrin) ** 2) / np.mean(eeglab**2)) == pytest.approx(0.65, abs=0.005)


def test_causal_params_filters_causally(signals):
    params = dataclasses.replace(PARAMS, filter="causal", bad_channels="none", reference="none", eog="none")
    expected = filters.causal(signals.data[:8].copy(), 1000, 0.1, 40, borders=[2000])
    _, steps = run(signals, params)
    np.testing.assert_array_equal(steps["reference"], expected)


def test_flat_and_marked_channels_are_interpolated_and_said(signals):
    signals.data[5] = 70.0
    signals.marked = frozenset({"c6"})
    cleaned, _ = run(signals, dataclasses.replace(PARAMS, bad_channels="none"))
    assert dict(zip(signals.eeg_names, cleaned.reason, strict=True)) == dict.fromkeys(signals.eeg_names, "") | {
        "c5": "flat",
        "c6": "marked",
    }
    assert cleaned.interpolated.tolist() == [False] * 5 + [True, True, False]
    assert cleaned.rms_before[5] < 1e-6 < 1 < cleaned.rms_after[5]


def test_no_eog(signals):
    signals.eog_names, signals.data = [], signals.data[:8]
    with pytest.raises(refusals.NoEogError, match=r"no channel is EOG: c0, .*, c7 are EEG"):
        run(signals)


def test_regression_can_be_left_out(signals):
    signals.eog_names, signals.data = [], signals.data[:8]
    cleaned, steps = run(signals, dataclasses.replace(PARAMS, eog="none"))
    assert cleaned.weights.shape == (8, 0)
    np.testing.assert_array_equal(steps["eog"], steps["filtered"])


def test_singular_eog_is_recorded(signals):
    signals.data[9] = signals.data[8]
    cleaned, _ = run(signals)
    assert any("EOG1, EOG2 do not differ enough" in note for note in cleaned.warnings)
    assert np.isfinite(cleaned.weights).all()


def test_a_marked_eog_channel_takes_no_part_in_the_regression_and_is_said(signals):
    without = dataclasses.replace(signals, eog_names=["EOG1"], data=signals.data[:9].copy())
    _, expected = run(without)
    signals.data[9] += 500 * np.random.default_rng(1).standard_normal(6000)
    signals.marked = frozenset({"EOG2"})
    cleaned, steps = run(signals)
    np.testing.assert_array_equal(steps["eog"], expected["eog"])
    assert cleaned.weights.shape == (8, 2)
    assert np.all((cleaned.weights == 0) == [False, True])
    assert "EOG channels marked bad take no part in the regression: EOG2" in cleaned.warnings


def test_no_eog_that_is_not_marked(signals):
    signals.marked = frozenset({"EOG1", "EOG2"})
    with pytest.raises(refusals.MarkedEogError, match="all EOG channels are marked bad: EOG1, EOG2"):
        run(signals)
    cleaned, _ = run(signals, dataclasses.replace(PARAMS, eog="none"))
    assert not [note for note in cleaned.warnings if "EOG" in note]


@pytest.mark.parametrize("names", [["c0"], ["c0", "c1"]])
def test_the_average_of_one_channel_would_leave_nothing(signals, names):
    # The second channel is there, but bad and without a position: it is left out.
    n = len(names)
    one = dataclasses.replace(
        signals, data=np.delete(signals.data, range(n, 8), axis=0), eeg_names=names, positions=signals.positions[:n]
    )
    one.positions[1:] = np.nan
    one.marked = frozenset(names[1:])
    params = dataclasses.replace(PARAMS, unplaced="drop", bad_channels="none")
    untouched = one.data.copy()
    with pytest.raises(refusals.LoneChannelError, match=r"the average over 1 EEG channel \(c0\) "):
        run(one, params)
    one.data = untouched
    cleaned, _ = run(one, dataclasses.replace(params, reference="none"))
    assert cleaned.eeg.std() > 1


def ahead_s(signals, params):
    """Return how early a jump at 3 s shows (above 1e-3 µV of 50) in the clean signal, in seconds."""
    params = dataclasses.replace(params, eog="none", bad_channels="none", reference="none")
    jump = dataclasses.replace(signals, data=signals.data.copy())
    at = int(3 * signals.sfreq)
    jump.data[0, at:] += 50
    cleaned = [cleaning.clean(one, params) for one in (jump, signals)]
    changed = np.abs(cleaned[0].eeg[0] - cleaned[1].eeg[0]) > 1e-3
    return at / signals.sfreq - int(np.argmax(changed)) / cleaned[0].ratio.sfreq, cleaned[0].ahead_ms / 1000


@pytest.mark.parametrize(("source", "target"), [(1000.0, 512), (250.0, 128)])
def test_after_the_causal_filter_down_sampling_looks_as_far_ahead_as_it_says(signals, source, target):
    signals = dataclasses.replace(signals, sfreq=source)
    early, said = ahead_s(signals, dataclasses.replace(PARAMS, filter="causal", sfreq=target))
    assert 1 / source < early <= said < 0.1


def test_the_causal_chain_at_the_recordings_own_rate_does_not_look_ahead(signals):
    early, said = ahead_s(signals, dataclasses.replace(PARAMS, filter="causal", sfreq=1000))
    assert early <= 0
    assert said == 0


def test_samples_that_are_no_numbers(signals):
    signals.data[9, 5] = np.nan
    with pytest.raises(refusals.NotFiniteError, match=r"channel EOG2 .* sample 5"):
        run(signals)


def test_all_channels_bad(signals):
    signals.data[:8] = 1.0
    with pytest.raises(refusals.AllBadError, match=r"all 8 EEG channels are bad: c0 \(flat\)") as caught:
        run(signals)
    # No option of the kurtosis step would help.
    assert type(caught.value) is refusals.AllBadError


def test_too_few_good_channels(signals):
    signals.marked = frozenset(signals.eeg_names[2:])
    with pytest.raises(refusals.FewGoodError, match="6 bad channels cannot be interpolated from 2 good ones"):
        run(signals)


@pytest.mark.parametrize("missing", [np.nan, 0.0])
def test_a_bad_channel_without_position(signals, missing):
    signals.positions[2] = missing
    untouched = signals.data.copy()
    with pytest.raises(refusals.NoPositionError, match="without a position cannot be interpolated: c2"):
        run(signals)
    signals.data = untouched.copy()
    cleaned, steps = run(signals, dataclasses.replace(PARAMS, unplaced="drop"))
    assert cleaned.dropped.tolist() == [False, False, True] + [False] * 5
    assert len(cleaned.eeg) == len(steps["reference"]) == 7
    np.testing.assert_allclose(cleaned.eeg.mean(axis=0), 0, atol=1e-9)
    assert "left out: c2" in cleaned.warnings[0]
    assert np.isnan(cleaned.rms_after).tolist() == cleaned.dropped.tolist()
    signals.data = untouched.copy()
    cleaned, steps = run(signals, dataclasses.replace(PARAMS, unplaced="keep"))
    np.testing.assert_array_equal(steps["interpolated"][2], steps["eog"][2])
    assert "left as they are: c2" in cleaned.warnings[0]


def test_a_good_channel_without_position_is_kept_but_no_source(signals):
    signals.positions[7] = np.nan
    at = signals.positions
    cleaned, steps = run(signals)
    assert not cleaned.reason[7]
    source = [i for i in range(7) if not cleaned.reason[i]]
    matrix = interpolation.weights(at[source], at[2:3], method="eeglab")
    np.testing.assert_allclose(steps["interpolated"][2], (matrix @ steps["eog"][source])[0], atol=1e-9)


def test_rates_that_do_not_fit(signals):
    with pytest.raises(refusals.BandError, match="does not fit a sampling rate of 60 Hz"):
        run(dataclasses.replace(signals, sfreq=60.0))
    with pytest.raises(refusals.RateError, match="does not fit a sampling rate of 80 Hz"):
        run(signals, dataclasses.replace(PARAMS, sfreq=80))


def test_a_rate_without_a_simple_ratio_is_recorded(signals):
    cleaned, _ = run(dataclasses.replace(signals, sfreq=1000.1))
    assert cleaned.ratio.sfreq == pytest.approx(512, abs=0.01)
    assert any("no simple ratio" in note for note in cleaned.warnings)


@pytest.fixture
def one_noisy(signals):
    """Signals whose channels go with each other, but c5, which is noise of usual size from beginning to end."""
    rng = np.random.default_rng(3)
    eeg = rng.uniform(0.5, 1.5, (8, 2)) @ (20 * rng.standard_normal((2, 6000))) + 3 * rng.standard_normal((8, 6000))
    eeg[5] = 20 * rng.standard_normal(6000)
    signals.data[:8] = eeg
    return signals


def test_a_steadily_noisy_channel_is_flagged_and_nothing_else_is_done(one_noisy):
    strict = dataclasses.replace(PARAMS, noisy_deviation=0.1, noisy_correlation=1.0)
    data = one_noisy.data.copy()
    cleaned, _ = run(one_noisy)
    assert cleaned.noise.reason == ["", "", "", "", "", "correlation", "", ""]
    assert "noisy" not in cleaned.reason
    again, _ = run(dataclasses.replace(one_noisy, data=data), strict)
    assert again.noise.noisy.all()
    np.testing.assert_array_equal(again.eeg, cleaned.eeg)


def test_a_steadily_noisy_channel_is_replaced_where_that_is_asked_for(one_noisy):
    params = dataclasses.replace(PARAMS, noisy="replace", bad_channels="none")
    cleaned, steps = run(one_noisy, params)
    assert cleaned.reason == ["", "", "", "", "", "noisy", "", ""]
    good, at = [0, 1, 2, 3, 4, 6, 7], one_noisy.positions
    matrix = interpolation.weights(at[good], at[[5]], method=params.interpolation)
    np.testing.assert_allclose(steps["interpolated"][5], (matrix @ steps["eog"][good])[0], atol=1e-9)


def test_where_all_channels_are_noisy_none_is_left_to_clean(one_noisy):
    params = dataclasses.replace(PARAMS, noisy="replace", noisy_deviation=0.1)
    with pytest.raises(refusals.AllRejectedError, match=r"all 8 EEG channels are bad: .*c7 \(noisy\)"):
        run(one_noisy, params)


def test_a_channel_marked_before_is_not_compared(one_noisy):
    cleaned, _ = run(dataclasses.replace(one_noisy, marked=frozenset(["c5"])))
    assert cleaned.noise.reason == [""] * 8
    assert np.isnan([cleaned.noise.deviation[5], cleaned.noise.alone[5]]).all()
