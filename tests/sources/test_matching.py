"""Markers against the log where their numbers agree: a lost marker and one too many are found, no sound session is."""

import numpy as np
import pandas as pd
import pytest

from hrcneuro.errors import DataError
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.sources import matching, simulated

SESSION = SessionParams(practice_episodes=1, blocks=3, episodes_per_block=5)


def logged(seed: int, timing: TimingParams = TimingParams()) -> pd.DataFrame:
    return simulated.simulate_trials("s01", session=SESSION, timing=timing, seed=seed)


def markers(onsets: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame({"onset_s": onsets, "event": "33025"})


def moved(onsets: np.ndarray, lost: int, after: int, share: float) -> np.ndarray:
    """Return the onsets without one, and with one more in the gap after another."""
    spurious = onsets[after] + share * (onsets[after + 1] - onsets[after])
    return np.sort(np.append(np.delete(onsets, lost), spurious))


@pytest.mark.parametrize("timing", [TimingParams(), TimingParams(reaction_mean_s=0.8, reaction_sd_s=0.5)])
@pytest.mark.parametrize("seed", range(6))
def test_sound_sessions_are_matched_also_where_people_hesitate(seed, timing):
    trials = logged(seed, timing)
    match = matching.match_onsets(markers(trials["onset_s"].to_numpy()), trials, subject="s01")
    np.testing.assert_array_equal(match.onsets_s, trials["onset_s"])


def test_a_lost_marker_and_one_too_many_are_found_wherever_an_episode_begins_between_them():
    rng = np.random.default_rng(0)
    accepted = []
    for seed in range(3):
        trials = logged(seed)
        onsets = trials["onset_s"].to_numpy()
        first = np.flatnonzero(~trials.duplicated(["practice", "block", "episode"]))
        episode = np.searchsorted(first, np.arange(len(onsets)), side="right")
        for lost in range(0, len(onsets), 7):
            # Not in a pause, where a marker too many can pass for an episode's first or last move.
            others = np.flatnonzero((episode[:-1] != episode[lost]) & (episode[:-1] == episode[1:]))
            after = int(rng.choice(others))
            found = matching.first_misplaced(moved(onsets, lost, after, rng.uniform(0.1, 0.9)), trials)
            accepted.append(not found)
    assert len(accepted) > 40
    assert np.mean(accepted) < 0.03


@pytest.mark.parametrize("by", [1, -1, 2, 40])
def test_a_shift_of_all_rows_is_refused(by):
    trials = logged(1)
    onsets = trials["onset_s"].to_numpy()
    ends = (onsets[0] - 0.9 * np.arange(40, 0, -1), onsets[-1] + 0.9 * np.arange(1, 41))
    longer = np.concatenate([ends[0], onsets, ends[1]])
    with pytest.raises(DataError, match="not of the same moves"):
        matching.match_onsets(markers(longer[40 + by : 40 + by + len(onsets)]), trials, subject="s01")


def test_the_first_place_of_disagreement_is_named():
    trials = logged(2)
    onsets = trials["onset_s"].to_numpy()
    first = np.flatnonzero(~trials.duplicated(["practice", "block", "episode"]))
    bad = moved(onsets, first[4] + 1, first[8] + 1, 0.5)
    with pytest.raises(DataError) as caught:
        matching.match_onsets(markers(bad), trials, subject="s01")
    row = trials.iloc[first[5]]
    place = f"{'Test' if row.practice else 'BLOCK'} {row.block}, episode {row.episode}"
    assert f"{place} begins with the marker at {bad[first[5]]:.3f} s" in caught.value.problem
    named = matching.first_misplaced(moved(onsets, first[4] + 1, first[4] + 3, 0.2), trials)
    assert "moves do not follow faster than" in named


def test_an_onset_code_with_a_plus_in_its_name_is_one_code():
    trials = logged(3)
    both = markers(trials["onset_s"].to_numpy()).assign(event="A+B")
    other = pd.DataFrame({"onset_s": [1.0, 2.0], "event": ["A", "B"]})
    found = matching.match_onsets(pd.concat([other, both], ignore_index=True), trials, event="A+B")
    np.testing.assert_array_equal(found.onsets_s, trials["onset_s"])


@pytest.mark.parametrize("practice", [True, False])
def test_motions_that_began_again_or_never_ended_have_markers_of_no_row(practice):
    trials = logged(4)
    keys = list(trials[["practice", "block", "episode", "trial"]].itertuples(index=False, name=None))
    onsets = trials["onset_s"].tolist()
    at = len(keys) // 2
    begun, when = list(keys), list(onsets)
    # Stopped once and made again, a good while before; and one after the last row, which never ended.
    begun.insert(at, keys[at])
    when.insert(at, (onsets[at - 1] + onsets[at]) / 2)
    begun.append((False, 99, 1, 0))
    when.append(onsets[-1] + 5)
    kept = [practice or not key[0] for key in begun]
    seen = markers(np.array(when)[kept])
    found = matching.match_onsets(seen, trials, begun=begun)
    expected = trials["onset_s"] if practice else trials["onset_s"].where(~trials["practice"])
    np.testing.assert_array_equal(found.onsets_s, expected)
    with pytest.raises(DataError, match="motions that began, code 33025 occurs"):
        matching.match_onsets(seen.iloc[1:], trials, begun=begun)
