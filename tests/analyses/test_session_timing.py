"""The timing of a recorded session: what was planted is found, within the intervals that are given."""

import numpy as np
import pandas as pd
import pytest
from recorded_lab import SFREQ, Lab, marker_of

from hrcneuro.analyses import session_timing as analysis
from hrcneuro.eeg import edges
from hrcneuro.errors import ConfigError
from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.session import simulate_session
from hrcneuro.sources import chain as chain_of
from hrcneuro.sources.chain import read_chain
from hrcneuro.stages import acquire

pytest.importorskip("pyxdf", reason="pyxdf is not installed: pip install 'hrcneuro[xdf]'")
STEP_MS = 1e3 / SFREQ


@pytest.fixture(scope="module")
def trials():
    """Some 110 moves at any time between two samples."""
    params = SessionParams(practice_episodes=1, blocks=2, episodes_per_block=3)
    table = simulate_session(params, rng=np.random.default_rng(5))
    return table.assign(onset_s=table["onset_s"] + 3)


def measured(tmp_path, trials, *what, driven=None, **options):
    lab = Lab(tmp_path / "one", trials, what=what, **options).go_on().end()
    chain = read_chain([lab.folder / "part1.xdf"], acquire.Config(), window_s=0.3, delay_s=0.0)
    return analysis.session_timing(chain.moves, chain.sfreq, driven(lab) if driven else None), lab


def of(timing, name):
    return next(one for one in timing.links if one.name == name)


@pytest.mark.parametrize("delay", [0.0, 0.037, 0.1])
def test_a_planted_delay_is_found_within_its_interval(tmp_path, trials, delay):
    timing, _ = measured(tmp_path, trials, f"delay={delay}")
    found = of(timing, "marker_edge_ms").latency
    assert timing.amp_delay.low <= 1e3 * delay <= timing.amp_delay.high
    # An edge is seen in the sample behind it, and moves begin anywhere between two.
    assert timing.amp_delay.value == pytest.approx(1e3 * delay, abs=0.5)
    assert found.low >= 1e3 * delay - 0.01
    assert found.high <= 1e3 * delay + STEP_MS + 0.01
    assert found.n == len(timing.moves) - timing.without_edge


def test_planted_jitter_and_drift_are_found_too(tmp_path, trials):
    timing, _ = measured(tmp_path, trials, "delay=0.037", "jitter=0.005", "drift=50")
    found = of(timing, "marker_edge_ms").latency
    assert timing.amp_delay.low <= 37 <= timing.amp_delay.high
    assert timing.amp_delay.value == pytest.approx(37, abs=1.5)
    assert found.sd == pytest.approx(np.hypot(5, STEP_MS / np.sqrt(12)), rel=0.2)
    assert timing.drift.low <= 50 <= timing.drift.high
    assert f"{timing.drift.value:.2f}" in analysis.verdict(timing)


@pytest.mark.parametrize("lost", [("drop=0.3@8", "drop=2.5@20"), ("drop=0.02@8",)])
def test_what_is_missing_is_no_drift(tmp_path, trials, lost):
    timing, _ = measured(tmp_path, trials, "drift=50", *lost)
    assert timing.drift.low <= 50 <= timing.drift.high
    assert timing.drift.half < 20


def test_a_clock_of_its_own_changes_nothing_that_is_corrected(tmp_path, trials):
    timing, _ = measured(tmp_path, trials, "delay=0.037", offset=1234.5, drift_ppm=40.0)
    assert timing.amp_delay.value == pytest.approx(37, abs=0.5)


def robot_of(lab):
    """Return the robot's own record of the session."""
    numbers = lab.trials[["practice", "block", "episode", "trial"]].reset_index(drop=True)
    rng = np.random.default_rng(2)
    t_f = rng.uniform(0.6, 1.2, len(numbers))
    return numbers.assign(
        lsl_s=lab.amplifier.start + lab.trials["onset_s"].to_numpy() - lab.robot_offset,
        t_f_s=t_f,
        trigger_latency_ms=28 + 5 * t_f,
        marker_latency_ms=0.2,
    )


@pytest.mark.parametrize("robot_offset", [0.0, -54321.5])
def test_the_robots_record_adds_its_links_and_the_duration_of_each_move(tmp_path, trials, robot_offset):
    """Also where the robot's machine is another one, with a clock of its own."""
    timing, _ = measured(tmp_path, trials, driven=robot_of, robot_offset=robot_offset)
    assert [one.name for one in timing.links] == ["command_motion_ms", "motion_sent_ms", "marker_edge_ms"]
    grows = of(timing, "command_motion_ms").by_duration
    assert grows.value == pytest.approx(5)
    assert of(timing, "marker_edge_ms").by_duration.low <= 0 <= of(timing, "marker_edge_ms").by_duration.high
    assert "did not depend on the duration" in analysis.verdict(timing)


def test_another_sessions_record_is_not_taken_for_this_one(tmp_path, trials):
    timing, _ = measured(tmp_path, trials, driven=lambda lab: robot_of(lab).assign(lsl_s=5.0))
    assert [one.name for one in timing.links] == ["marker_edge_ms"]


def test_markers_without_edges_are_said(tmp_path, trials):
    timing, lab = measured(tmp_path, trials)
    chain = pd.DataFrame({"marker": [marker_of(lab.trials.iloc[0])], "part": 1, "marker_s": 1.0, "sent_s": 1.0})
    chain = chain.assign(edge_s=np.nan, edge_sample=np.nan, segment=0)
    alone = analysis.session_timing(chain, SFREQ)
    assert (alone.links, alone.without_edge) == ([], 1)
    assert "No trigger edges" in analysis.verdict(alone)
    assert timing.without_edge <= 2


def test_an_end_point_adds_its_links_and_a_channel_that_is_not_there_is_named(tmp_path, trials):
    lab = Lab(tmp_path / "one", trials, what=("delay=0.037",)).go_on().end()
    part = [lab.folder / "part1.xdf"]
    chain = read_chain(part, acquire.Config(), window_s=0.3, delay_s=0.0, end="TRIGGER")
    timing = analysis.session_timing(chain.moves, chain.sfreq)
    assert of(timing, "marker_end_ms").latency == of(timing, "marker_edge_ms").latency
    assert of(timing, "edge_end_ms").latency.worst == 0
    with pytest.raises(ConfigError, match="no channel 'PHOTTO'"):
        read_chain(part, acquire.Config(), window_s=0.3, delay_s=0.0, end="PHOTTO")


def light(n=60_000, height=400.0, noise=5.0, seed=1):
    rng = np.random.default_rng(seed)
    on = np.arange(1000, n - 1000, 2711)
    values = noise * rng.standard_normal(n)
    for at in on:
        values[at : at + 300] += height
    return values, on


SPOILED = {
    "as it is": lambda values: values,
    "a baseline that drifts by three times its range": lambda values: values + np.linspace(0, 1200, len(values)),
    "a baseline that sways": lambda values: values + 300 * np.sin(np.arange(len(values)) / 9000),
    "peaks of one sample": lambda values: values + 800 * (np.arange(len(values)) % 1777 == 5),
    "an upside-down offset": lambda values: values - 1e5,
    "whole numbers, as a converter has them": lambda values: np.rint(values),
}


@pytest.mark.parametrize("spoiled", SPOILED)
def test_a_photodiode_s_edges_are_where_it_passes_half_its_range(spoiled):
    values, on = light()
    values = SPOILED[spoiled](values)
    stream = {"time_series": values[:, None], "info": {"nominal_srate": ["1000"]}}
    np.testing.assert_array_equal(chain_of._edges(stream, 0), on)


def test_noise_about_the_threshold_makes_one_edge_of_each():
    values, on = light(noise=40.0)
    slow = np.convolve(values - 0.5 * values, np.ones(40) / 40, "same") + values * 0.1
    found = edges.rising(slow, 1000.0)
    assert len(found) == len(on)
    assert np.abs(found - on).max() < 45


def test_where_there_is_nothing_but_noise_or_nothing_at_all_there_is_no_edge():
    assert len(edges.rising(light(height=0.0)[0], 1000.0)) == 0
    assert len(edges.rising(np.zeros(5000), 1000.0)) == 0
    assert len(edges.rising(np.full(5000, np.nan), 1000.0)) == 0
    assert len(edges.rising(np.ones(2), 1000.0)) == 0


def test_a_light_that_is_on_where_a_segment_begins_is_no_edge():
    values, on = light()
    np.testing.assert_array_equal(edges.rising(values, 1000.0, [0, int(on[3])]), np.delete(on, 3))
