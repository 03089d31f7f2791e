"""The writer of XDF: what pyxdf makes of its bytes."""

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.live import xdf

pyxdf = pytest.importorskip("pyxdf", reason="pyxdf is not installed: pip install 'hrcneuro[xdf]'")
HEAD = xdf.MAGIC + xdf.file_header("2026-01-01T00:00:00+00:00")


def header(form, n, sfreq=100.0, name="s"):
    return (
        f'<?xml version="1.0"?><info><name>{name}</name><type>EEG</type><channel_count>{n}</channel_count>'
        f"<channel_format>{form}</channel_format><nominal_srate>{sfreq}</nominal_srate><desc/></info>"
    )


def load(*chunks, **options):
    options = {"synchronize_clocks": False, "dejitter_timestamps": False, **options}
    return pyxdf.load_xdf(io.BytesIO(HEAD + b"".join(chunks)), **options)[0]


@pytest.mark.parametrize("form", ["float32", "double64", "int8", "int16", "int32", "int64"])
@pytest.mark.parametrize("n", [1, 3, 300])
def test_numbers_come_back_with_their_stamps(form, n):
    rng = np.random.default_rng(1)
    stamps, values = 1e5 + rng.random(n).cumsum(), rng.integers(-100, 100, (n, 2))
    (stream,) = load(
        xdf.stream_header(7, header(form, 2)),
        xdf.samples(7, stamps[: n // 2], values[: n // 2], form),
        xdf.boundary(),
        xdf.samples(7, stamps[n // 2 :], values[n // 2 :], form),
        xdf.stream_footer(7, stamps[0], stamps[-1], n, [(1.0, 0.5)]),
    )
    np.testing.assert_array_equal(stream["time_stamps"], stamps)
    np.testing.assert_array_equal(stream["time_series"], values)
    footer = stream["footer"]["info"]
    assert footer["sample_count"] == [str(n)]
    assert float(footer["first_timestamp"][0]) == stamps[0]


@settings(deadline=None)
@given(st.lists(st.text(max_size=400).filter(lambda t: t.isprintable()), min_size=1, max_size=20))
def test_texts_of_any_length_and_script_come_back(texts):
    stamps = np.arange(len(texts)) * 1.5
    (stream,) = load(
        xdf.stream_header(1, header("string", 1, 0.0)), xdf.samples(1, stamps, [[t] for t in texts], "string")
    )
    assert [row[0] for row in stream["time_series"]] == texts
    np.testing.assert_array_equal(stream["time_stamps"], stamps)


def test_clock_offsets_bring_a_stream_onto_the_recorders_clock():
    stamps = np.arange(0.0, 100.0, 0.01)
    offsets = [(1000.0 + t, 1000.0) for t in range(0, 101, 5)]
    (stream,) = load(
        xdf.stream_header(1, header("float32", 1)),
        xdf.samples(1, stamps, np.zeros((len(stamps), 1)), "float32"),
        *(xdf.clock_offset(1, when, offset) for when, offset in offsets),
        synchronize_clocks=True,
    )
    np.testing.assert_allclose(stream["time_stamps"], stamps + 1000.0, atol=1e-9)
    # As LabRecorder has it: the time of a measurement is the sender's.
    assert stream["clock_times"][0] == 0.0


@pytest.mark.parametrize("lost", [5, 40, 120])
def test_a_file_that_ends_within_a_chunk_opens_up_to_the_one_before(lost, caplog):
    stamps = np.arange(10) / 100
    chunks = [xdf.samples(1, k + stamps, np.full((10, 1), k), "float32") for k in range(3)]
    whole = HEAD + xdf.stream_header(1, header("float32", 1)) + b"".join(chunks)
    (stream,), _ = pyxdf.load_xdf(io.BytesIO(whole[:-lost]), synchronize_clocks=False, dejitter_timestamps=False)
    assert len(stream["time_stamps"]) == 20


def test_a_reader_goes_on_behind_damage_at_the_next_boundary():
    """The mark is the one that readers look for."""
    stamps = np.arange(10) / 100
    chunks = [xdf.samples(1, k + stamps, np.full((10, 1), k), "float32") + xdf.boundary() for k in range(5)]
    whole = bytearray(HEAD + xdf.stream_header(1, header("float32", 1)) + b"".join(chunks))
    at = len(whole) - sum(map(len, chunks[1:])) + 3
    whole[at : at + 40] = bytes(40)
    (stream,), _ = pyxdf.load_xdf(io.BytesIO(whole), synchronize_clocks=False, dejitter_timestamps=False)
    assert stream["time_stamps"][-1] == 4.09
    assert xdf.boundary()[-16:].hex() == "43a546dccbf5410fb30ed5467383cbe4"
