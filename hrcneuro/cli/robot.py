"""The command robot: the stage on the arm that is named, and how punctual it was."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Annotated

import typer

from hrcneuro.cli import completion
from hrcneuro.cli.declare import Subjects, command
from hrcneuro.cli.options import Options

if TYPE_CHECKING:
    from hrcneuro.config.settings import Settings
    from hrcneuro.pipeline.workdir import Workdir


@command(
    "Drive the arm through a session's moves.",
    "robot s01",
    "robot s01 --backend ursim --set 'robot.blocks=[1]' --timing",
    name="robot",
)
def robot(
    options: Options,
    subjects: Subjects = None,
    backend: Annotated[
        str, typer.Option(help="The arm: sim, ursim, ur or ros.", autocompletion=completion.backends)
    ] = "",
    host: Annotated[str, typer.Option(help="Address of a real arm's controller.")] = "",
    at_the_robot: Annotated[
        bool, typer.Option("--i-am-at-the-robot", help="Someone stands at its emergency stop: a real arm needs this.")
    ] = False,
    lsl: Annotated[bool, typer.Option("--lsl", help="Send a marker at every motion onset over LSL.")] = False,
    patient: Annotated[
        bool, typer.Option("--patient", help="Count packets that come late instead of stopping: ursim only.")
    ] = False,
    timing: Annotated[bool, typer.Option("--timing", help="Print how punctual the motions were.")] = False,
) -> int:
    """Bring the robot stage up to date on the arm named; return the exit code."""
    from hrcneuro.cli import bring
    from hrcneuro.pipeline.workdir import Workdir

    given = {
        "--backend": [f"robot.backend={backend}"] if backend else [],
        "--host": [f"robot.host={host}"] if host else [],
        "--patient": ["robot.patient=true"] if patient else [],
        "--lsl": ["robot.markers=lsl"] if lsl else [],
        "--i-am-at-the-robot": ["robot.at_the_robot=true"] if at_the_robot else [],
    }
    code = bring.stage("robot", options, subjects, others=given)
    if timing and code == 0 and not options.dry_run and not options.json:
        settings = bring.settings(options, others=given)
        for subject in subjects or settings.included:
            print(_timing(settings, Workdir(options.workdir), subject))
    return code


_MEANING = {
    "trigger_latency": "t = 0 to the onset of the motion (Eq 2 fitted)",
    "marker_latency": "t = 0 to the marker sent",
    "stim_latency": "t = 0 to the first sample with it",
    "cycle": "control cycle",
    "behind_log": "interval between onsets less the log's",
}


def _timing(settings: Settings, workdir: Workdir, subject: str) -> str:
    from hrcneuro.errors import DataError
    from hrcneuro.io.tables import read_table
    from hrcneuro.pipeline import asked

    table = read_table(asked.place(settings, workdir, "robot", subject, "timing.parquet"))
    names = ("mean", "sd", "median", "low", "p1", "p99", "high")
    head = "".join(f"{name:>9}" for name in ("mean", "sd", "median", "least", "1 %", "99 %", "most"))
    rows = [
        f"{subject}: timing in ms; t = 0 is the cycle of the first command that is not zero",
        f"{'':<52}{'n':>8}{head}",
    ]
    for row in table.to_dict("records"):
        # Beside the distribution of a quantity stands that of its distance from the median, or from 8 ms.
        text = _MEANING.get(row["quantity"], "  its jitter")
        figures = "".join(f"{round(row[f'{name}_ms'], 3) + 0.0:>9.3f}" for name in names)
        rows.append(f"{text:<52}{row['n']:>8}{figures}")
    # With --no-figures there may be no picture.
    with contextlib.suppress(DataError):
        rows.append(f"drawn in {asked.place(settings, workdir, 'robot', subject, 'timing.png')}")
    return "\n".join(rows)
