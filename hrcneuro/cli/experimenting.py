"""What the command experiment does: a session in real time at the experimenter's desk, or sessions at virtual pace."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from hrcneuro import interrupts
from hrcneuro.answers.words import counted
from hrcneuro.cli import bring
from hrcneuro.cli.experiment_desk import Desk
from hrcneuro.cli.options import Options
from hrcneuro.config.settings import Settings
from hrcneuro.errors import ConfigError
from hrcneuro.experiment import session
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.ports import Seen
from hrcneuro.experiment.session import Setup
from hrcneuro.pipeline.graph import check_subject

_STOPPED, _EARLY, _WANTED = 4, 1, 130
"""Exit codes of a session that is not whole: stopped by the hardware, by other trouble, ended by a person."""
_RECORDED = {
    "yes": "yes, as far as was seen from here",
    "no": "no: 'hrcneuro record' of this subject did not run on this machine",
    "lost": "lost before the end: see what 'hrcneuro record' says",
}


def run(options: Options, subjects: Sequence[str], given: Mapping[str, Sequence[str]], *, resume: bool) -> int:
    """Run the sessions of ``subjects``; return the exit code.

    Raises:
        HrcError: A session cannot be begun.
    """
    study = bring.settings(options, others=given)
    for subject in subjects:
        check_subject(study, subject)
    real = study.live["experiment"].pace == "real"
    if real and len(subjects) != 1:
        raise ConfigError(
            f"{len(subjects)} subjects, {', '.join(subjects)}, in real time; allowed: one at a time",
            cure="name one, or run all with --human simulated --pace virtual",
        )
    code, sessions, ahead = 0, [], None
    for subject in dict.fromkeys(subjects):
        setup = setup_of(study, subject, options.workdir)
        if options.dry_run:
            sessions.append(would(setup, resume))
            continue
        if real:
            seen = _real(options, study, setup, resume)
        else:
            ahead = ahead or session.looked_ahead(setup)
            seen = _virtual(setup, resume, ahead)
        sessions.append(told(setup, seen))
        code = max(code, _code(seen))
        if not options.json:
            bring.console(options).results(lines(setup, seen))
        if seen.interrupted:
            break
    if options.json:
        print(json.dumps({"command": "experiment", "ok": code == 0, "sessions": sessions}, indent=1))
    elif options.dry_run:
        for one in sessions:
            print(f"{one['subject']}: {one['blocks']} blocks, the arm {one['arm']}, {one['pace']} pace")
    return code


def setup_of(study: Settings, subject: str, workdir: Path) -> Setup:
    """Return what a subject's session is run with."""
    acquire, robot = study.sections["acquire"], study.sections["robot"]
    return Setup(
        subject,
        study.live["experiment"],
        acquire.session,
        acquire.timing,
        acquire.seed,
        replace(robot, rescue_folder=str(workdir.absolute() / robot.rescue_folder)),
        workdir.absolute() / study.live["record"].folder,
    )


def _real(options: Options, study: Settings, setup: Setup, resume: bool) -> Seen:
    from hrcneuro.experiment.real import RealTime

    declared = [key for key, one in study.live["record"].streams.items() if one.sfreq != 0.0]
    with Desk(bring.console(options), setup.n_blocks) as desk:
        desk.say(f"the session of {setup.subject} begins: the arm {setup.arm.backend} comes to its place")
        return RealTime(setup, desk, streams=declared).run(resume=resume)


def _virtual(setup: Setup, resume: bool, ahead: Ahead) -> Seen:
    from hrcneuro.experiment.virtual import Virtual

    return Virtual(setup, ahead=ahead).run(resume=resume)


def would(setup: Setup, resume: bool = False) -> dict[str, Any]:
    """Return what a session would be, for a program.

    Raises:
        ConfigError, HardwareError: It cannot be begun.
    """
    session.looked_ahead(setup)
    return {
        "subject": setup.subject,
        "blocks": setup.n_blocks,
        "arm": setup.arm.backend,
        "pace": setup.options.pace,
        "resume": resume,
    }


def _code(seen: Seen) -> int:
    if seen.whole:
        return 0
    if seen.interrupted:
        return interrupts.told()[0]
    if seen.hardware:
        return _STOPPED
    # Whether the end was asked for by a key, at the window or by Ctrl-C, is all the same.
    return _WANTED if seen.wanted else _EARLY


def told(setup: Setup, seen: Seen) -> dict[str, Any]:
    """Return how a session went, for a program."""
    return {
        "subject": setup.subject,
        "folder": str(setup.place),
        "whole": seen.whole,
        "blocks": seen.blocks_done,
        "moves": seen.n_moves,
        "keys": seen.keys[""],
        "ignored": seen.ignored,
        "markers": seen.markers,
        "stops": seen.stops,
        "late_packets": seen.health.late_packets if seen.health else 0,
        "recorded": seen.recorded,
        "loop": seen.loop,
        "taken": seen.taken,
        "left": seen.left,
        "refused": seen.refused,
        "ended": seen.ended,
        "trouble": seen.trouble,
    }


def lines(setup: Setup, seen: Seen) -> list[str]:
    """Return how a session went, for a person."""
    ignored = ", ".join(f"{why} {n}" for why, n in seen.ignored.items())
    keys = f"{counted(seen.keys[''], 'key')}" + (f" (ignored: {ignored})" if ignored else "")
    place = setup.place
    lines = [f"{setup.subject}: {counted(seen.blocks_done, 'block')}, {counted(seen.n_moves, 'move')}, {keys}"]
    if seen.stops:
        lines.append(f"  the arm was stopped {counted(seen.stops, 'time')}: {seen.trouble or 'it went on'}")
    if setup.closed:
        refused = f"; {counted(seen.refused, 'text')} of the loop's refused: see the log" if seen.refused else ""
        lines.append(
            f"  the robot took {seen.taken} of the person's steps, and left {seen.left} of its own first{refused}"
        )
    if setup.simulated:
        lines.append("  SYNTHETIC: a simulated person pressed the keys")
    if seen.recorded:
        lines.append(f"  recorded: {_RECORDED[seen.recorded]}")
    lines.append(f"  log in {place}")
    if not seen.whole:
        why = f" ({seen.ended}): the arm rests, the log is closed" if seen.wanted else f": {seen.ended or seen.trouble}"
        lines.append(f"  ended early{why}")
        lines.append(f"  'hrcneuro experiment {setup.subject} --resume' goes on at the next block")
    return lines
