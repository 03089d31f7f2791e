"""The chapter on a closed loop: what the robot has learned, beside what coin flips give, in words and a figure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hrcneuro.analyses import loop_sessions as made
from hrcneuro.learning import loop_scores as scores
from hrcneuro.learning.loop import CASES, LoopModel, LoopSessions, simulate_loop
from hrcneuro.learning.loop_decoders import LoopDecoder, anticipation, independent
from hrcneuro.learning.loop_scores import Mean
from hrcneuro.learning.rates import PAPER, Rates
from hrcneuro.learning.simulations import Curve
from hrcneuro.report import markup

if TYPE_CHECKING:
    import pandas as pd
    from markupsafe import Markup

_SAID = (
    "A: choice accuracy after each episode (mean, 95 % interval over sessions), where the null model expects it, SIM1; "
    "B: the same after so many updates; C: the person's and the robot's directions apart (dashed: null model); D: who "
    "made whose steps; E: how often decisions were right, and said that the actor stays; F: when they came"
)

_WHY_OTHER = (
    "In SIM1 the four cases come equally often. In a session some come more often than others; where those are decided "
    "rightly more often, more is learned. SIM1 at one rate in all cases has the session's own share of right decisions."
)


@dataclass(frozen=True)
class LoopNull:
    """What coin flips give in place of what was played.

    Attributes:
        null: The null model at the rates of the sessions.
        independent: The same, decided without regard to the truth, as often for a takeover.
        sim1: In words, at whose rates -> SIM1's curve.
    """

    null: LoopSessions
    independent: LoopSessions
    sim1: Mapping[str, Curve] = field(default_factory=dict)


def null_of(
    steps: pd.DataFrame,
    episodes: pd.DataFrame,
    model: LoopModel,
    *,
    sessions: int,
    repetitions: int,
    seed: int,
    claimed: Rates | None = None,
) -> LoopNull | None:
    """Return the null model of what was played; None where nothing was decided after one of the actors' moves.

    Each subject's sessions have one at their own rates: what a loop learns is no linear function of them, and the
    decoders of subjects differ.

    Args:
        steps, episodes: As ``tables.loop`` declares them.
        model: How the sessions went; how often decisions taught, and were in time, is taken from the steps.
        sessions: How many are simulated, in equal parts of each subject.
        repetitions: Of SIM1.
        seed: Of every draw.
        claimed: The rates by which the learner weighed answers, those of the decoder's calibration; none: those that
            the sessions come out with.
    """
    played = made.loop_sessions(steps, episodes)
    rates = scores.pooled_rates(played)
    if rates is None:
        return None
    subjects = list(dict.fromkeys(episodes["subject"]))
    each = -(-sessions // len(subjects))
    flips, nothing = [], []
    for k, subject in enumerate(subjects):
        own_steps, own_episodes = steps[steps["subject"] == subject], episodes[episodes["subject"] == subject]
        like, own = made.as_measured(model, own_steps), made.loop_sessions(own_steps, own_episodes)
        if (right := _right(own, claimed)) is None:
            continue
        flips.append(simulate_loop(like, right, sessions=each, seed=seed, first=k * each))
        nothing.append(simulate_loop(like, _independent(own, claimed), sessions=each, seed=seed, first=k * each))
    if not flips:
        return None
    count = played.policies.shape[1]
    return LoopNull(
        LoopSessions.joined(flips),
        LoopSessions.joined(nothing),
        {
            name: scores.sim1(r, model.kind, episodes=count, repetitions=repetitions, seed=seed, tau=model.tau)
            for name, r in (
                ("at these rates", rates),
                ("at one rate in all cases", scores.level_rates(played)),
                ("at the paper's", PAPER),
            )
        }
        if model.floor == 0
        else {},
    )


def _right(played: LoopSessions, claimed: Rates | None) -> LoopDecoder | None:
    rates = scores.pooled_rates(played)
    if rates is None:
        return None
    return anticipation(rates) if claimed is None else replace(anticipation(rates), claimed=claimed)


def _independent(played: LoopSessions, claimed: Rates | None) -> LoopDecoder:
    after_human, after_robot = scores.pooled_takeovers(played)
    return independent(after_human=after_human, after_robot=after_robot, claimed=claimed)


def chapter(
    steps: pd.DataFrame,
    episodes: pd.DataFrame,
    null: LoopNull | None,
    *,
    picture: Path,
    deadline_s: float,
    mode: str,
    remark: str = "",
) -> Markup:
    """Return the chapter, and draw its figure.

    Args:
        steps, episodes: As ``tables.loop`` declares them.
        null: As :func:`null_of` returns it; without it, what was played stands alone.
        picture: Where the figure is written, a PNG, with a PDF beside it; the page that holds the chapter lies there.
        deadline_s: A decision that is sent later teaches nothing.
        mode: ``shadow``, ``semi`` or ``closed``.
        remark: What stands above all, such as that the session is synthetic.
    """
    from hrcneuro.figures.loop import LoopPicture, loop

    played = made.loop_sessions(steps, episodes)
    stages = dict(zip(made.STAGES.values(), made.latencies(steps).values(), strict=True))
    expected = None if null is None else null.null
    beside = {} if null is None else vars(null)
    loop(LoopPicture(played, stages=stages, deadline_ms=1e3 * deadline_s, note=remark, **beside), picture)
    return markup.render(
        "loop.html",
        remark=remark,
        what=_what(played, mode),
        learned=_learned(played, null),
        picture=picture.name,
        said=_SAID,
        decisions=_decisions(played, expected),
        answered=_answered(played),
        acted=_acted(played, expected),
        in_time=_in_time(steps, deadline_s),
    )


def _what(played: LoopSessions, mode: str) -> str:
    n, episodes = played.policies.shape[:2]
    updates = played.updates[:, -1]
    acted = {
        "closed": "it acts by all that it has learned",
        "semi": "it acts by what it had learned before the block",
        "shadow": "each makes the own steps, and the learner looks on",
    }[mode]
    each = "session" if n == 1 else "sessions"
    return (
        f"{n} {each} of up to {episodes} episodes; mode {mode}: {acted}. {updates.mean():.0f} decisions taught in a "
        f"session. ± is half a 95 % interval over sessions."
    )


def _learned(played: LoopSessions, null: LoopNull | None) -> list[str]:
    last = played.policies.shape[1]
    lines = []
    for rows, text in (("all", "all four directions"), ("human", "the person's two"), ("robot", "the robot's two")):
        here = _last(scores.mean_over_sessions(scores.accuracy(played, rows)))
        line = f"Choice accuracy after episode {last}, {text}: {_number(here)}."
        if null is not None:
            expected = _last(scores.expected_mean(scores.accuracy(null.null, rows), played.n_sessions))
            nothing = _last(scores.mean_over_sessions(scores.accuracy(null.independent, rows)))
            line += (
                f" The null model at the sessions' rates expects {_span(expected)}{_verdict(here, expected)}; "
                f"decisions that do not depend on the truth {_number(nothing)}."
            )
        lines.append(line)
    if null is None:
        return [
            *lines,
            "No null model: after the moves of one of the two nothing was decided, so that its rates are not known.",
        ]
    for name, curve in null.sim1.items():
        taken = int(played.updates[:, -1].mean())
        same = float(np.interp(taken, np.append(0, scores.sim1_updates(len(curve.mean))), np.append(0.5, curve.mean)))
        lines.append(
            f"SIM1 {name}: {curve.mean[-1]:.3f} after as many episodes, {same:.3f} after as many updates ({taken})."
        )
    if null.sim1:
        lines.append(_WHY_OTHER)
    return lines


def _decisions(played: LoopSessions, null: LoopSessions | None) -> markup.PageTable:
    rates = scores.rates_by_case(played)
    given = None if null is None else scores.rates_by_case(null)
    counts = played.decisions.sum(axis=(0, 2))
    rows = [
        (
            case,
            "TNR" if case[0] == case[1] else "TPR",
            f"{int(counts[k]):,}",
            _percent(rates.mean[k], rates.half_width[k]),
            "none" if given is None else _percent(given.mean[k], given.half_width[k]),
        )
        for k, case in enumerate(CASES)
    ]
    head = ("tr−1, then whom the person expects", "rate", "decisions that taught", "right, %", "null model, %")
    return markup.PageTable(head, rows)


def _answered(played: LoopSessions) -> list[str]:
    said, true = scores.continuing(played), scores.staying(played)
    return [
        f"After a {who} move {_percent(said.mean[k], said.half_width[k])} % of the decisions said that the actor "
        f"stays; the person expected it in {_percent(true.mean[k], true.half_width[k])} %."
        for k, who in enumerate(("robot's", "person's"))
    ] + [
        "A decoder that merely says that the actor stays seems to learn where each makes the own steps; in the loop "
        "it teaches the robot to take the person's as well (docs/confound.md)."
    ]


def _acted(played: LoopSessions, null: LoopSessions | None) -> list[str]:
    lines = []
    for kind, of, text in (
        ("taken", ("human", "taken"), "of the person's steps the robot took"),
        ("left", ("robot", "left"), "of its own the robot left lying, and made them later"),
    ):
        line = f"{_share(scores.step_share(played, kind, of))} % {text}"
        lines.append(line + ("." if null is None else f" (null model: {_share(scores.step_share(null, kind, of))} %)."))
    diagonal = scores.shares(played).mean[-1]
    return [*lines, f"{100 * diagonal:.1f} % of all steps were diagonal, after a wrong key: they are the robot's."]


def _in_time(steps: pd.DataFrame, deadline_s: float) -> list[str]:
    counted, why = made.deadlines(steps), made.causes(steps)
    texts = {
        "decided": "moves with a step after them were decided",
        "deadline_met": f"decisions came within {1e3 * deadline_s:.0f} ms of the onset",
        "in_time_for_tr": "decisions were taken up before keys opened for the step that they are about",
        "update": "decisions taught",
    }
    lines = [
        f"{n:,} of {of:,} {texts[name]}{f' ({100 * n / of:.1f} %)' if of else ''}." for name, (n, of) in counted.items()
    ]
    if why:
        lines.append("Taught nothing: " + ", ".join(f"{name} {n:,}" for name, n in why.items()) + ".")
    for name, times in made.latencies(steps).items():
        if len(times):
            middle, late = np.percentile(times, [50, 99])
            lines.append(
                f"Onset to {made.STAGES[name]}: median {middle:.1f}, 99 % {late:.1f}, most {times.max():.1f} ms."
            )
    return lines


def _last(curve: Mean) -> tuple[float, float]:
    return float(curve.mean[-1]), float(curve.half_width[-1])


def _number(value: tuple[float, float]) -> str:
    mean, half = value
    return f"{mean:.3f}" if np.isnan(half) else f"{mean:.3f} ± {half:.3f}"


def _span(value: tuple[float, float]) -> str:
    mean, half = value
    return f"{mean:.3f} ({max(mean - half, 0):.3f} to {min(mean + half, 1):.3f} in 95 of 100 cases)"


def _verdict(here: tuple[float, float], expected: tuple[float, float]) -> str:
    beyond = here[0] - expected[0]
    if np.isnan(beyond) or abs(beyond) <= expected[1]:
        return ""
    return f", so that this is {'more' if beyond > 0 else 'less'} than the null model explains"


def _share(value: Mean) -> str:
    return _percent(float(value.mean), float(value.half_width))


def _percent(mean: float, half: float) -> str:
    if np.isnan(mean):
        return "none"
    return f"{100 * mean:.1f}" if np.isnan(half) else f"{100 * mean:.1f} ± {100 * half:.1f}"
