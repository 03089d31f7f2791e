"""Samples read straight from a FIF file's tags: what MNE's readers give, to the bit."""

import mne
import numpy as np
import pytest

from hrcneuro.errors import DataError
from hrcneuro.io import samples
from hrcneuro.io.fif import read_eeg_epochs, read_epochs, read_raw, read_samples, write_epochs, write_raw

NAMES = ["Fz", "Cz", "EOG1", "Pz"]


@pytest.fixture
def info():
    return mne.create_info(NAMES, 250.0, ["eeg", "eeg", "eog", "eeg"])


def recording(info, n=1234):
    # 1234 samples: the last of the file's buffers, a second each, is shorter.
    return mne.io.RawArray(1e-5 * np.random.default_rng(0).standard_normal((4, n)), info, verbose="error")


def epochs(info):
    data = 1e-5 * np.random.default_rng(1).standard_normal((7, 4, 90))
    return mne.EpochsArray(data, info, tmin=-0.1, verbose="error")


@pytest.mark.parametrize("picks", [[0, 1, 2, 3], [3, 0, 2], [1]])
def test_a_recordings_samples_are_mnes(tmp_path, info, picks, monkeypatch):
    write_raw(recording(info), tmp_path / "s01_raw.fif")
    raw = read_raw(tmp_path / "s01_raw.fif")
    expected = raw.get_data(picks=picks)
    monkeypatch.setattr(type(raw), "get_data", None)  # MNE is not asked
    np.testing.assert_array_equal(samples.of_raw(raw, picks), expected)
    np.testing.assert_array_equal(samples.of_raw(raw, picks, 1e6), 1e6 * expected)


def test_calibrated_channels_are_scaled(tmp_path, info):
    made = recording(info)
    for channel, cal in zip(made.info["chs"], (1.0, 2.5, 1e-6, 0.3), strict=True):
        channel["cal"] = cal
    write_raw(made, tmp_path / "s01_raw.fif")
    raw = read_raw(tmp_path / "s01_raw.fif")
    assert {channel["cal"] for channel in raw.info["chs"]} != {1.0}
    np.testing.assert_array_equal(samples.of_raw(raw, range(4)), raw.get_data())


def test_other_files_go_through_mne(tmp_path, info):
    long = recording(info, 150_000)
    long.save(tmp_path / "double_raw.fif", fmt="double", verbose="error")
    long.save(tmp_path / "split_raw.fif", fmt="single", split_size="2MB", verbose="error")
    assert len(list(tmp_path.glob("split_raw*.fif"))) > 1
    for name in ("double", "split"):
        raw = mne.io.read_raw_fif(tmp_path / f"{name}_raw.fif", verbose="error")
        np.testing.assert_array_equal(samples.of_raw(raw, [2, 0]), raw.get_data(picks=[2, 0]))
    raw = mne.io.read_raw_fif(tmp_path / "double_raw.fif", preload=True, verbose="error")
    raw.apply_function(lambda x: 2 * x)
    np.testing.assert_array_equal(samples.of_raw(raw, range(4)), raw.get_data())


@pytest.mark.parametrize("fmt", ["single", "double"])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_epochs_are_mnes_eeg_in_microvolt(tmp_path, info, fmt, dtype):
    path = tmp_path / "s01_epo.fif"
    if fmt == "single":
        write_epochs(epochs(info), path)
    else:
        epochs(info).save(path, fmt=fmt, verbose="error")
    whole = read_epochs(path)
    found, eeg, data = read_eeg_epochs(path, dtype)
    assert eeg["ch_names"] == ["Fz", "Cz", "Pz"]
    assert data.dtype == dtype
    np.testing.assert_array_equal(data, (1e6 * whole.get_data(picks=eeg["ch_names"])).astype(dtype))
    np.testing.assert_array_equal(found.times, whole.times)
    np.testing.assert_array_equal(found.events, whole.events)


def test_a_truncated_file_is_named(tmp_path, info):
    path = tmp_path / "s01_epo.fif"
    write_epochs(epochs(info), path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(DataError, match=r"s01_epo\.fif cannot be read"):
        read_eeg_epochs(path)


@pytest.mark.parametrize("share", [0.6, 0.8, 0.95])
def test_a_recording_that_was_cut_later_is_named(tmp_path, info, share):
    path = tmp_path / "s01_raw.fif"
    data = np.random.default_rng(2).standard_normal((4, 40_000)) * 1e-5
    write_raw(mne.io.RawArray(data, info, verbose="error"), path)
    raw = read_raw(path)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(DataError, match=r"s01_raw\.fif cannot be read"):
        read_samples(raw, range(4))
