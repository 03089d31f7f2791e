"""Frozen decoders as files: what was written is read, damage is told, a stream of another kind has a cure."""

import json

import numpy as np
import pytest

from hrcneuro.decoding import frozen_refusals
from hrcneuro.decoding.features import WINDOWS_S
from hrcneuro.decoding.frozen import FrozenDecoder, FrozenProblem, windows
from hrcneuro.eeg.causal import design
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io import decoders

CHANNELS = ("Fz", "Cz", "Pz", "EOG1")


@pytest.fixture
def written(tmp_path):
    rng = np.random.default_rng(0)
    problem = FrozenProblem(("RR_before", "RH_before"), "robot", rng.normal(size=3 * len(WINDOWS_S)), 0.1, 0.02, -0.3)
    decoder = FrozenDecoder(
        *(CHANNELS, 500.0, (0.1, 40.0), design(500, 0.1, 40), rng.normal(size=(3, 4)), CHANNELS[:3], windows(500)),
        reject_uv=1000.0,
        problems={"RRvsRH": problem},
    )
    decoders.write_decoder(decoder, tmp_path, about={"subject": "s01"})
    return decoder, tmp_path


def test_what_is_read_decides_as_what_was_written(written):
    decoder, folder = written
    found, about = decoders.read_decoder(folder)
    assert about == {"subject": "s01"}
    epoch = np.random.default_rng(1).normal(0, 10, (4, decoder.n_times))
    assert found.decide(epoch, "RRvsRH") == decoder.decide(epoch, "RRvsRH")
    assert (found.channels, found.kept, found.sfreq, found.band_hz) == (CHANNELS, CHANNELS[:3], 500.0, (0.1, 40.0))
    np.testing.assert_array_equal(found.filter.sos, decoder.filter.sos)
    np.testing.assert_array_equal(found.filter.settled, decoder.filter.settled)
    assert found.problems["RRvsRH"].classes == ("RR_before", "RH_before")


def test_the_same_decoder_gives_the_same_bytes_and_arrays_only(written, tmp_path_factory):
    decoder, folder = written
    other = tmp_path_factory.mktemp("other")
    decoders.write_decoder(decoder, other, about={"subject": "s01"})
    for name in (decoders.ARRAYS, decoders.ABOUT):
        assert (folder / name).read_bytes() == (other / name).read_bytes()
    with np.load(folder / decoders.ARRAYS, allow_pickle=False) as file:
        assert {file[name].dtype for name in file.files} == {np.dtype("<f8")}


def changed(folder, change):
    path = folder / decoders.ABOUT
    text = json.loads(path.read_text())
    change(text)
    path.write_text(json.dumps(text))


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda folder: (folder / "decoder.json").unlink(), "decoder.json does not exist"),
        (lambda folder: (folder / "decoder.npz").unlink(), "decoder.npz does not exist"),
        (lambda folder: (folder / "decoder.npz").write_bytes(b"PK"), "cannot be read"),
        (lambda folder: (folder / "decoder.json").write_text("{"), "cannot be read"),
        (lambda folder: changed(folder, lambda text: text.pop("sfreq")), "cannot be read: 'sfreq'"),
        (
            lambda folder: changed(folder, lambda text: text.update(version=9)),
            "of version 9; this program reads version 1",
        ),
        (
            lambda folder: changed(folder, lambda text: text["channels"].pop()),
            r"matrix has the shape \(3, 4\), not \(3, 3\)",
        ),
        (
            lambda folder: changed(folder, lambda text: text["problems"]["RRvsRH"].update(bias=float("nan"))),
            "no finite numbers",
        ),
    ],
)
def test_a_damaged_decoder_is_refused(written, damage, said):
    damage(written[1])
    with pytest.raises(DataError, match=said) as caught:
        decoders.read_decoder(written[1])
    assert "hrcneuro calibrate" in caught.value.cure


@pytest.mark.parametrize(
    ("channels", "unit", "sfreq", "cure"),
    [
        (CHANNELS[:-1], "uV", 500.0, "calibrate on a recording of this stream"),
        (CHANNELS[::-1], "uV", 500.0, "in the order of the recording"),
        (CHANNELS, "V", 500.0, "send µV"),
        (CHANNELS, "uV", 250.0, "set the amplifier to that rate"),
    ],
)
def test_a_stream_of_another_kind_is_an_error_with_a_cure(written, channels, unit, sfreq, cure):
    decoder, _ = written
    with pytest.raises(ConfigError) as caught:
        decoders.rows(decoder, channels, [unit] * len(channels), sfreq)
    assert cure in caught.value.cure
    assert decoders.rows(decoder, [*CHANNELS, "TRG"], ["uV"] * 5, 500.0, beside=["TRG"]) == [0, 1, 2, 3]


def test_every_reason_for_which_a_stream_is_not_served_has_a_cure():
    base = frozen_refusals.StreamError
    reasons = {one for one in vars(frozen_refusals).values() if isinstance(one, type) and issubclass(one, base)}
    assert reasons - {base} == set(decoders.STREAM_CURES)
