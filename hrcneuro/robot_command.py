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
        # There is one arm: no two subjects at a time, and Ctrl-C reaches the loop that drives it.
        options = replace(options, executor="serial")
    code = commands.stage("robot", options, subjects)
    if timing and code == 0 and not options.dry_run and not options.json:
        for subject in subjects or settings.study.subjects:
            print(_timing(options, subject))
    return code


def _timing(options: Options, subject: str) -> str:
    from hrcneuro.io.tables import read_table
    from hrcneuro.workdir import Workdir

    table = read_table(Workdir(options.workdir).artifact("robot", subject, "timing.parquet"))
    rows = [f"{subject}: timing in ms", f"{'':<26}{'n':>8}{'mean':>9}{'sd':>9}{'median':>9}{'p99':>9}{'most':>9}"]
    for row in table.to_dict("records"):
        figures = (row[f"{name}_ms"] for name in ("mean", "sd", "median", "p99", "high"))
        rows.append(f"{row['quantity']:<26}{row['n']:>8}" + "".join(f"{v:>9.3f}" for v in figures))
    return "\n".join(rows)
