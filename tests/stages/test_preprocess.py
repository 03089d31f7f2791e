from pathlib import Path

import mne
import numpy as np
import pytest

from hrcneuro.contract import Inputs, params
from hrcneuro.eeg import refusals
from hrcneuro.eeg.causal import EpochError
from hrcneuro.eeg.formula import AbsentColumnError, FormulaError, SingularError
from hrcneuro.eeg.regression import RegularOnsetsError
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io import fif
from hrcneuro.io.tables import describe, read_table
from hrcneuro.stages import preprocess
from hrcneuro.stages.preprocess import Config

SAMPLE = Path(__file__).parents[2] / "../shared/data/eeglab_sample/eeglab_data.set"
NAMES = ["Fp1", "Fp2", "F3", "F4", "C3", "C4", "T7", "T8", "P3", "P4", "O1", "O2"]


def recording(sfreq=1000.0, seconds=12, names=NAMES, eog=2, placed=True):
    rng = np.random.default_rng(4)
    types = ["eeg"] * len(names) + ["eog"] * eog + ["stim"]
    info = mne.create_info([*names, *(f"EOG{i + 1}" for i in range(eog)), "STI"], sfreq, types)
    data = 1e-5 * rng.standard_normal((len(types), int(seconds * sfreq)))
    data[1, 4000:4040] *= 100
    data[-1] = 0
    raw = mne.io.RawArray(data, info, verbose="error")
    if placed:
        montages = mne.channels.get_builtin_montages()
        raw.set_montage("colin27_1005" if "colin27_1005" in montages else "standard_1005", on_missing="ignore")
    # The second onset lies 0.3 samples of the new rate from a sample; a break between samples 5999 and 6000.
    marks = [(1.0, 0.0, "move"), (2.2334, 0.0, "move"), (6.0, 0.0, "BAD boundary"), (6.0, 0.0, "EDGE boundary")]
    raw.set_annotations(mne.Annotations(*zip(*marks, strict=True)))
    return raw


@pytest.fixture
def product(tmp_path):
    """A function that runs the stage on a recording; returns its summary and its folder."""

    def run(raw, config=Config(), unit="s01", out="out"):  # noqa: B008
        source, target = tmp_path / "acquire", tmp_path / out
        source.mkdir(exist_ok=True)
        target.mkdir()
        fif.write_raw(raw, source / f"{unit}_raw.fif")
        return preprocess.run(config, Inputs.of(unit, acquire=source), target), target

    return run


def test_defaults_are_the_papers():
    assert params(Config()) == {
        "l_freq": 1.0, "h_freq": 40.0, "sfreq": 512.0, "filter": "zero_phase", "transition": "achieved",
        "causal_l_freq": 0.1,
        "eog": "regression", "eog_offset": True, "bad_channels": "kurtosis", "threshold": 2.0,
        "noisy": "flag", "noisy_deviation": 5.0, "noisy_correlation": 0.4, "noisy_share": 0.01,
        "interpolation": "eeglab", "unplaced": "error", "reference": "average", "keep_steps": False,
    }  # fmt: skip
    assert preprocess.check(Config()) == []


def test_contradictions_are_found():
    assert "must lie below preprocess.h_freq" in preprocess.check(Config(l_freq=41))[0]
    assert "causal_l_freq" in preprocess.check(Config(filter="causal", causal_l_freq=50))[0]
    assert "half of preprocess.sfreq" in preprocess.check(Config(sfreq=80))[0]


def test_clean_recording_keeps_what_it_must(product):
    raw = recording()
    summary, out = product(raw)
    clean = fif.read_raw(out / "s01_clean_raw.fif")
    assert clean.ch_names == NAMES
    assert clean.info["sfreq"] == 512
    assert clean.n_times == 12 * 512
    assert clean.info["bads"] == []
    assert clean.info["custom_ref_applied"]
    assert (clean.info["highpass"], clean.info["lowpass"]) == (1, 40)
    np.testing.assert_allclose(clean.annotations.onset, raw.annotations.onset, atol=1e-6)
    assert clean.annotations.description.tolist() == raw.annotations.description.tolist()
    np.testing.assert_allclose(
        [ch["loc"][:3] for ch in clean.info["chs"]], [ch["loc"][:3] for ch in raw.info["chs"][:12]], atol=1e-7
    )
    np.testing.assert_allclose(clean.get_data().mean(axis=0), 0, atol=1e-11)
    assert summary["interpolated"] == [n for n, why in summary["bad"].items() if why == "kurtosis"]
    assert "Fp2" in summary["interpolated"]
    assert (summary["segments"], summary["downsampled"], summary["source_sfreq"]) == (2, True, 1000)


def test_tables(product):
    summary, out = product(recording())
    quality = read_table(out / "quality.parquet")
    assert quality["channel"].tolist() == NAMES
    assert quality.loc[quality["interpolated"], "channel"].tolist() == summary["interpolated"]
    assert (
        quality[["kurtosis", "z", "weight_EOG1", "weight_EOG2", "rms_before_uv", "rms_after_uv"]].notna().all(axis=None)
    )
    assert quality.loc[1, "reason"] == "kurtosis"
    assert quality["rms_before_uv"].between(1, 60).all()
    assert describe(out / "quality.parquet").columns["rms_after_uv"].unit == "µV"
    timing = read_table(out / "timing.parquet")
    assert timing.to_dict("records") == [
        {"source_sfreq": 1000.0, "sfreq": 512.0, "up": 64, "down": 125, "n_source": 12_000, "n_samples": 6144}
    ]
    assert not (out / "steps.npz").exists()


def test_same_recording_same_bytes(product):
    config = Config(keep_steps=True)
    first, second = (product(recording(), config, out=name)[1] for name in ("one", "two"))
    names = sorted(path.name for path in first.iterdir())
    assert names == ["quality.parquet", "s01_clean_raw.fif", "spectrum.parquet", "steps.npz", "timing.parquet"]
    for name in names:
        assert (first / name).read_bytes() == (second / name).read_bytes(), name


def test_steps(product):
    summary, out = product(recording(), Config(keep_steps=True))
    steps = np.load(out / "steps.npz")
    assert all(steps[name].dtype == float for name in ("filtered", "eog", "interpolated", "reference"))
    assert steps["filtered"].shape == steps["reference"].shape == (12, 12_000)
    assert steps["channels"].tolist() == NAMES
    assert steps["channels"][steps["rejected"]].tolist() == summary["interpolated"]
    np.testing.assert_allclose(
        steps["reference"], steps["interpolated"] - steps["interpolated"].mean(axis=0), atol=1e-9
    )
    clean = fif.read_raw(out / "s01_clean_raw.fif").get_data() * 1e6
    # At both rates the eighth of a second begins with a sample.
    difference = np.abs(clean[:, ::64] - steps["reference"][:, ::125])
    border = np.isin(np.arange(96), [0, 48, 95])
    assert difference[:, ~border].max() < 1e-3
    assert difference.max() < 0.1


def test_eeglabs_recording(product):
    if not SAMPLE.exists():
        pytest.skip("EEGLAB's sample recording is not there (../shared/data)")
    raw = mne.io.read_raw_eeglab(SAMPLE, preload=True, eog=["EOG1", "EOG2"], verbose="error")
    summary, out = product(raw, Config(keep_steps=True), unit="demo")
    assert summary["interpolated"] == ["FPz", "T7", "T8", "P7"]
    assert (summary["sfreq"], summary["downsampled"]) == (128.0, False)
    steps = np.load(out / "steps.npz")
    clean = fif.read_raw(out / "demo_clean_raw.fif").get_data() * 1e6
    np.testing.assert_allclose(clean, steps["reference"], rtol=0, atol=1e-4)
    assert len(steps["taps"]) == 425


@pytest.mark.parametrize("sfreq", [128.0, 250.0, 256.0])
def test_a_slow_recording_keeps_its_rate(product, sfreq):
    summary, out = product(recording(sfreq, seconds=40))
    assert fif.read_raw(out / "s01_clean_raw.fif").info["sfreq"] == sfreq
    assert summary["downsampled"] is False


def test_perrin_takes_the_centre_of_mne(product):
    raw = recording(names=[*NAMES, "Fz", "Cz", "Pz", "F7", "F8"])
    _, out = product(raw, Config(keep_steps=True, interpolation="perrin", threshold=5))
    steps = np.load(out / "steps.npz")
    bad = steps["channels"][steps["rejected"]].tolist()
    assert "Fp2" in bad
    theirs = mne.io.RawArray(
        steps["eog"] * 1e-6, mne.pick_info(raw.info, mne.pick_types(raw.info, eeg=True)), verbose="error"
    )
    theirs.info["bads"] = bad
    theirs.interpolate_bads(verbose="error")
    np.testing.assert_allclose(steps["interpolated"], theirs.get_data() * 1e6, atol=1e-4)


def test_causal_option(product):
    summary, out = product(recording(), Config(filter="causal", keep_steps=True))
    assert summary["filter"] == "causal"
    assert "taps" not in np.load(out / "steps.npz")
    assert fif.read_raw(out / "s01_clean_raw.fif").info["highpass"] == pytest.approx(0.1)


def test_options_that_leave_steps_out(product):
    config = Config(eog="none", bad_channels="none", reference="none", keep_steps=True)
    summary, out = product(recording(), config)
    steps = np.load(out / "steps.npz")
    np.testing.assert_array_equal(steps["reference"], steps["filtered"])
    assert summary["bad"] == {}
    assert read_table(out / "quality.parquet")["weight_EOG1"].eq(0).all()
    assert not fif.read_raw(out / "s01_clean_raw.fif").info["custom_ref_applied"]


def test_marked_channels_are_interpolated(product):
    raw = recording()
    raw.info["bads"] = ["O1"]
    summary, out = product(raw, Config(bad_channels="none"))
    assert summary["bad"] == {"O1": "marked"}
    assert fif.read_raw(out / "s01_clean_raw.fif").info["bads"] == []


def test_a_flat_channel_is_null_in_the_table_and_interpolated(product):
    raw = recording()
    raw._data[6] = 3e-5
    summary, out = product(raw)
    row = read_table(out / "quality.parquet").set_index("channel").loc["T7"]
    assert summary["bad"]["T7"] == row["reason"] == "flat"
    assert np.isnan(row["z"])
    assert row["interpolated"]
    assert row["rms_after_uv"] > 1


def test_dropped_channels_are_missing_and_said(product):
    raw = recording(names=[*NAMES[:-1], "X1"])
    raw._data[11, 4000:4040] *= 300
    with pytest.raises(DataError, match="without a position cannot be interpolated: X1"):
        product(raw)
    summary, out = product(raw, Config(unplaced="drop"), out="dropped")
    assert fif.read_raw(out / "s01_clean_raw.fif").ch_names == NAMES[:-1]
    assert summary["channels"] == 11
    assert "X1" in summary["warnings"][0]
    assert read_table(out / "quality.parquet")["channel"].tolist()[-1] == "X1"


def test_no_positions_at_all(product):
    raw = recording(placed=False)
    assert product(raw, Config(bad_channels="none"))[0]["interpolated"] == []
    with pytest.raises(DataError, match=r"acquire\.montage"):
        product(raw, out="again")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_samples_that_are_no_numbers(product, value):
    raw = recording()
    raw._data[3, 7000:] = value
    with pytest.raises(DataError, match=r"channel F4 .* 41\.67% .* sample 7000 \(7\.000 s\)"):
        product(raw)


def test_no_eog_and_no_eeg(product):
    with pytest.raises(DataError, match=r"preprocess\.eog = 'none'"):
        product(recording(eog=0))
    raw = recording().pick(["EOG1", "EOG2"])
    with pytest.raises(DataError, match="no EEG channel; its channels are EOG1, EOG2"):
        product(raw, out="again")


def test_a_band_beyond_nyquist(product):
    with pytest.raises(ConfigError, match="sampling rate of 64 Hz"):
        product(recording(64.0, seconds=90))


def test_the_recording_is_missing(tmp_path):
    with pytest.raises(DataError, match="hrcneuro acquire s01 --force"):
        preprocess.run(Config(), Inputs.of("s01", acquire=tmp_path), tmp_path)


def test_every_refusal_of_the_chain_has_a_cure():
    def derived(kind):
        return {one for sub in kind.__subclasses__() for one in (sub, *derived(sub))}

    made_elsewhere = {refusals.SlowSamplingError, refusals.MovesError, EpochError, RegularOnsetsError}
    made_elsewhere |= {AbsentColumnError, FormulaError, SingularError}
    assert set(preprocess._cures()) == derived(refusals.Refusal) - made_elsewhere


@pytest.mark.parametrize(
    ("change", "config", "cure"),
    [
        ({"eog": 0}, {}, "acquire.channel_types = {NAME = 'eog'}"),
        ({"sfreq": 64.0, "seconds": 90}, {}, "inside 0–32 Hz"),
        ({"names": NAMES[:1]}, {"bad_channels": "none"}, "set preprocess.reference = 'none'"),
        ({}, {"sfreq": 81.0, "h_freq": 40.0}, "set preprocess.sfreq to 82 Hz or more"),
    ],
)
def test_a_refusal_reaches_the_user_with_its_cure(product, change, config, cure):
    with pytest.raises((ConfigError, DataError)) as caught:
        product(recording(**change), Config(**config))
    assert cure in caught.value.cure


def test_the_causal_chain_says_how_far_its_down_sampling_looks_ahead(product):
    summary, _ = product(recording(), Config(filter="causal"))
    (sentence,) = [one for one in summary["warnings"] if "ahead" in one]
    assert sentence.endswith(" ms ahead; preprocess.sfreq = 1000 leaves it out")
    summary, _ = product(recording(), Config(filter="causal", sfreq=1000.0), out="same_rate")
    assert not [one for one in summary["warnings"] if "ahead" in one]
