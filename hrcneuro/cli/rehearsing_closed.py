"""What rehearse --closed does at virtual pace: a session to calibrate on, then sessions in which the robot learns."""

from __future__ import annotations

import functools
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from hrcneuro.cli import experimenting, onlining
from hrcneuro.cli.amplifying import brain_of, kinds
from hrcneuro.config.settings import Settings
from hrcneuro.errors import HardwareError, StageInterrupted
from hrcneuro.experiment.learning import Loop
from hrcneuro.experiment.rehearsal import Lab, Rehearsal
from hrcneuro.experiment.session import Setup
from hrcneuro.io.decoders import read_decoder
from hrcneuro.live.decisions import DecisionLog

SYNTHETIC = "SYNTHETIC: EEG, person and arm were simulated by hrcneuro."


@dataclass(frozen=True)
class Session:
    """A session of closed blocks.

    Attributes:
        subject, number: Whose; which one, from 1.
        folder: With ``decisions.jsonl``, and the experiment's log in ``recordings/SUBJECT/closed``.
        moves: How many moves it had.
        late: Triggers that came too late for their sample.
    """

    subject: str
    number: int
    folder: Path
    moves: int
    late: int


def session(study: Settings, subject: str, folder: Path, decoder: Path, number: int, *, record: bool) -> Session:
    """Run a session of closed blocks at virtual pace, in a folder of its own.

    Args:
        study: With ``experiment.loop = "closed"``.
        subject: Whose.
        folder: Of all sessions.
        decoder: Folder of the decoder.
        number: Which one, from 1: each has paths, choices and EEG of its own, of the same person.
        record: It is recorded, too.

    Raises:
        HrcError: It cannot be begun, or the arm was stopped.
        StageInterrupted: A signal asked for its end.
    """
    place = folder / f"closed-{number:03d}"
    place.mkdir()
    setup = experimenting.setup_of(study, subject, place)
    setup = replace(setup, seed=setup.seed + 100_000 * number, folder=place / "recordings")
    recordings = setup.folder / subject / "recorded"
    if record:
        recordings.mkdir(parents=True)
    frozen, about = read_decoder(decoder)
    wanted = study.live["online"]
    log = DecisionLog(place)
    try:
        loop = Loop(frozen, onlining.learner_of(wanted, about), wanted, log, study.live["record"].rail_uv)
        lab = Lab(
            brain_of(study, subject, sitting=number), kinds(), study.live["record"], SYNTHETIC,
            recordings if record else None,
        )  # fmt: skip
        with threadpool_limits(1):
            rehearsal = Rehearsal(setup, lab, loop)
            seen = rehearsal.run()
    finally:
        log.close()
    if seen.interrupted:
        raise StageInterrupted(f"interrupted; {place} holds what was done of session {number}", cure="rehearse again")
    if not seen.whole:
        raise HardwareError(f"session {number} was broken off: {seen.trouble}", cure=seen.cure)
    return Session(subject, number, place, seen.n_moves, rehearsal.late)
