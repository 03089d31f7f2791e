"""What ``hrcneuro robot`` does beyond a plain stage: options for a real arm, and the timing report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hrcneuro import commands
from hrcneuro.options import Options


def robot(
    options: Options,
    subjects: Sequence[str] | None,
    *,
    backend: str,
    host: str,
    at_the_robot: bool,
    lsl: bool,
    timing: bool,
) -> int:
    """Bring the robot stage up to date on the arm named; return the exit code."""
    given = list(options.set or ())
    given += [f"robot.backend={backend}"] if backend else []
    given += [f"robot.host={host}"] if host else []
    given += ["robot.markers=lsl"] if lsl else []
    given += ["robot.at_the_robot=true"] if at_the_robot else []
    options = replace(options, set=given)
    settings = commands.settings(options)
    if settings.sections["robot"].backend != "sim":
        # In real time no two subjects at once, and Ctrl-C must reach the loop that drives the arm.
        options = replace(options, executor="serial")
    code = commands.stage("robot", options, subjects)
    if timing and code == 0 and not options.dry_run and not options.json:
        for subject in subjects or settings.included:
            print(_timing(options, subject))
    return code


_MEANING = {
    "trigger_latency": "t = 0 to the onset of the motion (Eq 2 fitted)",
    "marker_latency": "t = 0 to the marker sent",
    "stim_latency": "t = 0 to the first sample with it",
    "cycle": "control cycle",
    "behind_log": "interval between onsets less the log's",
}


def _timing(options: Options, subject: str) -> str:
    from hrcneuro.io.tables import read_table
    from hrcneuro.workdir import Workdir

    place = Workdir(options.workdir).artifact("robot", subject, "timing.parquet")
    names = ("mean", "sd", "median", "low", "p1", "p99", "high")
    head = "".join(f"{name:>9}" for name in ("mean", "sd", "median", "least", "1 %", "99 %", "most"))
    rows = [
        f"{subject}: timing in ms; t = 0 is the cycle of the first command that is not zero",
        f"{'':<52}{'n':>8}{head}",
    ]
    for row in read_table(place).to_dict("records"):
        # Beside the distribution of a quantity stands that of its distance from the median, or from 8 ms.
        text = _MEANING.get(row["quantity"], "  its jitter")
        figures = "".join(f"{round(row[f'{name}_ms'], 3) + 0.0:>9.3f}" for name in names)
        rows.append(f"{text:<52}{row['n']:>8}{figures}")
    return "\n".join([*rows, f"drawn in {place.with_name('timing.png')}"])
