"""The pictures of simulate: Fig 4, learners compared, what errors teach, the design sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hrcneuro.contract import EVIDENCE, SWEEP, Caption, Drawing, Drawings, Inputs, Of, Read

# Axes of a sweep whose usual value is that of an option.
_USUAL = ("events", "subtasks", "chosen", "alpha", "tau")


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw Fig 4 from the curves and what is said of them, and the rest as far as it was computed."""
    from hrcneuro.figures import learners, simulate
    from hrcneuro.io.tables import read_table

    def table(name: str) -> Any:
        return read_table(files.path("simulate", f"{name}.parquet"))

    fig4 = (table(name) for name in ("curves", "analytic", "milestones", "relearning"))
    simulate.fig4(*fig4, path=out / "fig4.png")
    if files.has("simulate", "learners.parquet"):
        learners.draw(table("learners"), table("learner_curves"), out / "learners.png")
    if files.has("simulate", "confound.parquet"):
        simulate.error_readers(table("confound"), out / "confound.png")


def draw_sweep(config: Any, files: Inputs, out: Path) -> None:
    """Draw the design sweep: one axis as curves, several as contours."""
    from hrcneuro.figures import sweep
    from hrcneuro.io.tables import read_table

    options = config.simulate
    usual = {axis: getattr(options, axis) for axis in _USUAL} | {"period": 0}
    sweep.draw(
        read_table(files.path("simulate", "sweep.parquet")),
        read_table(files.path("simulate", "needed.parquet")),
        usual,
        options.sweep,
        episodes=options.episodes,
        learner=options.sweep_learner,
        path=out / "sweep.png",
    )


def draw_evidence(config: Any, files: Inputs, out: Path) -> None:
    """Draw the sessions of people beside what was foretold of them."""
    from hrcneuro.figures import evidence
    from hrcneuro.io.tables import read_table

    names = ("sessions", "guesses", "predicted", "design")
    tables = {name: read_table(files.path("simulate", f"{name}.parquet")) for name in names}
    evidence.draw(**tables, path=out / "evidence.png")


DRAWINGS = Drawings(
    name="simulate",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    group=Drawing(
        captions={
            "fig4.png": Caption(
                "Fig 4: choice accuracy of the simulated robot (mean, 95 % Monte-Carlo band): A empirical "
                "decoder, B better and worse decoders, C tasks reassigned, D more subtasks",
                "Fig 4",
            ),
            "learners.png": Caption(
                "Other learners on the same draws: curves, and paired differences from Eq 3–6 with 95 % intervals (n: "
                "subtasks, m: those of them that are the human's)",
                "Learners compared",
            ),
            "confound.png": Caption(
                "Learning when the decoder answers to errors: the same rates, other tasks", "Learning from errors"
            ),
        },
        reads=(Read("simulate", ("*.parquet",), Of.GROUP),),
        options=(),
        draw=draw,
    ),
    sides={
        SWEEP: Drawing(
            captions={
                "sweep.png": Caption(
                    "How good must a decoder be? Learning over the values swept, with 95 % Monte-Carlo bands where one "
                    "axis varies, and minutes until 80 % of the choices are right",
                    "Design sweep",
                ),
            },
            reads=(Read("simulate", ("*.parquet",)),),
            options=tuple(f"simulate.{name}" for name in (*_USUAL, "episodes", "sweep", "sweep_learner")),
            draw=draw_sweep,
        ),
        EVIDENCE: Drawing(
            captions={
                "evidence.png": Caption(
                    "A closed loop with people (Ehrlich & Cheng 2018): right guesses in the last ten of 50 trials by "
                    "the online decoder's accuracy (a point a session, moved sideways where it would cover another; "
                    "means with 95 % intervals over people, where there are 5 and more) beside "
                    "what was foretold, as a session goes on, and foretold against seen",
                    "Evidence",
                ),
            },
            reads=(Read("simulate", ("*.parquet",)),),
            options=(),
            draw=draw_evidence,
        ),
    },
)
