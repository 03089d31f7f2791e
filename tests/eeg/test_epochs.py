import mne
import numpy as np
import pandas as pd
import pytest

from hrcneuro.eeg import epochs
from hrcneuro.eeg.epochs import Window


@pytest.fixture
def moves():
    """Main-block and practice moves: tr-1 of RH and tr of HR, tr only, neither, practice."""
    return pd.DataFrame(
        {
            "event": "move",
            "scenario": ["iC", "iC", "sC", "iC", "sC"],
            "practice": [False, False, False, False, True],
            "condition_before": ["RH", None, "HH", None, "HH"],
            "condition_after": ["HR", "RH", None, None, None],
        }
    )


@pytest.fixture
def events():
    nothing = {name: [None] * 3 for name in ("scenario", "practice", "condition_before", "condition_after")}
    return pd.DataFrame({"event": ["square", "rt", "square"], **nothing})


def test_the_papers_window_has_717_samples():
    window = Window.of(512.0, -0.2, 1.2)
    assert (window.first, window.length) == (-102, 717)
    assert window.tmin == -102 / 512


@pytest.mark.parametrize("sfreq", [128.0, 256.0, 500.0, 512.0, 1000.0])
def test_window_and_cut_equal_mne(sfreq):
    rng = np.random.default_rng(0)
    data = rng.standard_normal((3, int(10 * sfreq)))
    onsets = np.sort(rng.choice(np.arange(int(sfreq), int(8 * sfreq)), 20, replace=False))
    raw = mne.io.RawArray(data, mne.create_info(3, sfreq, "eeg"), verbose="error")
    triples = np.column_stack([onsets, np.zeros(20, int), np.ones(20, int)])
    theirs = mne.Epochs(raw, triples, tmin=-0.2, tmax=1.2, baseline=None, preload=True, verbose="error")
    window = Window.of(sfreq, -0.2, 1.2)
    np.testing.assert_array_equal(epochs.cut(data, onsets, window), theirs.get_data())
    assert window.tmin == pytest.approx(theirs.tmin)


def test_candidates_are_main_block_moves_with_a_condition(moves, events):
    assert epochs.candidates(moves).index.tolist() == [0, 1, 2]
    assert epochs.candidates(events).index.tolist() == [0, 1, 2]


def test_tags(moves, events):
    assert epochs.tags(epochs.candidates(moves)) == ["iC/before_RH/after_HR", "iC/after_RH", "sC/before_HH"]
    assert epochs.tags(events) == ["square", "rt", "square"]


def test_each_reason_is_found_and_the_first_counts():
    data = np.zeros((2, 1000))
    data[1, 500] = -2.0
    window = Window(100.0, -10, 30)
    onsets = np.array([-1, 5, 20, 100, 300, 495, 700, 981, 970])
    reasons = epochs.judge(data, onsets, window, borders=[105, 690], marked=[(315, 330)], limit=1.0)
    assert reasons.tolist() == ["no onset", "outside", "", "boundary", "marked", "amplitude", "", "outside", ""]
    assert set(reasons) - {""} <= set(epochs.REASONS)


def test_an_epoch_may_touch_a_border_but_not_hold_it():
    window = Window(100.0, 0, 10)
    reasons = epochs.judge(np.zeros((1, 100)), np.arange(20, 45), window, borders=[40], marked=[], limit=1.0)
    crossing = [onset for onset, reason in zip(range(20, 45), reasons, strict=True) if reason]
    assert crossing == list(range(31, 40))


def test_a_marked_stretch_ends_before_its_stop():
    window = Window(100.0, 0, 10)
    reasons = epochs.judge(
        np.zeros((1, 100)), np.array([10, 11, 24, 25]), window, borders=[], marked=[(20, 25)], limit=1
    )
    assert reasons.tolist() == ["", "marked", "marked", ""]


def test_the_limit_itself_is_allowed():
    data = np.full((1, 50), 3.0)
    judged = [
        epochs.judge(sign * data, np.array([10]), Window(10.0, 0, 5), borders=[], marked=[], limit=limit)[0]
        for sign in (1, -1)
        for limit in (3.0, 2.999)
    ]
    assert judged == ["", "amplitude", "", "amplitude"]


def test_tally_has_all_cases_also_empty_ones(moves):
    trials = epochs.candidates(moves)
    counts = epochs.tally(trials, np.array(["", "amplitude", "boundary"], dtype=object))
    assert len(counts) == 2 * 2 * 4
    by = counts.set_index(["scenario", "position", "case"])
    assert by.loc[("iC", "before", "RH"), "kept"] == 1
    assert by.loc[("iC", "after", "HR"), "kept"] == 1
    assert by.loc[("iC", "after", "RH"), ["kept", "rejected", "amplitude"]].tolist() == [0, 1, 1]
    assert by.loc[("sC", "before", "HH"), ["kept", "rejected", "boundary"]].tolist() == [0, 1, 1]
    assert by["kept"].sum() == 2
    assert by["rejected"].sum() == 2


def test_tally_of_another_study_counts_events(events):
    counts = epochs.tally(events, np.array(["", "", "outside"], dtype=object))
    assert counts[["scenario", "case", "position", "kept", "rejected", "outside"]].to_numpy().tolist() == [
        ["all", "rt", "event", 1, 0, 0],
        ["all", "square", "event", 1, 1, 1],
    ]


def test_rates_that_are_meant_to_be_equal_give_windows_of_one_length():
    # What 511.9 and 999.7 Hz come to at preprocess.sfreq = 511; half a second of either lies beside a half.
    windows = [Window.of(sfreq, -0.5, 1.2) for sfreq in (511.00035, 510.99907)]
    assert len({(w.first, w.length) for w in windows}) == 1
    assert Window.of(512.0, -0.2, 1.2) == Window(512.0, -102, 717)
