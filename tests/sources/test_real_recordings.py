"""Other people's recordings as they are: what each file holds, and that its values are as MNE or pyxdf reads them.

The files lie beside the project (shared/data/recordings) and are no part of it; without them nothing here runs. Each
fault that they have is also in a file that a test of its format writes. docs/real_recordings.md has the table.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import mne
import numpy as np
import pandas as pd
import pytest
from shared_data import RECORDINGS
from tiny_study import ROOT

from hrcneuro.errors import ConfigError, DataError, HrcError
from hrcneuro.sources import channels, foreign, triggers
from hrcneuro.sources.formats import READABLE, read_recording
from hrcneuro.sources.matching import histogram, listed
from hrcneuro.sources.parameters import Source
from hrcneuro.sources.recording import Recording

pytestmark = pytest.mark.skipif(not RECORDINGS.is_dir(), reason="other people's recordings are not here (shared/data)")

# What a study has to say of files that do not say it themselves.
OPTIONS: dict[str, dict[str, Any]] = {
    ".csv": dict(
        columns=("TP9", "AF7", "AF8", "TP10"), unit="uV", table_rate=256.0, time_column="timestamps",
        marker_column="Marker",
    ),
    "clock_resets.xdf": {"stream_rate": "measured"},
    "eeg1_1.dat": {"markers": "StimulusCode"},
}  # fmt: skip
REFUSED = "refused"


class Row(NamedTuple):
    """A line of the table: reader, channels of EEG and in all, rate in Hz, samples, events, and the verdict."""

    file: str
    reader: str
    eeg: int
    channels: int
    sfreq: float
    samples: int
    events: str
    verdict: str


def refused(file: str, reader: str, words: str) -> Row:
    return Row(file, reader, 0, 0, 0, 0, REFUSED, words)


TABLE = (
    Row("bci2000_dat/eeg1_1.dat", "here", 64, 68, 160, 19696, "1 × 8, 2 × 7",
        "as MNE's numbers, calibrated; three states hold triggers, acquire.markers names one"),
    Row("bids/tiny_bids/sub-01_ses-eeg_task-rest_eeg.vhdr", "MNE", 64, 69, 5000, 10000,
        "Comment/ControlBox is not connected via USB × 1", "as MNE; GSR and temperature are misc"),
    refused("brainvision/analyzer_nV/Analyzer_nV_Export.vhdr", "MNE", "announces 64 samples, its data file holds 2"),
    Row("brainvision/antio_test_CA_208_amp_disconnection/test_CA_208_amp_disconnection.vhdr", "MNE", 87, 88, 1000, 9572,
        "Marker/Impedance × 3, Stimulus/s9001 × 1, Stimulus/s9002 × 1", "as MNE; a break at 6.074 s"),
    refused("brainvision/eeglab_testbva/testbva.dat", "here", "holds the samples of testbva.vhdr"),
    Row("brainvision/eeglab_testbva/testbva.vhdr", "MNE", 29, 32, 200, 2112, "none",
        "as MNE; its marker file is missing, which is said"),
    Row("brainvision/mne_latin1/test_old_layout_latin1_software_filter.vhdr", "MNE", 25, 29, 250, 251, "none",
        "as MNE; a break at 4 ms"),
    refused("brainvision/mne_v2_header_only/testv2.vhdr", "MNE", "names a data file that is not there"),
    Row("brainvision/vamp_ahdr/test_VAmp.ahdr", "MNE", 6, 6, 500, 4352, "none", "as MNE"),
    Row("cnt_ant/test_CA_208_amp_disconnection.cnt", "MNE, antio", 63, 88, 1000, 9572, "9001 × 1, 9002 × 1",
        "as MNE, and as its BrainVision export to half a step; a break at 6.075 s, an event to MNE"),
    Row("cnt_neuroscan/scan41_short.cnt", "MNE", 126, 128, 400, 3070, "7 × 3, 109 × 2",
        "as MNE with int16, which it cannot tell itself; an interruption at the end, an event to MNE"),
    Row("csv_muse_p300/data_2017-02-04-15_45_13.csv", "here", 4, 5, 256, 30732, "1 × 165, 2 × 32", "as its text"),
    Row("csv_muse_p300/data_2017-02-04-15_47_49.csv", "here", 4, 5, 256, 30732, "1 × 163, 2 × 28", "as its text"),
    Row("edf_bdf/eeglab/test.bdf", "MNE, here", 16, 17, 256, 15360, "254 × 40, 255 × 40", "as MNE; was never closed"),
    Row("edf_bdf/mne/duplicate_channel_labels.edf", "MNE, here", 3, 3, 250, 2500, "none",
        "as MNE; labels that repeat are numbered"),
    Row("edf_bdf/mne/test_bdf_stim_channel.bdf", "MNE, here", 3, 4, 500, 5000, "1 × 7, 2 × 1, 4 × 1", "as MNE"),
    Row("edf_bdf/mne/test_uneven_samp.edf", "MNE, here", 2, 2, 100, 11000, "none", "as MNE; two rates, said"),
    Row("edf_bdf/mne_testing/chtypes_edf.edf", "MNE, here", 34, 42, 200, 1000,
        "+0.000000 × 1, +1.000000 × 1, +2.000000 × 1, A1+A2 OFF × 1, Segment: REC START LTM+6 EEG × 1, high amp RDA "
        "F4, C4 × 1, onset × 1, starts turning head × 1", "as MNE"),
    Row("edf_bdf/mne_testing/subsecond_starttime.edf", "MNE, here", 3, 3, 512, 2560, "Clip Note × 1, XLSpike × 1",
        "as MNE"),
    Row("edf_bdf/mne_testing/test_utf8_annotations.edf", "MNE, here", 9, 11, 200, 2000,
        "RECORD START × 1, 仰卧 × 1", "as MNE"),
    refused("eeglab/ehrlich_headers/s03_corl1.set", "here", "names a data file that is not there: s03_corl1.fdt"),
    Row("eeglab/mne_test_raw_chanloc/test_raw_chanloc.set", "here", 61, 61, 128, 385, "S 12 × 1", "as MNE"),
    Row("eeglab/mne_variants/test_raw_2021.set", "here", 3, 3, 128, 1281, "square × 4, rt × 2", "as MNE"),
    Row("eeglab/mne_variants/test_raw_event_duration.set", "here", 1, 1, 128, 513, "square × 2, rt × 1", "as MNE"),
    refused("eeglab/mne_variants/test_raw_h5.set", "here", "names a data file that is not there: test_raw.fdt"),
    Row("eeglab/numerical_events/eeglab_data_numerical_events.set", "here", 30, 32, 128, 30504, "1 × 80, 2 × 74",
        "as MNE"),
    Row("fif_p300/train_2023-10-13 16:25:26.000046_raw.fif", "MNE", 14, 19, 256, 16228, "2 × 168, 1 × 32",
        "as MNE; events from the trigger channel"),
    Row("fif_p300/train_2023-10-13 16:27:58.404136_raw.fif", "MNE", 14, 19, 256, 16221, "2 × 169, 1 × 31",
        "as MNE; events from the trigger channel"),
    Row("gdf/test_1ch.gdf", "MNE, here", 0, 1, 150, 4500, "none", "as MNE; ECG alone, so no study has a use for it"),
    Row("other/test_egi.raw", "MNE", 256, 256, 250, 77, "TRSP × 1, XXX1 × 1", "as MNE"),
    Row("xdf/clock_resets.xdf", "pyxdf", 8, 8, 92.934, 27815,
        "Test-1-2-3 × 39, XXX × 33, Testtest × 29, Marker × 27, Blah × 25, Test × 22",
        "as pyxdf; states 100 Hz, so acquire.stream_rate = 'measured'; a break where the clock was reset"),
    Row("xdf/empty_streams.xdf", "pyxdf", 0, 1, 1, 10, '{"state": 2} × 1', "as pyxdf"),
    refused("xdf/hostile/chunk_length_lie.xdf", "pyxdf", "cannot be read as XDF"),
    refused("xdf/hostile/out_of_order_clock_offsets.xdf", "pyxdf", "holds no regularly sampled stream"),
    refused("xdf/hostile/out_of_order_sample_chunk.xdf", "pyxdf", "holds no regularly sampled stream"),
    Row("xdf/minimal.xdf", "pyxdf", 3, 3, 10, 9, "", "as pyxdf; a clock that was never compared, said"),
    Row("xdf/test.xdf", "pyxdf", 8, 8, 1000, 9520, "none", "as pyxdf; a stream that names no channels, said"),
)  # fmt: skip


def read(path: Path) -> Recording:
    """Return a file as a study reads it, the options that it needs set."""
    options = next((one for key, one in OPTIONS.items() if path.name.endswith(key)), {})
    source = Source(source="file", path=str(path), **options)
    return foreign.read({"recording": path}, source)


def options_of(path: Path) -> Source:
    return Source(source="file", **next((one for key, one in OPTIONS.items() if path.name.endswith(key)), {}))


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.file)
def test_each_file_is_as_the_table_has_it(row):
    path = RECORDINGS / row.file
    if row.events == REFUSED:
        with pytest.raises((DataError, ConfigError), match=row.verdict) as caught:
            read(path)
        assert caught.value.cure
        return
    recording = read(path)
    markers = options_of(path).markers
    channels.shape(recording, rename={}, types={}, drop=(), bads=(), montage="none", unit=options_of(path).unit)
    triggers.choose_markers(recording, markers)
    found = len(recording.picks("eeg")), len(recording.ch_names), round(recording.sfreq, 3), recording.data.shape[1]
    assert found == row[2:6]
    if row.events:
        assert listed(histogram(recording.markers)) == row.events


def test_no_file_is_left_out_of_the_table():
    there = {
        str(path.relative_to(RECORDINGS)) for path in RECORDINGS.rglob("*") if path.name.lower().endswith(READABLE)
    }
    assert there == {row.file for row in TABLE}


def by_mne(path: Path) -> mne.io.BaseRaw:
    """Return MNE's own reading."""
    if path.suffix == ".cnt" and "neuroscan" in str(path):
        return mne.io.read_raw_cnt(path, data_format="int16", verbose="error")
    if path.suffix == ".cnt":
        return mne.io.read_raw_ant(path, verbose="error")
    if path.suffix == ".raw":
        return mne.io.read_raw_egi(path, events_as_annotations=True, verbose="error")
    readers = {".vhdr": "brainvision", ".ahdr": "brainvision", ".set": "eeglab", ".bdf": "bdf", ".fif": "fif"}
    kind = readers.get(path.suffix, path.suffix[1:])
    return getattr(mne.io, f"read_raw_{kind}")(path, verbose="error")


READ_BY_MNE = [row.file for row in TABLE if row.events != REFUSED and not row.file.endswith((".csv", ".xdf", ".dat"))]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("file", READ_BY_MNE)
def test_values_are_those_of_mne(file):
    recording, raw = read_recording(RECORDINGS / file), by_mne(RECORDINGS / file)
    kinds = raw.get_channel_types()
    rows = [i for i, kind in enumerate(kinds) if kind not in ("stim",) and raw.ch_names[i] in recording.ch_names]
    assert len(rows) >= len(recording.picks("eeg"))
    for i in rows:
        here = recording.ch_names.index(raw.ch_names[i])
        if recording.ch_types[here] == "stim":
            continue
        ours, theirs = recording.data[here], raw.get_data(picks=[i])[0]
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-15, err_msg=raw.ch_names[i])


def test_bci2000_values_are_mne_s_numbers_with_the_header_s_gains():
    path = RECORDINGS / "bci2000_dat" / "eeg1_1.dat"
    if not hasattr(mne.io, "read_raw_bci2k"):
        pytest.skip("this MNE does not read BCI2000")
    raw = mne.io.read_raw_bci2k(path, preload=True, verbose="error").get_data(picks="eeg")
    recording = read_recording(path)
    # The first channel's line in the header: gain 0.01617, offset 43.
    np.testing.assert_allclose(recording.data[0] * 1e6, (raw[0] - 43) * 0.01617, rtol=1e-12)
    np.testing.assert_allclose([np.corrcoef(a, b)[0, 1] for a, b in zip(recording.data, raw, strict=False)], 1)


@pytest.mark.parametrize("file", [row.file for row in TABLE if row.file.endswith(".csv")])
def test_values_of_a_table_are_those_of_the_text(file):
    text, recording = pd.read_csv(RECORDINGS / file), read(RECORDINGS / file)
    np.testing.assert_array_equal(recording.data[:4].T, text[["TP9", "AF7", "AF8", "TP10"]].to_numpy())
    np.testing.assert_array_equal(recording.data[4], text["Marker"])


@pytest.mark.parametrize("file", [row.file for row in TABLE if row.file.endswith(".xdf") and row.events != REFUSED])
def test_values_of_a_stream_are_those_of_pyxdf(file):
    pyxdf = pytest.importorskip("pyxdf", reason="pyxdf is not installed: pip install 'hrcneuro[xdf]'")
    streams, _ = pyxdf.load_xdf(RECORDINGS / file, dejitter_timestamps=False, verbose=False)
    recording = read(RECORDINGS / file)
    ours = recording.data * 1e6
    same = [np.shape(one["time_series"]) == ours.T.shape for one in streams]
    theirs = np.asarray(streams[same.index(True)]["time_series"], float).T
    np.testing.assert_allclose(ours, theirs, rtol=1e-12)


def test_ant_s_take_and_its_export_as_brainvision_are_one_recording():
    name = "test_CA_208_amp_disconnection"
    ant = read_recording(RECORDINGS / "cnt_ant" / f"{name}.cnt")
    export = read_recording(RECORDINGS / f"brainvision/antio_{name}/{name}.vhdr")
    assert ant.ch_names == export.ch_names
    # The export is in steps of 1/64 µV.
    np.testing.assert_allclose(ant.data[:64] * 1e6, export.data[:64] * 1e6, atol=1 / 128 + 1e-6)
    assert abs(ant.breaks_s[0] - export.breaks_s[0]) <= 1.01 / ant.sfreq


def test_the_authors_header_is_understood_as_far_as_it_goes():
    path = RECORDINGS / "eeglab/ehrlich_headers/s03_corl1.set"
    with pytest.raises(HrcError, match=r"s03_corl1\.fdt") as caught:
        read_recording(path)
    assert caught.value.exit_code == 3


def test_the_page_shows_this_table():
    page = (ROOT / "docs" / "real_recordings.md").read_text(encoding="utf-8")
    for row in TABLE:
        name = Path(row.file).name
        assert name in page, name
        assert row.events == REFUSED or f"{row.sfreq:g}" in page
