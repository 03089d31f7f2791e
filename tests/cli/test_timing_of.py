"""What the command timing measures, says and keeps, of a session that was recorded at virtual pace."""

import json

import numpy as np
import pytest
from recorded_lab import SFREQ, Lab

from hrcneuro.cli import timing_of
from hrcneuro.cli.console import Console
from hrcneuro.config import settings
from hrcneuro.live import part, xdf
from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.session import simulate_session

pytest.importorskip("pyxdf", reason="pyxdf is not installed: pip install 'hrcneuro[xdf]'")


@pytest.fixture(scope="module")
def trials():
    params = SessionParams(practice_episodes=1, blocks=1, episodes_per_block=2)
    table = simulate_session(params, rng=np.random.default_rng(5))
    return table.assign(onset_s=table["onset_s"] + 3)


def test_it_says_how_late_samples_are_and_which_markers_have_no_edge(tmp_path, trials):
    lab = Lab(tmp_path / "recordings" / "s01" / "one", trials)
    trigger, times = lab.amplifier.trigger, iter(range(1000))
    lab.amplifier.trigger = lambda when: None if next(times) == 4 else trigger(when)
    lab.go_on().end()
    study = settings.load(None, ())
    done = timing_of.measure(tmp_path, "s01", study, None, Console())
    said = "\n".join(done.lines)
    assert f"1 of {len(trials)} markers have no trigger edge beside them: move/subject=s01/" in said
    assert "eeg: taken to written, median" in said
    assert "; on the disk within 1" in said
    assert "command and motion: not known, no record of the robot" in said
    page = (tmp_path / "timing" / "s01" / "one" / "timing.html").read_text()
    assert "markers have no trigger edge beside them" in page
    assert "taken to written" in page
    about = json.loads((tmp_path / "timing" / "s01" / "one" / "timing.json").read_text())
    assert about["without_edge"] == 1
    # The amplifier holds samples back for 30 ms, and a step comes each 50.
    assert 30 < about["arrival_ms"]["eeg"]["median"] < 100
    assert 1000 / SFREQ < about["arrival_ms"]["eeg"]["p99"] <= about["arrival_ms"]["eeg"]["worst"]


def test_the_newest_recording_is_the_one_that_was_begun_last_whatever_its_folder_is_called(tmp_path):
    """Clocks of a place are set back once a year."""
    begun = {"2026-10-25T025900": "2026-10-25T00:59:00+00:00", "2026-10-25T020100": "2026-10-25T01:01:00+00:00"}
    for name, when in begun.items():
        (tmp_path / name).mkdir()
        part.path_of(tmp_path / name, 1).write_bytes(xdf.MAGIC + xdf.file_header(when))
    assert part.newest(tmp_path) == tmp_path / "2026-10-25T020100"
    # One that was resumed meanwhile is newer.
    part.path_of(tmp_path / "2026-10-25T025900", 2).write_bytes(
        xdf.MAGIC + xdf.file_header("2026-10-25T03:00:00+02:00")
    )
    assert part.newest(tmp_path) == tmp_path / "2026-10-25T020100"
    part.path_of(tmp_path / "2026-10-25T025900", 3).write_bytes(
        xdf.MAGIC + xdf.file_header("2026-10-25T03:00:00+01:00")
    )
    assert part.newest(tmp_path) == tmp_path / "2026-10-25T025900"
    assert part.newest(tmp_path / "nowhere") is None
