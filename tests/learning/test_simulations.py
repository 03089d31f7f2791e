"""Published figures (paper §3.3, and the same model run 20,000 times by an independent implementation)."""

from functools import partial

import numpy as np
import pytest

from hrcneuro.learning import milestones
from hrcneuro.learning.decoder import CoinFlips
from hrcneuro.learning.learner import PaperLearner
from hrcneuro.learning.rates import PAPER, Rates
from hrcneuro.learning.simulations import Curve, Variant, paper_simulations, run_curves
from hrcneuro.learning.task import JointTask

MAKE = partial(PaperLearner, alpha=0.05)
RUN = {"seed": 11, "tau": 0.1}


def _curve(task, rates=PAPER, repetitions=3000, name="emp"):
    return run_curves([Variant("T", name, task, CoinFlips(rates))], MAKE, repetitions=repetitions, **RUN)[0]


def _at(curve, *episodes):
    return [float(curve.mean[e - 1]) for e in episodes]


def test_sim1_reaches_the_printed_milestones():
    curve = _curve(JointTask(episodes=110), repetitions=10_000)
    assert _at(curve, 35, 100) == pytest.approx([0.700, 0.800], abs=0.008)
    assert milestones.milestone(curve, 0.7).episode == pytest.approx(36, abs=2)
    assert milestones.milestone(curve, 0.8).episode == pytest.approx(101, abs=4)


@pytest.mark.parametrize(
    ("level", "expected", "repetitions"), [(50, 0.5, 10_000), (60, 0.811, 3000), (70, 0.918, 3000), (80, 0.950, 3000)]
)
def test_sim2_levels(level, expected, repetitions):
    curve = _curve(JointTask(episodes=20), Rates.level(level), repetitions)
    assert _at(curve, 20) == pytest.approx([expected], abs=0.01)


@pytest.mark.parametrize(
    ("rates", "reassign", "episodes", "expected"),
    [
        (PAPER, "every", (40, 80, 120, 160, 200), [0.716, 0.641, 0.620, 0.603, 0.594]),
        (Rates.level(80), "every", (40, 80, 120, 160, 200), [0.969, 0.900, 0.885, 0.881, 0.878]),
        (Rates.level(80), "once", (40,), [0.969]),
        (PAPER, "once", (200,), [0.82]),
    ],
)
def test_sim3_relearns_with_a_loss(rates, reassign, episodes, expected):
    curve = _curve(JointTask(reassign=reassign), rates, repetitions=5000)
    assert _at(curve, *episodes) == pytest.approx(expected, abs=0.015)


@pytest.mark.parametrize(("n", "m", "expected"), [(6, 3, 0.791), (10, 5, 0.747), (10, 2, 0.834), (10, 8, 0.653)])
def test_sim4_scales(n, m, expected):
    assert _at(_curve(JointTask(n, m, episodes=100), repetitions=2500), 100) == pytest.approx([expected], abs=0.015)


def test_the_choices_that_the_paper_leaves_open():
    # With carry-over an independent implementation gives 0.710 at 35 and 0.809 at 100.
    curve = _curve(JointTask(episodes=100, carry_over=True), repetitions=6000)
    assert _at(curve, 35, 100) == pytest.approx([0.710, 0.809], abs=0.01)


def test_band_covers_the_truth_as_often_as_it_says():
    variants = [Variant("T", str(i), JointTask(episodes=35), CoinFlips(PAPER)) for i in range(120)]
    curves = run_curves(variants, MAKE, repetitions=100, **RUN)
    covered = np.mean([abs(c.mean[-1] - 0.6998) < c.half_width[-1] for c in curves])
    assert 0.89 <= covered <= 0.99


def test_26_curves_with_the_papers_cases():
    variants = paper_simulations(
        JointTask(),
        empirical=CoinFlips(PAPER),
        levels=(50, 60, 70, 80),
        reassign="every",
        cases=((6, 3), (10, 5), (10, 2)),
    )
    assert len(variants) == 26
    assert [sum(v.simulation == f"SIM{i}" for v in variants) for i in (1, 2, 3, 4)] == [1, 5, 5, 15]
    assert {v.task.reassign for v in variants if v.simulation != "SIM3"} == {"never"}
    assert len({(v.simulation, v.name) for v in variants}) == 26


def test_results_depend_neither_on_company_nor_on_how_many_go_together():
    variants = paper_simulations(
        JointTask(episodes=6), empirical=CoinFlips(PAPER), levels=(60,), reassign="every", cases=((6, 3),)
    )
    together = run_curves(variants, MAKE, repetitions=330, columns=2000, **RUN)
    apart = run_curves(variants, MAKE, repetitions=330, columns=100, **RUN)
    alone = [run_curves([v], MAKE, repetitions=330, columns=700, **RUN)[0] for v in variants]
    for one, two, three in zip(together, apart, alone, strict=True):
        for name in ("mean", "sd", "greedy"):
            assert getattr(one, name).tolist() == getattr(two, name).tolist() == getattr(three, name).tolist()


def test_another_seed_gives_other_draws_and_the_same_seed_the_same():
    variant = [Variant("T", "emp", JointTask(episodes=5), CoinFlips(PAPER))]
    one, two, three = (run_curves(variant, MAKE, repetitions=30, seed=s, tau=0.1)[0].mean for s in (1, 1, 2))
    assert one.tolist() == two.tolist()
    assert one.tolist() != three.tolist()


def test_sd_is_the_samples():
    task = JointTask(episodes=3)
    whole = run_curves([Variant("T", "x", task, CoinFlips(PAPER))], MAKE, repetitions=2, **RUN)[0]
    first = run_curves([Variant("T", "x", task, CoinFlips(PAPER))], MAKE, repetitions=1, **RUN)[0]
    second = 2 * whole.mean - first.mean  # a longer run begins with the shorter one
    np.testing.assert_allclose(whole.sd, np.abs(first.mean - second) / np.sqrt(2), atol=1e-7)
    assert np.isnan(first.sd).all()


def test_milestones_of_a_known_curve():
    mean = np.linspace(0.5, 0.9, 41)  # one per cent an episode
    curve = Curve(mean, np.full(41, 0.1), mean, 100)
    found = milestones.milestone(curve, 0.7)
    assert (found.earliest, found.episode, found.latest) == (20, 21, 23)
    assert milestones.milestone(curve, 0.95).episode is None
    assert milestones.minutes(35, events=10, trial_s=1.0) == pytest.approx(5.83, abs=0.01)
    assert np.isnan(milestones.minutes(None, events=10, trial_s=1.0))


def test_what_a_reassignment_costs():
    mean = np.concatenate([np.linspace(0.5, 0.9, 4), np.linspace(0.4, 0.7, 4), [0.5, 0.6]])
    found = milestones.relearned(Curve(mean, np.full(10, 0.2), mean, 100), np.array([0] * 4 + [1] * 4 + [2] * 2))
    assert found.episode.tolist() == [4, 8, 10]
    np.testing.assert_allclose(found.loss, [0, 0.2, 0.3])
    np.testing.assert_allclose(found.loss_half_width, [0, 0.0554, 0.0554], atol=1e-3)
