"""What ``amp --replay`` sends of a recording: all its channels, its markers, and a pause for each break."""

import mne
import numpy as np

from hrcneuro.cli import amplifying
from hrcneuro.cli.options import Options
from hrcneuro.config import settings

STUDY = """
[study]
name = "replayed"
subjects = ["s01"]
stages = ["acquire"]
[acquire]
source = "file"
path = "s01_raw.fif"
montage = "none"
[acquire.event_map]
go = "go"
"""


def test_every_channel_is_sent_in_its_unit_and_a_break_is_a_pause(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(1)
    kinds = {"Fz": "eeg", "Cz": "eeg", "EOG1": "eog", "ECG1": "ecg", "Belt": "misc"}
    data = rng.normal(0, 2e-5, (5, 2000))
    data[4] = np.linspace(3, 4, 2000)
    raw = mne.io.RawArray(
        data, mne.create_info(list(kinds), 200.0, list(kinds.values()), verbose="error"), verbose="error"
    )
    onsets = [1.0, 3.0, 5.0, 7.0]
    raw.set_annotations(
        mne.Annotations([*onsets, 4.0, 4.0], [0.0] * 6, ["go"] * 4 + ["BAD boundary", "EDGE boundary"]), verbose="error"
    )
    raw.save(tmp_path / "s01_raw.fif", verbose="error")
    (tmp_path / "hrcneuro.toml").write_text(STUDY)
    options = Options(workdir=tmp_path, config=tmp_path / "hrcneuro.toml", quiet=True)
    study = settings.load(tmp_path / "hrcneuro.toml", ())
    found = amplifying.recorded(options, study, "s01")
    assert dict(zip(found.signal.ch_names, found.kinds, strict=True)) == kinds
    assert list(found.signal.breaks) == [800]
    sent = found.signal.take(10**6)
    taken = sent[~np.isnan(sent).all(axis=1)]
    np.testing.assert_allclose(taken.T, data * np.array([1e6, 1e6, 1e6, 1e6, 1.0])[:, None], rtol=1e-5)
    assert found.onsets.tolist() == [200, 600, 1200, 1600]
    assert found.markers == ["go"] * 4
