"""A known effect in other people's recordings: found where and when it must be, and not by chance."""

import importlib.util
import sys
from dataclasses import replace

import numpy as np
import pytest
from shared_data import RECORDINGS
from tiny_study import ROOT

pytestmark = pytest.mark.skipif(not RECORDINGS.is_dir(), reason="other people's recordings are not here (shared/data)")

spec = importlib.util.spec_from_file_location("real_p300", ROOT / "benchmarks" / "real_p300.py")
real = importlib.util.module_from_spec(spec)
sys.modules["real_p300"] = real  # where dataclasses look for the module that they are in
spec.loader.exec_module(real)
QUICK = ("--set", "decode.repeats=1", "--set", "decode.permutations=99", "--set", "decode.decoders=['rlda']")


@pytest.fixture(params=real.STUDIES, ids=lambda study: study.subject)
def study(request):
    return request.param


def decode(hrcneuro, study, files, work):
    given = ("--config", study.config, "--set", f"acquire.path={files}", "--workdir", work, "--json", "-j", "1")
    done = hrcneuro("decode", study.subject, "--no-figures", *given, *QUICK)
    assert done.code == 0, done.err
    found = next(item for item in done.json["items"] if item["stage"] == "decode")
    return found["summary"]["all"]["targetVSstandard"]


def test_the_wave_is_there_in_its_window_and_single_trials_tell_it(hrcneuro, study, tmp_path, monkeypatch):
    monkeypatch.setattr(real, "PERMUTATIONS", 999)
    files = RECORDINGS / study.files
    numbers = decode(hrcneuro, study, files, tmp_path / "work")
    assert numbers["p"] <= 0.05
    assert numbers["bacc"] > numbers["chance"] + 5
    wave = real.component(study, files, tmp_path / "work")
    assert wave["takes"]["both takes"][1] <= 0.05
    # Both takes have it, and the wave is largest where a P300 is.
    assert {np.sign(difference) for difference, _ in wave["takes"].values()} == {study.sign}
    assert 250 <= wave["peak_ms"] <= 500


def test_shuffled_labels_are_at_chance(hrcneuro, study, tmp_path):
    files = real.shuffled(study, RECORDINGS, tmp_path / "copy", np.random.default_rng(3))
    numbers = decode(hrcneuro, study, files, tmp_path / "work")
    # Guessing is above this in 5 of 100 studies; the seed is fixed.
    assert numbers["bacc"] < numbers["chance"]
    assert numbers["p"] > 0.05


def test_the_copies_differ_from_the_recordings_in_their_labels_alone(study, tmp_path):
    from hrcneuro.config import settings
    from hrcneuro.sources import foreign, layout

    loaded = settings.load(ROOT / "configs" / f"{study.config}.toml").section("acquire", study.subject)
    shuffled = real.shuffled(study, RECORDINGS, tmp_path / "copy", np.random.default_rng(3))
    read = []
    for files in (RECORDINGS / study.files, shuffled):
        options = replace(loaded, path=str(files))
        found = layout.foreign_files(options, study.subject)
        recording = foreign.read(found, options)
        foreign.shape(recording, options)
        read.append((recording, foreign.events(recording, found, options)))
    (one, events), (two, mixed) = read
    np.testing.assert_allclose(one.data[one.picks("eeg")], two.data[two.picks("eeg")], rtol=1e-6)
    np.testing.assert_array_equal(events["onset_s"], mixed["onset_s"])
    assert sorted(events["event"]) == sorted(mixed["event"])
    assert list(events["event"]) != list(mixed["event"])
