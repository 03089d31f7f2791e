"""The pictures of preprocess, and the one that joins it with acquire, from files that a stage has written."""

import mne
import numpy as np
import pandas as pd
import pytest

from hrcneuro.contract import Inputs, Of, chosen
from hrcneuro.drawings import preprocess as one
from hrcneuro.drawings import quality as joint
from hrcneuro.figures import spectrum as figure_of
from hrcneuro.io import fif
from hrcneuro.io.tables import read_table
from hrcneuro.stages import preprocess
from hrcneuro.tables.quality import read_spectrum

NAMES = ["Fp1", "Fp2", "C3", "C4", "O1", "O2", "T7", "T8"]


def acquire(folder, unit, *, eog):
    rng = np.random.default_rng([*unit.encode()])
    t = np.arange(30 * 128) / 128
    blinks = sum(np.exp(-0.5 * ((t - peak) / 0.06) ** 2) for peak in (4, 9, 13, 17, 22, 26)) * 200e-6
    data = 1e-5 * rng.standard_normal((len(NAMES) + eog, len(t)))
    data[:2] += 0.5 * blinks
    if eog:
        data[-1] += blinks
    info = mne.create_info([*NAMES, *(["EOG1"] * eog)], 128.0, ["eeg"] * len(NAMES) + ["eog"] * eog, verbose="error")
    folder.mkdir(parents=True)
    fif.write_raw(mne.io.RawArray(data, info, verbose="error"), folder / f"{unit}_raw.fif")


@pytest.fixture
def study(tmp_path):
    """Artifacts of acquire and preprocess: stage -> unit -> folder; a subject's name that ends in x has no EOG."""
    folders = {"acquire": {}, "preprocess": {}}
    for unit in ("s01", "s02", "s03", "s04", "s05x"):
        eog = not unit.endswith("x")
        raw, clean = tmp_path / "acquire" / unit, tmp_path / "preprocess" / unit
        acquire(raw, unit, eog=eog)
        clean.mkdir(parents=True)
        config = preprocess.Config(sfreq=128.0, bad_channels="none", eog="regression" if eog else "none")
        preprocess.run(config, Inputs.of(unit, acquire=raw), clean)
        folders["acquire"][unit], folders["preprocess"][unit] = raw, clean
    return folders


def is_picture(path):
    return path.read_bytes()[:4] == b"\x89PNG" and path.with_suffix(".pdf").read_bytes()[:4] == b"%PDF"


def test_a_subjects_channels_are_drawn_from_its_table_alone(study, tmp_path):
    table = tmp_path / "table"
    table.mkdir()
    for name in ("quality.parquet", "spectrum.parquet"):
        (study["preprocess"]["s01"] / name).rename(table / name)
    out = tmp_path / "out"
    out.mkdir()
    config = chosen({"preprocess": preprocess.Config()}, one.DRAWINGS.subject.options)
    one.draw(config, Inputs.of("s01", preprocess=table), out)
    assert {path.name for path in out.glob("*.png")} == set(one.DRAWINGS.subject.captions)
    assert all(is_picture(path) for path in out.glob("*.png"))
    spectra = read_spectrum(table / "spectrum.parquet")
    band = [(low <= signal.index) & (signal.index <= high) for signal in spectra.values() for low, high in ((45, 60),)]
    before, after = (signal[rows].median(axis=None) for signal, rows in zip(spectra.values(), band, strict=True))
    # The band-pass ends at 40 Hz.
    assert after < before / 1000


@pytest.mark.parametrize("loud", [1.0, 30.0])
def test_a_channel_far_above_the_others_is_named_in_the_spectra(loud, monkeypatch, tmp_path):
    drawn = []
    monkeypatch.setattr(figure_of, "save", lambda figure, path: drawn.append(figure))
    hz = np.arange(1, 121) / 2
    power = pd.DataFrame(np.outer(1 / hz, [1.0, 1.2, loud]), index=hz, columns=["C3", "C4", "FC5"])
    figure_of.draw({"recorded": power, "clean": power}, (1.0, 40.0), tmp_path / "x.png")
    named = [text.get_text() for axes in drawn[0].axes for text in axes.texts]
    assert named == (["FC5", "FC5"] if loud > 3 else [])


@pytest.fixture
def seen(monkeypatch):
    """What the figure is handed: the channels' tables, the recordings' spectra and blinks."""
    calls = []
    monkeypatch.setattr(
        "hrcneuro.figures.quality_group.draw",
        lambda channels, spectra, blinks, path: calls.append((channels, spectra, blinks)),
    )
    return calls


def test_everyone_is_in_the_picture_and_up_to_four_included_ones_have_blinks(study, tmp_path, seen):
    joint.draw(None, Inputs.of("group", **study), tmp_path)
    ((channels, spectra, blinks),) = seen
    assert list(channels) == list(study["preprocess"])
    assert len(spectra) == 5
    assert len(blinks) == 2  # every second of five, of whom the last has no EOG
    high = blinks[0].recorded.max(), blinks[0].clean.max()
    assert high[0] > 60 > 3 * high[1]


def test_the_groups_spectra_are_those_of_the_subjects_picture(study, tmp_path, seen):
    joint.draw(None, Inputs.of("group", **study), tmp_path)
    pd.testing.assert_frame_equal(
        seen[0][1][1]["clean"], read_spectrum(study["preprocess"]["s02"] / "spectrum.parquet")["clean"]
    )


def test_an_excluded_subject_has_channels_and_no_line(study, tmp_path, seen):
    for name in ("s02_clean_raw.fif", "timing.parquet", "spectrum.parquet"):
        (study["preprocess"]["s02"] / name).unlink()
    joint.draw(None, Inputs.of("group", **study), tmp_path)
    channels, spectra, blinks = seen[0]
    assert "s02" in channels
    assert len(spectra) == 4
    assert len(blinks) == 3


def test_a_subject_that_was_not_acquired_is_missing_and_the_others_are_drawn(study, tmp_path):
    del study["preprocess"]["s03"], study["acquire"]["s03"]
    joint.draw(None, Inputs.of("group", **study), tmp_path)
    assert is_picture(tmp_path / "quality_group.png")


def test_nothing_is_drawn_of_nobody(tmp_path):
    joint.draw(None, Inputs("group", {}), tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_same_files_give_the_same_picture(study, tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        joint.draw(None, Inputs.of("group", **study), tmp_path / name)
    assert (tmp_path / "a/quality_group.png").read_bytes() == (tmp_path / "b/quality_group.png").read_bytes()


def test_what_it_reads_is_optional_for_each_subject():
    reads = joint.DRAWINGS.group.reads
    assert not any(read.required for read in reads)
    assert {read.of for read in reads if "quality.parquet" in read.files} == {Of.EVERYONE}
    assert {read.of for read in reads if "quality.parquet" not in read.files} == {Of.INCLUDED}


def test_the_table_says_which_channels_were_replaced(study):
    assert not read_table(study["preprocess"]["s01"] / "quality.parquet")["interpolated"].any()
