"""A decoder from a session that was recorded as XDF, without EOG: the stream that was recorded is served by it."""

import numpy as np
import pytest
from foreign import save_log_files
from recorded_lab import LABELS, SFREQ, Lab

from hrcneuro.contract import Inputs
from hrcneuro.decoding import offline
from hrcneuro.eeg.causal import State
from hrcneuro.io import decoders
from hrcneuro.io.tables import read_table
from hrcneuro.live.amplifier import TRIGGER
from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.session import simulate_session
from hrcneuro.stages import acquire, calibrate, preprocess

pyxdf = pytest.importorskip("pyxdf", reason="pyxdf is not installed: pip install 'hrcneuro[xdf]'")


@pytest.fixture
def recorded(tmp_path):
    """Record two short blocks at virtual pace, acquire and clean them; return the recording's folder and the inputs."""
    session = SessionParams(practice_episodes=0, blocks=2, episodes_per_block=8)
    trials = simulate_session(session, rng=np.random.default_rng(3))
    trials = trials.assign(onset_s=np.round((trials["onset_s"] + 3) * SFREQ) / SFREQ)
    folder = tmp_path / "recordings" / "s01" / "one"
    lab = Lab(folder, trials, offset=2.0)
    save_log_files(folder, "s01", trials)
    lab.go_on().end()
    places = {name: tmp_path / name for name in ("acquire", "preprocess")}
    for place in places.values():
        place.mkdir()
    acquire.run(acquire.Config(source="recording", path=str(folder)), Inputs("s01", {}), places["acquire"])
    clean = preprocess.Config(sfreq=SFREQ, eog="none", bad_channels="none")
    preprocess.run(clean, Inputs.of("s01", acquire=places["acquire"]), places["preprocess"])
    return folder, Inputs.of("s01", **places)


def test_the_stream_as_it_was_sent_is_served_and_decided_alike(recorded, tmp_path):
    folder, inputs = recorded
    out = tmp_path / "out"
    out.mkdir()
    summary = calibrate.run(calibrate.Config(draws=2), inputs, out)
    assert summary["trials"] > 60
    decoder, _ = decoders.read_decoder(out)
    assert decoder.channels == decoder.kept == tuple(LABELS)

    streams, _ = pyxdf.load_xdf(str(next(folder.glob("*.xdf"))), synchronize_clocks=False, dejitter_timestamps=False)
    sent = next(stream for stream in streams if stream["info"]["type"][0] == "EEG")
    channels = sent["info"]["desc"][0]["channels"][0]["channel"]
    names, units = ([one[key][0] for one in channels] for key in ("label", "unit"))
    rows = decoders.rows(decoder, names, units, float(sent["info"]["nominal_srate"][0]), beside={TRIGGER})
    samples = sent["time_series"].T[rows]
    assert samples.dtype == np.float32

    table = read_table(out / "trials.parquet")
    by_length = []
    for length in (10, 40):
        chunks = (samples[:, at : at + length] for at in range(0, samples.shape[1], length))
        found = dict(offline.epochs(decoder, chunks, table["zero"].to_numpy()))
        assert not any(isinstance(one, State) for one in found.values())
        by_length.append([decoder.decide(found[i], table["problem"][i]).score for i in range(len(table))])
    assert by_length[0] == by_length[1]
    # The file that the stage reads holds volts in single precision, the stream microvolts: they differ by its rounding.
    spread = table["frozen_score"].std()
    np.testing.assert_allclose(by_length[0], table["frozen_score"], atol=1e-4 * spread, rtol=0)
