"""FIF artifacts: no trace of when they were written, and numbers that can be volts."""

import mne
import numpy as np
import pytest

from hrcneuro.errors import DataError
from hrcneuro.io import fif


@pytest.fixture
def raw():
    data = 1e-5 * np.random.default_rng(0).standard_normal((3, 2000))
    return mne.io.RawArray(data, mne.create_info(["Fz", "Cz", "Pz"], 250.0, "eeg"), verbose="error")


def test_artifacts_have_no_date(tmp_path, raw):
    """MNE, which wrote them, must read "no date"; a blank that means a date of its own is a false one."""
    epochs = mne.EpochsArray(raw.get_data()[None, :, :200], raw.info, verbose="error")
    fif.write_raw(raw, tmp_path / "s01_raw.fif")
    fif.write_epochs(epochs, tmp_path / "s01_epo.fif")
    fif.write_evokeds([epochs.average()], tmp_path / "s01_ave.fif")
    for found in (
        fif.read_raw(tmp_path / "s01_raw.fif"),
        fif.read_epochs(tmp_path / "s01_epo.fif"),
        fif.read_evokeds(tmp_path / "s01_ave.fif")[0],
    ):
        assert found.info["meas_date"] is None


@pytest.mark.parametrize("shape", [(3, 2000), (20, 3, 100)])
def test_an_offset_a_channel_is_no_spread(shape):
    data = 1e-5 * np.random.default_rng(0).standard_normal(shape)
    fif.check_volts(data + 0.05 * np.arange(3)[:, None], "x")


def test_both_limits_name_the_side_and_the_cure():
    data = np.random.default_rng(0).standard_normal((3, 2000))
    with pytest.raises(DataError, match=r"x: the EEG's spread is .* V; scalp EEG lies below 0\.01 V\n.*unit = 'uV'"):
        fif.check_volts(10 * data, "x")
    with pytest.raises(DataError, match=r"x: the EEG's spread is .* V; scalp EEG lies above 1e-09 V\n.*unit = 'V'"):
        fif.check_volts(1e-10 * data, "x")
    fif.check_volts(2e-9 * data, "x")
    with pytest.raises(DataError, match="above 1e-07 V"):
        fif.check_volts(3e-8 * data, "x", low=fif.RECORDED_V)


@pytest.mark.parametrize("data", [np.zeros((0, 0)), np.zeros((2, 100)), np.full((2, 100), np.nan)])
def test_what_says_nothing_of_its_unit_passes(data):
    fif.check_volts(data, "x")
