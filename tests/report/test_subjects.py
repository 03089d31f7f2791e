"""What a chapter says of single subjects where no group ran."""

from pathlib import Path

import numpy as np
import pytest

from hrcneuro.config import settings as config
from hrcneuro.report import chapters, subjects
from hrcneuro.report.results import Results
from hrcneuro.tables.maps import read_waveforms

SETTINGS = config.load(Path(__file__).parents[2] / "configs/smoke.toml")


@pytest.fixture(scope="module")
def alone(smoke_items):
    return Results(SETTINGS, [item for item in smoke_items if item.unit == "s01"])


@pytest.mark.parametrize("stage", ["erp", "ersp", "decode"])
def test_a_subject_without_a_group_has_its_results_in_the_chapter(alone, smoke_items, stage):
    assert "s01" in chapters.tables(alone, stage)
    both = Results(SETTINGS, smoke_items)
    assert "<h3>Subjects</h3>" not in chapters.tables(both, stage)


def test_the_largest_difference_is_that_of_the_two_means(alone):
    waves = read_waveforms(alone.path("erp", "s01", "waveforms.parquet"))
    rows = {row[1]: row for row in subjects.potentials(alone).rows}
    assert set(rows) == set(SETTINGS.shared.contrasts)
    for name, (plus, minus) in SETTINGS.shared.contrasts.items():
        _, _, trials, peak, channel, at = rows[name]
        difference = waves.means[plus] - waves.means[minus]
        assert trials == f"{waves.counts[plus]} : {waves.counts[minus]}"
        assert float(peak.split()[0]) == pytest.approx(_largest(difference), abs=0.005)
        time = np.argmin(np.abs(waves.times - float(at.split()[0]) / 1000))
        assert difference[waves.channels.index(channel), time] == pytest.approx(float(peak.split()[0]), abs=0.005)


def test_rhythms_name_a_channel_frequency_and_time(alone):
    rows = subjects.rhythms(alone).rows
    assert len(rows) == len(SETTINGS.shared.contrasts)
    counts = alone.summary("ersp", "s01")["trials"]["all"]
    for _, name, trials, peak, _, at in rows:
        plus, minus = SETTINGS.shared.contrasts[name]
        assert trials == f"{counts[plus]} : {counts[minus]}"
        assert peak.endswith("µV")
        assert "Hz" in at


def _largest(values):
    return values.flat[np.argmax(np.abs(values))]
