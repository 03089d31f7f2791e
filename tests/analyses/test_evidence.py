"""A closed loop with people: the published logs' known figures, the learner that they replay, what was foretold."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hrcneuro.analyses import gaze_predictions, gaze_scores
from hrcneuro.analyses.evidence import evidence
from hrcneuro.answers import evidences
from hrcneuro.learning.gaze import STEP
from hrcneuro.learning.gaze_counts import follows, is_path, trial_counts
from hrcneuro.sources.gaze_logs import read_sessions
from hrcneuro.stages import simulate
from tests.helpers import gaze_logs

LOGS = Path(__file__).parents[2] / "../shared/data/coadaptation"


@pytest.fixture(scope="module")
def published():
    if not LOGS.is_dir():
        pytest.skip("the published session logs are not here (shared/data)")
    return read_sessions(LOGS)


def test_the_known_figures_of_the_published_logs(published):
    rows, subjects = gaze_scores.session_rows(published), gaze_scores.subject_rows(published)
    assert (len(published), len(rows), set(rows["trials"]), len(subjects)) == (64, 48, {50}, 16)
    pooled = subjects["balanced"]
    found = (pooled.mean(), pooled.std(), pooled.min(), pooled.max())
    assert [round(x, 3) for x in found] == [0.757, 0.117, 0.505, 0.918]
    by = rows.groupby("bin")[["first_right", "last_right"]].mean().round(2)
    sizes = rows.groupby("bin").size()
    known = {"< 0.60": (8, 0.38, 0.50), "0.60-0.75": (11, 0.43, 0.39), "0.75-0.85": (16, 0.34, 0.74)}
    for interval, (n, first, last) in (known | {">= 0.85": (13, 0.45, 0.74)}).items():
        assert (sizes[interval], *by.loc[interval]) == pytest.approx((n, first, last), abs=0.0051)
    runs = rows.groupby("run")[["first_right", "last_right"]].mean()
    assert runs.round(2).to_numpy().tolist() == [[0.34, 0.62], [0.40, 0.61], [0.45, 0.63]]


def test_the_published_learner_comes_out_again_to_the_last_digit(published):
    replayed = gaze_scores.Replay(published)
    trials = replayed.rows()
    told = gaze_scores.replay_summary(trials, replayed.paths_by_chance())
    assert (told["rows"], told["rows_one"], told["rows_several"], told["unsolved"]) == (12800, 8641, 33, 0)
    # What the search does not know agrees wherever it says something: the logged number, and that a gaze goes one way.
    assert (told["trials_one"], told["whole"], told["whole_agree"]) == (946, 717, 717)
    assert (told["logged"], told["allowed"], told["disagreeing"]) == (2400, 2400, [])
    assert (told["settled"], told["settled_paths"]) == (1535, 1535)
    assert told["paths_by_chance"] < 0.25
    # Half of the logs' last digit.
    assert (told["sessions"], told["replayed"]) == (64, 64)
    assert told["largest_difference"] < 5.0e-13
    assert len(trials) == 3200
    apart = [gaze_scores.looks(ways) for ways in several_paths(replayed)]
    assert len(apart) == told["several_paths"] == 446
    assert np.median([np.ptp(one, axis=0).max() for one in apart]) < 0.051


def test_no_answer_of_a_published_decoder_could_be_another(published):
    for one in published:
        assert follows(one.before, one.policies, one.error).all()
        turned = follows(one.before, one.policies, ~one.error)
        for trial in np.flatnonzero(turned):
            # Two of 3,200 trials: their number of transitions tells.
            found = trial_counts(one.before[trial], one.policies[trial], error=not one.error[trial])
            assert one.transitions is not None
            assert not found.allows(int(one.transitions[trial]))


def several_paths(replayed):
    """Yield the counts of each trial whose logged number leaves more than one path: ndarray, shape (n_ways, 4, 4)."""
    for session, counts in zip(replayed.sessions, replayed.counts, strict=True):
        for one, logged in zip(counts, session.transitions if session.right is not None else (), strict=False):
            ways = one.matrices(int(logged))
            if (paths := is_path(ways)).sum() > 1:
                yield ways[paths]


def plain_sums(before, after, error, *, most, tolerance):
    """Return the sums of a row's transitions, up to ``most``, that make integers of its counts, nearly."""
    step = -STEP if error else STEP
    sums = [n for n in range(most + 1) if 1.0 + step * n > 1e-9]
    counts = ((1.0 + step * np.array(sums))[:, None] * after - before) / step
    whole = (np.abs(counts - np.rint(counts)) < tolerance).all(axis=1) & (np.rint(counts) >= 0).all(axis=1)
    return {int(n) for n in np.rint(counts[whole]).sum(axis=1)}


@pytest.mark.parametrize(("most", "tolerance", "of", "agree"), [(40, 1e-3, 761, 672), (60, 2e-4, 791, 681)])
def test_a_plainer_search_for_the_transitions_disagrees_with_the_log_here_and_there(
    published, most, tolerance, of, agree
):
    """What it calls settled, and how often the log agrees: as the page of the evidence says."""
    agrees, cut = [], []
    for session in (one for one in published if one.transitions is not None):
        trials = zip(session.before, session.policies, session.error, session.transitions, strict=True)
        for before, after, error, logged in trials:
            pairs = zip(before, after, strict=True)
            rows = [plain_sums(x, y, bool(error), most=most, tolerance=tolerance) for x, y in pairs]
            if all(len(row) == 1 for row in rows):
                agrees.append(sum(min(row) for row in rows) == logged)
                cut.append(trial_counts(before, after, error=bool(error)).truncated > 0)
    assert (len(agrees), sum(agrees)) == (of, agree)
    # It errs where a count was truncated, and only there.
    assert all(was for was, right in zip(cut, agrees, strict=True) if not right)


def test_a_log_whose_transitions_were_altered_is_listed():
    sessions = [gaze_logs.session("s03", 1, seed=2)[0]]
    counts = gaze_scores.Replay(sessions).counts[0]
    whole = next(i for i, one in enumerate(counts) if one.unique and not one.truncated)
    assert sessions[0].transitions is not None
    sessions[0].transitions[whole] += 5
    replayed = gaze_scores.Replay(sessions)
    told = gaze_scores.replay_summary(replayed.rows(), replayed.paths_by_chance())
    number = int(counts[whole].least.sum())
    assert told["disagreeing"] == [
        {"subject": "s03", "run": 1, "trial": whole + 1, "transitions": number + 5, "counted": number}
    ]
    assert told["allowed"] == 49
    assert told["whole_agree"] == told["whole"] - 1


def test_a_session_that_cannot_be_followed_is_counted_as_not_replayed_and_told_in_words():
    sessions = [gaze_logs.session("s03", run, seed=2)[0] for run in (1, 2)]
    sessions[0].error[4] ^= True
    replayed = gaze_scores.Replay(sessions)
    told = gaze_scores.replay_summary(replayed.rows(), replayed.paths_by_chance())
    assert (told["sessions"], told["replayed"], told["unsolved"]) == (2, 1, 1)
    assert told["largest_difference"] < 1e-9
    assert [(one["trial"], one["counted"]) for one in told["disagreeing"]] == [(5, None)]
    lines = evidences._replay(told)
    assert any("policies of 1 of 2 sessions, replayed" in line for line in lines)
    assert any(line.endswith("logged, no transitions explain its policy") for line in lines)
    assert not any("1 or more" in line for line in lines)
    none = gaze_scores.replay_summary(gaze_scores.Replay(sessions[:1]).rows(), float("nan"))
    assert "policies of 0 of 1 session could be replayed" in evidences._replay({**none, "largest_difference": None})


def test_looks_that_are_read_are_those_that_were():
    one, counts = gaze_logs.session("s03", 1, seed=4)
    reading = gaze_scores.Replay([one]).reading()
    true = gaze_scores.looks(counts)
    known = reading.known[0]
    assert known.mean() > 0.9
    away = np.abs(reading.looks[0] - true)[known].max(axis=1)
    assert np.median(away) < 1e-12
    assert away.max() < 0.35


def test_a_resampled_person_brings_all_sessions():
    people = gaze_scores.People([name for name in "abcde" for _ in range(2)], seed=1)
    assert people.mean(np.repeat([0.0, 0.0, 0.0, 0.0, 1.0], 2)) == (0.0, 0.6)
    assert people.mean(np.tile([0.0, 1.0], 5)) == (0.5, 0.5)
    assert people.mean(np.repeat([3.0, 9.0], 5), np.arange(10) < 10) != (3.0, 3.0)
    assert people.count(np.arange(10) < 3) == 2
    assert all(np.isnan(people.mean(np.ones(10), np.zeros(10, bool))))


def test_of_few_people_no_interval_is_known():
    few, enough = (gaze_scores.People([f"s{i // 3}" for i in range(3 * n)], seed=1) for n in (4, 5))
    assert all(np.isnan(few.mean(np.linspace(0, 1, 12))))
    low, high = enough.mean(np.linspace(0, 1, 15))
    assert low < 0.5 < high
    # Of all people enough, of those that count too few.
    assert all(np.isnan(enough.mean(np.linspace(0, 1, 15), np.arange(15) < 12)))


def test_guesses_are_as_far_above_chance_as_choices():
    assert gaze_predictions.as_guesses([0.5, 0.4, 1.0]).tolist() == pytest.approx([1 / 3, 1 / 3, 1.0])
    # The fewest of ten that are as good as 80 % of two.
    good = float(gaze_predictions.as_guesses(0.8))
    assert (gaze_predictions.SUCCESS - 1) / 10 < good <= gaze_predictions.SUCCESS / 10


def test_a_prediction_that_comes_true_has_slope_one_and_no_bias():
    people = gaze_scores.People([f"s{i // 3}" for i in range(30)], seed=0)
    seen = np.linspace(0.2, 1.0, 30)
    told = gaze_predictions.calibration(seen, seen, people)
    assert [told[name]["value"] for name in ("slope", "bias", "error")] == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    timid = gaze_predictions.calibration(0.5 + (seen - 0.5) / 2, seen, people)
    assert timid["slope"]["value"] == pytest.approx(2.0)
    low = gaze_predictions.calibration(seen - 0.1, seen, people)
    assert low["bias"]["value"] == pytest.approx(0.1)
    assert low["bias"]["low"] == pytest.approx(0.1)


def test_success_above_and_below_a_threshold():
    people = gaze_scores.People(["a", "b", "c", "d"], seed=0)
    told = gaze_predictions.success(np.array([0.9, 0.8, 0.6, 0.5]), np.array([0.8, 0.7, 0.7, 0.3]), 0.7, people)
    assert (told["above"]["sessions"], told["above"]["well"], told["above"]["share"]) == (2, 1, 0.5)
    assert (told["below"]["sessions"], told["below"]["well"], told["below"]["people"]) == (2, 0, 2)
    # None of two people: the exact interval, as drawing among them again and again finds none.
    assert told["below"]["low"] == 0.0
    assert told["below"]["high"] == pytest.approx(1 - 0.025**0.5)
    assert np.isnan([told["above"]["low"], told["above"]["high"]]).all()  # one of two people is no interval


def test_the_design_tool_asks_what_the_sweep_asks():
    from hrcneuro.analyses import sweep

    config = simulate.Config(
        episodes=5, carry_over=True, sweep={"accuracy": (70.0, 80.0)}, sweep_repetitions=40, evidence_repetitions=40
    )
    swept = sweep.part_table(config, 0, 1)
    tool = gaze_predictions.DesignTool(config)
    rows = pd.DataFrame(tool.rows()).set_index("accuracy")
    assert tool.guesses(np.array([0.7, 0.8])) == pytest.approx(gaze_predictions.as_guesses(swept["final"]))
    assert rows.loc[80.0, "half_width"] == pytest.approx(4 / 3 * swept["final_half_width"].iloc[1])


@pytest.mark.parametrize("subjects", [1, 2])
def test_few_people_are_told_without_intervals_and_with_what_is_missing(tmp_path, subjects):
    sessions = gaze_logs.write_study(tmp_path, subjects=subjects)
    tables, told = evidence(sessions, simulate.Config(evidence_repetitions=5))
    for one in told["calibration"].values():
        assert {value[edge] for value in one.values() for edge in ("low", "high")} == {None}
    missing, few = told["warnings"]
    assert f"{4 * subjects} of the 64 published closed sessions were found, {3 * subjects} of the 48 with" in missing
    assert f"missing: s{3 + subjects:02d} corl1" in missing
    assert few.startswith("1 person with guesses" if subjects == 1 else "2 people with guesses")
    lines = "\n".join(evidences.evidence(told))
    assert "bias" in lines
    assert "(interval not known)" in lines
    assert "not known to not known" not in lines
    # One person leaves nobody to fit her partner to.
    assert ("better in" in lines) == ("gain" in told["partners"]) == (subjects > 1)
    assert tables["sessions"]["fixed"].isna().all() == (subjects == 1)
    assert ("from 2" in few) == (subjects == 1)


def test_all_of_it_on_simulated_people_is_the_same_again(tmp_path):
    sessions = gaze_logs.write_study(tmp_path, subjects=2)
    config = simulate.Config(evidence_repetitions=5, evidence_partners=("fixed",))
    (tables, told), (again, also) = (evidence(sessions, config) for _ in range(2))
    assert told == also
    for name, table in tables.items():
        pd.testing.assert_frame_equal(table, again[name])
    assert set(tables["predicted"]["predictor"]) == {"eq3-6", "fixed"}
    assert tables["sessions"]["adapting"].isna().all()
    assert "gain" not in told["partners"]
    assert told["replay"]["largest_difference"] < 1e-9
