"""The chapter on a closed loop: its numbers are those of the tables, and it says what is synthetic."""

import re
from dataclasses import astuple, replace

import numpy as np
import pandas as pd
import pytest

from hrcneuro.analyses.loop_rows import loop_tables
from hrcneuro.analyses.loop_sessions import as_measured, deadlines, loop_sessions
from hrcneuro.learning import loop_scores
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.loop import LoopModel, simulate_loop
from hrcneuro.learning.loop_decoders import anticipation
from hrcneuro.learning.params import LEARNERS
from hrcneuro.learning.rates import Rates
from hrcneuro.paradigm.params import ClosedParams
from hrcneuro.report.loop import chapter, null_of
from tests.helpers.loop_lines import PlayedLogs

CLOSED = ClosedParams(blocks=2, episodes_per_block=5)
MODEL = LoopModel(kinds(alpha=0.05, ddof=0, horizon=40.0)["paper"], tau=0.1, closed=CLOSED)


def tables(n=3, rates=70, subject="s01", **how):
    decoder = anticipation(Rates.level(rates))
    logs = [PlayedLogs(decoder, CLOSED, rng=np.random.default_rng([1, k]), **how) for k in range(n)]
    parts = [loop_tables(one.experiment, one.decisions, subject=subject, session=str(k)) for k, one in enumerate(logs)]
    return [pd.concat(one) for one in zip(*parts, strict=True)]


def words(html):
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", html)).replace("&#39;", "'")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("loop")
    steps, episodes = tables(late=0.1)
    null = null_of(steps, episodes, MODEL, sessions=6, repetitions=50, seed=2)
    remark = "SYNTHETIC: all of it"
    html = chapter(steps, episodes, null, picture=folder / "loop.png", deadline_s=0.75, mode="closed", remark=remark)
    return steps, episodes, null, words(html), html, folder


def test_the_numbers_are_those_of_the_tables(written):
    steps, episodes, _, said, *_ = written
    played = loop_sessions(steps, episodes)
    end = loop_scores.mean_over_sessions(loop_scores.accuracy(played)[:, -1])
    assert f"all four directions: {end.mean:.3f} ± {end.half_width:.3f}" in said
    met, of = deadlines(steps)["deadline_met"]
    assert f"{met:,} of {of:,} decisions came within 750 ms" in said
    assert f"RR TNR {played.decisions.sum(axis=(0, 2))[0]:,} " in said


def test_it_says_what_is_synthetic_and_shows_its_figure(written):
    *_, said, html, folder = written
    assert "SYNTHETIC: all of it" in said
    assert "src='loop.png'" in html
    assert (folder / "loop.png").stat().st_size > 20_000
    assert (folder / "loop.pdf").is_file()


def test_the_null_model_goes_as_what_was_played(written):
    steps, _, null, *_ = written
    like = as_measured(MODEL, steps)
    assert 0.8 < like.teaches < 1.0
    assert like.in_time == 1.0
    assert null.null.policies.shape == (6, 10, 4)
    for name in ("null", "independent"):
        cases = getattr(null, name).decisions.sum(axis=(0, 2))
        assert (cases > 0).all()
    assert set(null.sim1) == {"at these rates", "at one rate in all cases", "at the paper's"}


def test_the_null_model_decides_as_rightly_as_was_measured_where_the_person_adapts():
    """Measured by the person's own choice: what they came to expect is in the rates, and must not enter them twice."""
    closed = ClosedParams(blocks=2, episodes_per_block=10, adapts=True)
    tossing = replace(MODEL, closed=closed, floor=0.5)
    drifting = simulate_loop(tossing, anticipation(Rates.level(100)), sessions=20, seed=2)
    measured = loop_scores.pooled_rates(drifting)
    steps, _ = tables(1)
    null = simulate_loop(as_measured(tossing, steps), anticipation(measured), sessions=20, seed=3)
    assert max(astuple(measured)) < 90
    assert astuple(loop_scores.pooled_rates(null)) == pytest.approx(astuple(measured), abs=4)


def test_each_subject_has_a_null_model_of_the_own_rates():
    """One subject's decoder is always right, another's always wrong: no mean of the two would learn as they do."""
    parts = [tables(3, rates=rates, subject=name) for name, rates in (("s01", 100), ("s02", 0))]
    steps, episodes = (pd.concat(both) for both in zip(*parts, strict=True))
    null = null_of(steps, episodes, MODEL, sessions=8, repetitions=2, seed=1)
    ends = loop_scores.accuracy(null.null)[:, -1]
    assert len(ends) == 8
    assert ends[:4].min() > 0.6
    assert ends[4:].max() < 0.4


@pytest.mark.parametrize("claimed", [Rates.level(50), Rates.level(80), None])
def test_the_null_models_learner_weighs_answers_by_the_rates_that_the_decoder_claimed(claimed):
    steps, episodes = tables(2, learner="bayes")
    bayes = replace(MODEL, kind=kinds(alpha=0.05, ddof=0, horizon=40.0)["bayes"])
    null = null_of(steps, episodes, bayes, sessions=3, repetitions=2, seed=1, claimed=claimed)
    heard = {name: bool(np.abs(getattr(null, name).policies - 0.5).max() > 0.01) for name in ("null", "independent")}
    # Without a claim, answers that know nothing weigh nothing.
    assert heard == {"null": claimed != Rates.level(50), "independent": claimed == Rates.level(80)}


@pytest.mark.parametrize("name", LEARNERS)
def test_sim1_stands_beside_every_learner(name, tmp_path):
    steps, episodes = tables(2, learner=name)
    like = replace(MODEL, kind=kinds(alpha=0.05, ddof=0, horizon=40.0)[name])
    null = null_of(steps, episodes, like, sessions=2, repetitions=20, seed=1)
    ends = [curve.mean[-1] for curve in null.sim1.values()]
    assert len(ends) == 3
    assert all(0.5 < end < 1 for end in ends)


def test_one_session_has_no_intervals_and_without_its_rates_no_null_model(tmp_path):
    steps, episodes = tables(1)
    steps = steps[~steps["expected_case"].isin(["HR", "HH"])]
    null = null_of(steps, episodes, MODEL, sessions=2, repetitions=10, seed=2)
    assert null is None
    said = words(chapter(steps, episodes, null, picture=tmp_path / "loop.png", deadline_s=0.75, mode="semi"))
    assert "No null model" in said
    assert "HR TPR 0 none none" in said
    assert "nan" not in said
    assert "1 session of up to 10 episodes; mode semi" in said
