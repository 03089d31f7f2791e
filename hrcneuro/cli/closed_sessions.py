"""Sessions of closed blocks at virtual pace: one, or many side by side, and what their logs tell."""

from __future__ import annotations

import concurrent.futures as futures
import multiprocessing
import os
import signal
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.answers.words import counted
from hrcneuro.cli.console import Console
from hrcneuro.cli.options import Options
from hrcneuro.config.settings import Settings
from hrcneuro.errors import HardwareError, StageInterrupted

if TYPE_CHECKING:
    import pandas as pd

    from hrcneuro.decoding.frozen import FrozenDecoder
    from hrcneuro.experiment.ahead import Ahead

_SEEDS = 100_000  # apart from each other: those of a study's subjects lie close together


@dataclass(frozen=True)
class Job:
    """A session that is to be run.

    Attributes:
        options, given: Of the call: what its process makes the configuration of.
        subject: Whose.
        folder: Of all sessions.
        decoder: Folder of the decoder.
        number: Which one, from 1: each has paths, choices, habits at the keys and EEG of its own; the sources of that
            EEG, and the decoder, are the same.
        record: It is recorded, too.
    """

    options: Options
    given: Mapping[str, Sequence[str]]
    subject: str
    folder: Path
    decoder: Path
    number: int
    record: bool


@dataclass(frozen=True)
class Place:
    """Where a session's logs lie.

    Attributes:
        number: Which session.
        experiment, decisions: Its logs.
        recorded: The folder of its recording; none: it was not recorded.
        late: Triggers that came too late for their sample.
    """

    number: int
    experiment: Path
    decisions: Path
    recorded: Path | None = None
    late: int = 0


def all_of(jobs: Sequence[Job], talk: Console, workers: int | None, ahead: Ahead) -> list[Place]:
    """Run sessions, several at once; return where their logs lie, in their order.

    Args:
        jobs: The sessions.
        talk: Is told how far they are.
        workers: How many processes; None means one for each core.
        ahead: What checks each request to the arm, for sessions in this process; others make their own.

    Raises:
        HrcError: One cannot be begun, or was stopped; others that run by then are ended.
    """
    workers = min(workers or os.cpu_count() or 1, len(jobs))
    if workers <= 1:
        return [_run_and_tell(job, len(jobs), talk, ahead) for job in jobs]
    with futures.ProcessPoolExecutor(
        workers, mp_context=multiprocessing.get_context("spawn"), initializer=_deaf
    ) as pool:
        waiting = [pool.submit(run, job) for job in jobs]
        try:
            for done, _ in enumerate(futures.as_completed(waiting), start=1):
                talk.say(f"{done} of {len(jobs)} closed sessions")
            return [one.result() for one in waiting]
        except BaseException:
            for one in waiting:
                one.cancel()
            for process in list(pool._processes.values()):
                process.terminate()
            raise


def _run_and_tell(job: Job, of: int, talk: Console, ahead: Ahead) -> Place:
    place = run(job, ahead)
    talk.say(f"{job.number} of {of} closed sessions")
    return place


def _deaf() -> None:
    # Ctrl-C reaches all processes of a terminal: the first of them ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run(job: Job, ahead: Ahead | None = None) -> Place:
    """Run a session in a folder of its own; without ``ahead`` what checks requests to the arm is made for it.

    Raises:
        HrcError: It cannot be begun, or the arm was stopped.
        StageInterrupted: A signal asked for its end.
    """
    from threadpoolctl import threadpool_limits

    from hrcneuro.cli import bring, experimenting, onlining
    from hrcneuro.cli.amplifying import brain_of, kinds
    from hrcneuro.cli.rehearsing import SYNTHETIC
    from hrcneuro.experiment.learning import Loop
    from hrcneuro.experiment.rehearsal import Lab, Rehearsal
    from hrcneuro.io.decoders import read_decoder
    from hrcneuro.live.decisions import FILE, DecisionLog

    study = bring.settings(job.options, others=job.given)
    place = job.folder / f"closed-{job.number:03d}"
    place.mkdir()
    setup = experimenting.setup_of(study, job.subject, place)
    setup = replace(setup, seed=setup.seed + _SEEDS * job.number, folder=place / "recordings")
    recorded = setup.folder / job.subject / "recorded" if job.record else None
    if recorded is not None:
        recorded.mkdir(parents=True)
    frozen, about = read_decoder(job.decoder)
    wanted, record = study.live["online"], study.live["record"]
    log = DecisionLog(place)
    try:
        loop = Loop(frozen, onlining.learner_of(wanted, about), wanted, log, record.rail_uv)
        lab = Lab(brain_of(study, job.subject, sitting=job.number), kinds(), record, SYNTHETIC, recorded)
        with threadpool_limits(1):
            rehearsal = Rehearsal(setup, lab, loop, ahead=ahead)
            seen = rehearsal.run()
    finally:
        log.close()
    if seen.interrupted:
        raise StageInterrupted(f"interrupted in session {job.number}; {place} holds what was done", cure="begin again")
    if not seen.whole:
        raise HardwareError(f"session {job.number} was broken off: {seen.trouble}", cure=seen.cure)
    return Place(job.number, setup.place / "experiment.jsonl", place / FILE, recorded, rehearsal.late)


def tables(subject: str, places: Sequence[Place]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the steps and the episodes of sessions, as ``tables.loop`` declares them."""
    import pandas as pd

    from hrcneuro.analyses.loop_rows import loop_tables
    from hrcneuro.live.decisions import lines
    from hrcneuro.sources.experiments import read

    pairs = [
        loop_tables(read(one.experiment)[0], lines(one.decisions), subject=subject, session=f"{one.number:03d}")
        for one in places
    ]
    return pd.concat([one for one, _ in pairs]), pd.concat([one for _, one in pairs])


def replayed(
    study: Settings, subject: str, decoder: FrozenDecoder, about: Mapping[str, Any], place: Place
) -> dict[str, int]:
    """Return how many decisions come out of the recording as they did live, to the last bit, and how many other.

    ``decoder`` and ``about`` are as :func:`~hrcneuro.io.decoders.read_decoder` has them.
    """
    from hrcneuro.cli import onlining
    from hrcneuro.live import decisions, replaying

    assert place.recorded is not None
    wanted = study.live["online"]
    known = decisions.known(place.decisions)
    _, lines = onlining.replayed(
        replaying.read(place.recorded, wanted), decoder, about, wanted, subject=subject, chunk=40, known=known,
        rail_uv=study.live["record"].rail_uv,
    )  # fmt: skip
    return onlining.compared(lines, known)


def numbers(steps: pd.DataFrame, episodes: pd.DataFrame) -> dict[str, Any]:
    """Return what came of sessions, for a program."""
    from hrcneuro.analyses.loop_sessions import loop_sessions
    from hrcneuro.learning import loop_scores as scores

    played = loop_sessions(steps, episodes)
    accuracy = {rows: scores.mean_over_sessions(scores.accuracy(played, rows)) for rows in ("all", "human", "robot")}
    return {
        "episodes": int(played.policies.shape[1]),
        "updates": float(played.updates[:, -1].mean()),
        "accuracy": {
            rows: {"mean": float(one.mean[-1]), "half_width": float(one.half_width[-1])}
            for rows, one in accuracy.items()
        },
        "steps": {name: int(n) for name, n in Counter(_kinds(steps)).items()},
        "causes": {str(name): int(n) for name, n in steps["cause"].value_counts().items()},
        "decided": int(steps["predicted"].notna().sum()),
        "in_time": int(steps["deadline_met"].fillna(False).astype(bool).sum()),
        "in_time_for_tr": int(steps["in_time_for_tr"].fillna(False).astype(bool).sum()),
    }


def _kinds(steps: pd.DataFrame) -> list[str]:
    taken, left = steps["taken"].astype(bool), steps["left"].astype(bool)
    return [
        "taken from the person" if t else "left lying" if one else f"by the {actor}"
        for t, one, actor in zip(taken, left, steps["actor"], strict=True)
    ]


def lines(subject: str, about: Mapping[str, Any]) -> list[str]:
    """Return the same for a person."""
    done = ", ".join(f"{name} {n}" for name, n in about["steps"].items())
    text = [
        f"{subject}: {counted(about['sessions'], 'closed session')} of {about['episodes']} episodes, "
        f"{about['updates']:.0f} decisions taught in each",
        *(
            f"  choice accuracy at the end, {of}: {100 * one['mean']:.1f}"
            + (f" ± {100 * one['half_width']:.1f} %" if one["half_width"] == one["half_width"] else " %")
            for of, one in (
                ("all directions", about["accuracy"]["all"]),
                ("the person's", about["accuracy"]["human"]),
                ("the robot's", about["accuracy"]["robot"]),
            )
        ),
        f"  steps: {done}",
        f"  {about['decided']} decisions, {about['in_time']} before the deadline, "
        f"{about['in_time_for_tr']} before keys opened",
    ]
    again = [
        f"  replay of the recording: {one['equal']} scores as live, {one['different']} other" for one in about["replay"]
    ]
    return [*text, *again, "  SYNTHETIC: EEG, person and arm were simulated by hrcneuro"]


def told(places: Sequence[Place], steps: pd.DataFrame, again: Sequence[Mapping[str, int]]) -> list[str]:
    """Return what the page says of the sessions themselves."""
    late = sum(one.late for one in places)
    said = [f"{counted(len(places), 'session')}, {counted(len(steps), 'step')}."]
    if late:
        said.append(f"{counted(late, 'trigger')} came too late for their sample.")
    return said + [
        f"Replay of the recording: {one['equal']} scores equal to the last bit, {one['different']} different, "
        f"{one['undecided']} without one live, {one['unrecorded']} before what the recording can tell, "
        f"{one['unknown']} not in the log."
        for one in again
    ]
