"""The tables of the stage simulate: curves, their milestones, learners compared, the confound, the sweep."""

from __future__ import annotations

from hrcneuro.io.tables import Column, Table

_SIMULATION = Column("category", "", "SIM1 ... SIM4 of paper 3.2")
_VARIANT = Column("category", "", "emp (empirical decoder) or per cent correct; in SIM4 n/m before it")
_TASK = {
    "subtasks": Column("int", "", "n"),
    "chosen": Column("int", "", "m, the human's"),
    "reassign": Column("category", "", "tasks change: never, once, or every so many episodes"),
    "period": Column("int", "", "episodes between reassignments, where there are any"),
}
CURVES = Table(
    1,
    "one row a curve and episode",
    {
        "simulation": _SIMULATION,
        "variant": _VARIANT,
        "episode": Column("int", "", "episodes learned so far, from 1"),
        "mean": Column("float", "", "choice accuracy: mean over subtasks of pi(correct action), then over repetitions"),
        "sd": Column("float", "", "its SD over repetitions"),
        "n": Column("int", "", "repetitions"),
        "half_width": Column("float", "", "half the width of the mean's 95 % Monte-Carlo band"),
        **_TASK,
    },
)
MILESTONES = Table(
    1,
    "one row a curve, level and duration of a trial",
    {
        "simulation": _SIMULATION,
        "variant": _VARIANT,
        "level": Column("float", "", "choice accuracy to reach"),
        "trial_s": Column("float", "s", "duration of a trial"),
        "episode": Column("float", "", "first episode whose mean reaches the level, missing where none does"),
        "earliest": Column("float", "", "the same for the upper edge of the 95 % Monte-Carlo band"),
        "latest": Column("float", "", "the same for the lower edge"),
        "minutes": Column("float", "min", "time until then"),
        "printed_episode": Column("float", "", "the paper's figure"),
        "printed_minutes": Column("float", "min", "the paper's figure; it says 2 s a trial, which fits 1 s"),
    },
)
RELEARNING = Table(
    1,
    "one row a SIM3 curve and assignment",
    {
        "variant": _VARIANT,
        "assignment": Column("int", "", "1 for the first tasks, 2 after the first reassignment, ..."),
        "episode": Column("int", "", "the assignment's last episode"),
        "mean": Column("float", "", "choice accuracy there"),
        "half_width": Column("float", "", "half the width of its 95 % band"),
        "loss": Column("float", "", "accuracy at the end of the first assignment minus accuracy here"),
        "loss_half_width": Column("float", "", "half the width of the loss's 95 % band"),
    },
)
ANALYTIC = Table(
    1,
    "one row a curve without reassignment and episode",
    {
        "simulation": _SIMULATION,
        "variant": _VARIANT,
        "episode": CURVES.columns["episode"],
        "expected": Column("float", "", "choice accuracy expected from drift and variance alone"),
        "difference": Column("float", "", "Monte-Carlo mean minus expected"),
        "half_width": Column("float", "", "half the width of the Monte-Carlo mean's 95 % band"),
    },
)
LEARNERS = Table(
    1,
    "one row a curve, learner and measure; learners of a curve hear the same draws",
    {
        "simulation": _SIMULATION,
        "variant": _VARIANT,
        "learner": Column("category", "", "name of the learner; paper is Eq 3-6"),
        "measure": Column("category", "", "mean over all episodes, or an episode"),
        "value": Column("float", "", "choice accuracy, mean over repetitions"),
        "greedy": Column("float", "", "share of subtasks whose better-valued action is correct"),
        "difference": Column("float", "", "value minus the paper's learner's, paired"),
        "half_width": Column("float", "", "half the width of the difference's 95 % interval"),
        "behind_best": Column("float", "", "value minus the best learner's of this curve and measure, paired"),
        "behind_half_width": Column("float", "", "half the width of its 95 % interval"),
        "n": Column("int", "", "repetitions"),
        **_TASK,
    },
)
LEARNER_CURVES = Table(
    1,
    "one row a curve, learner and episode",
    {
        "simulation": _SIMULATION,
        "variant": _VARIANT,
        "learner": Column("category", "", "name of the learner; paper is Eq 3-6"),
        "episode": CURVES.columns["episode"],
        "mean": Column("float", "", "choice accuracy, mean over repetitions"),
    },
)
CONFOUND = Table(
    1,
    "one row a decoder and episode; n = 4, m = 2 unless configured",
    {
        "variant": Column("category", "", "what the decoder answers to, and in what task"),
        **{name: CURVES.columns[name] for name in ("episode", "mean", "sd", "n", "half_width", *_TASK)},
    },
)
SWEEP = Table(
    2,
    "one row a cell of the grid",
    {
        "events": Column("int", "", "events in an episode"),
        "subtasks": Column("int", "", "n"),
        "chosen": Column("int", "", "m, the human's"),
        "period": Column("int", "", "episodes between reassignments, 0 for none"),
        "accuracy": Column("float", "%", "correct decisions, the same in all four situations"),
        "alpha": Column("float", "", "learning rate"),
        "tau": Column("float", "", "temperature"),
        "episode": Column("float", "", "first episode with 80 % choice accuracy, missing where none"),
        "expected_episode": Column("float", "", "the same of the analytic expectation, where there is one"),
        "trials": Column("float", "", "trials until then (episode x events)"),
        "minutes_1s": Column("float", "min", "time until then at 1 s a trial"),
        "minutes_2s": Column("float", "min", "time until then at 2 s a trial"),
        "final": Column("float", "", "choice accuracy after the last episode"),
        "final_half_width": Column("float", "", "half the width of its 95 % band"),
        "in_time_1s": Column("float", "", "choice accuracy after the last episode within 10 min at 1 s a trial"),
        "in_time_1s_half_width": Column("float", "", "half the width of its 95 % band"),
        "in_time_2s": Column("float", "", "the same at 2 s a trial"),
        "in_time_2s_half_width": Column("float", "", "half the width of its 95 % band"),
    },
)
NEEDED = Table(
    1,
    "one row a cell of the grid without its accuracy, and duration of a trial",
    {
        **{name: SWEEP.columns[name] for name in ("events", "subtasks", "chosen", "period", "alpha", "tau")},
        "trial_s": Column("float", "s", "duration of a trial"),
        "episode": Column("int", "", "by which 80 % are asked for: the last within 10 min; of all where tasks change"),
        "accuracy": Column("float", "%", "smallest accuracy that is enough, missing where none that was swept is"),
        "low": Column("float", "%", "lower edge of its 95 % Monte-Carlo band, inside what was swept"),
        "high": Column("float", "%", "upper edge, missing where it lies above what was swept"),
        "below": Column("float", "%", "swept value just below, missing where the smallest is enough"),
        "above": Column("float", "%", "swept value just above, missing where none is enough"),
    },
)
