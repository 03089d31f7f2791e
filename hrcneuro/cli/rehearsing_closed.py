"""What rehearse --closed does: a session to calibrate on, then sessions of closed blocks, and a page on both."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.answers.words import counted
from hrcneuro.cli import bring, closed_sessions, experimenting, rehearsing, results
from hrcneuro.cli.closed_sessions import Place
from hrcneuro.cli.options import Options
from hrcneuro.config.settings import Settings
from hrcneuro.errors import ConfigError, HardwareError
from hrcneuro.experiment import session
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.io.decoders import ABOUT, read_decoder
from hrcneuro.io.places import check_room, new_folder
from hrcneuro.live.part import newest
from hrcneuro.pipeline import graph
from hrcneuro.pipeline.workdir import Workdir

if TYPE_CHECKING:
    import pandas as pd

PICTURE, STEPS, EPISODES = "loop.png", "loop_steps.parquet", "loop_episodes.parquet"
_NULL_SESSIONS, _SIM1_REPETITIONS = 300, 1000
_BYTES_A_SESSION = 3_000_000


@dataclass(frozen=True)
class Wish:
    """What is asked for.

    Attributes:
        pace: ``virtual`` or ``real``.
        mode: ``shadow``, ``semi`` or ``closed``.
        sessions: How many, at virtual pace.
        decoder: Folder of a decoder; none: a session is rehearsed to calibrate on.
        screen: At real pace, open the person's window.
        patient: At real pace, bear packets that come late.
    """

    pace: str
    mode: str
    sessions: int
    decoder: Path | None
    screen: bool
    patient: bool


def run(options: Options, subject: str, wish: Wish) -> int:
    """Rehearse; return the exit code.

    Raises:
        HrcError: A session cannot be begun, or was stopped.
    """
    if wish.pace == "real" and wish.sessions != 1:
        raise ConfigError(
            f"--sessions {wish.sessions} at real pace; allowed: 1, of one block", cure="leave it out, or --pace virtual"
        )
    given = rehearsing.given_at(wish.pace, screen=wish.screen, patient=wish.patient)
    closed = given | {"--closed": _closed(wish)}
    study = bring.settings(options, others=closed)
    graph.check_subject(study, subject)
    ahead = session.looked_ahead(experimenting.setup_of(study, subject, options.workdir))
    parent = rehearsing.parent(options, subject)
    if options.dry_run:
        first = "" if wish.decoder else "a session to calibrate on, then "
        print(f"{subject}: {first}{counted(wish.sessions, 'closed session')} at {wish.pace} pace in {parent}")
        return 0
    room = rehearsing.ROOM + wish.sessions * _BYTES_A_SESSION
    check_room(
        parent, room, what="a rehearsal", then="nothing was begun", cure="free space, or rehearse elsewhere: --workdir"
    )
    folder = new_folder(parent)
    bring.console(options).say(f"rehearsing closed blocks of {subject} at {wish.pace} pace in {folder}")
    recorded_in = rehearsing.placed(study, folder)
    closed |= recorded_in
    opened = rehearsing.given_at("virtual", screen=False, patient=False) | recorded_in
    decoder = wish.decoder.absolute() if wish.decoder else _calibrated(options, subject, folder, opened, ahead)
    if wish.pace == "virtual":
        numbers = range(1, wish.sessions + 1)
        jobs = [closed_sessions.Job(options, closed, subject, folder, decoder, n, wish.sessions == 1) for n in numbers]
        places = closed_sessions.all_of(jobs, bring.console(options), options.jobs, ahead)
    else:
        places = [_real(options, subject, folder, closed, decoder, ahead)]
    return _told(options, study, subject, folder, decoder, places)


def _closed(wish: Wish) -> list[str]:
    one = ["experiment.closed.blocks=1"] if wish.pace == "real" else []
    return ["experiment.loop=closed", "experiment.loop_wait_s=60", f"online.mode={wish.mode}", *one]


def _calibrated(options: Options, subject: str, folder: Path, given: Mapping[str, Sequence[str]], ahead: Ahead) -> Path:
    """Rehearse a session as the study has it, calibrate on it, and return the decoder's folder."""
    study = bring.settings(options, others=given)
    talk = bring.console(options)
    talk.say("a session of the study, to calibrate on …")
    seen = rehearsing.virtual(study, subject, folder, ahead)
    if not seen.whole:
        raise rehearsing.broken_off(seen, folder)
    where = replace(options, workdir=folder, set=[*(options.set or ()), *rehearsing.analysed(subject, folder)])
    study = bring.settings(where)
    with bring.logged("rehearse", where, study) as log:
        items = bring.bring(where, study, graph.targets(study, ["calibrate"], [subject]), log)
        code = talk.failures(items)
        log.end(items, code)
    if code:
        raise HardwareError(
            "there is no decoder: calibrate failed, see above", cure=f"mend what it says; the session is in {folder}"
        )
    return Workdir(folder).artifact("calibrate", subject, ABOUT).parent


def _real(
    options: Options, subject: str, folder: Path, given: Mapping[str, Sequence[str]], decoder: Path, ahead: Ahead
) -> Place:
    """Run one closed block beside amplifier, recorder and loop."""
    from hrcneuro.cli.rehearsing_real import real

    study = bring.settings(options, others=given)
    seen = real(options, study, subject, folder, given, ahead, decoder=decoder)
    if not seen.whole:
        raise rehearsing.broken_off(seen, folder)
    setup = experimenting.setup_of(study, subject, folder)
    recordings = setup.folder / subject
    logs = sorted(recordings.glob("*-online/decisions.jsonl"))
    return Place(1, setup.place / "experiment.jsonl", logs[-1], newest(recordings))


def _told(options: Options, study: Settings, subject: str, folder: Path, decoder: Path, places: Sequence[Place]) -> int:
    """Tell what came of it all; return the exit code."""
    from hrcneuro.cli.onlining import as_live
    from hrcneuro.io.tables import write_table
    from hrcneuro.tables.loop import LOOP_EPISODES, LOOP_STEPS

    steps, episodes = closed_sessions.tables(subject, places)
    write_table(steps, folder / STEPS, LOOP_STEPS)
    write_table(episodes, folder / EPISODES, LOOP_EPISODES)
    frozen, known = read_decoder(decoder)
    replayed = [closed_sessions.replayed(study, subject, frozen, known, place) for place in places if place.recorded]
    # The null model that the page shows takes as long as several sessions.
    drawn = not options.no_figures
    page = _page(study, subject, folder, known, places, steps, episodes, replayed) if drawn else None
    about = {
        "command": "rehearse", "ok": all(map(as_live, replayed)), "folder": str(folder),
        "page": str(page) if page else None, "sessions": len(places), "replay": replayed,
        **closed_sessions.numbers(steps, episodes),
    }  # fmt: skip
    if options.json:
        print(json.dumps(about, indent=1, default=str))
    else:
        bring.console(options).results([*closed_sessions.lines(subject, about), f"in {page or folder}"])
    return 0 if about["ok"] else 1


def _page(
    study: Settings, subject: str, folder: Path, decoder: Mapping[str, Any], places: Sequence[Place],
    steps: pd.DataFrame, episodes: pd.DataFrame, replayed: Sequence[Mapping[str, int]],
) -> Path:  # fmt: skip
    from hrcneuro.cli import onlining
    from hrcneuro.learning.loop import LoopModel
    from hrcneuro.report import loop, markup

    wanted = study.live["online"]
    model = LoopModel(
        onlining.kind_of(wanted), wanted.tau, mode=wanted.mode, floor=wanted.floor, afresh=wanted.afresh,
        closed=study.live["experiment"].closed, session=study.sections["acquire"].session,
    )  # fmt: skip
    null = loop.null_of(
        steps, episodes, model, sessions=_NULL_SESSIONS, repetitions=_SIM1_REPETITIONS,
        seed=study.sections["acquire"].seed, claimed=onlining.claimed(decoder),
    )  # fmt: skip
    chapter = loop.chapter(
        steps, episodes, null, picture=folder / PICTURE, deadline_s=wanted.deadline_s, mode=wanted.mode,
        remark=rehearsing.SYNTHETIC,
    )  # fmt: skip
    answers = results.blocks([("calibrate", subject, decoder.get("summary", {}))])
    page = markup.render(
        "rehearsal_closed.html",
        title=f"rehearsal of {subject}, closed",
        style=markup.own("page.css"),
        subject=subject,
        remark=rehearsing.SYNTHETIC,
        decoder=answers,
        sessions=closed_sessions.told(places, steps, replayed),
        chapter=chapter,
    )
    place = folder / "rehearsal.html"
    place.write_text(page, encoding="utf-8")
    return place
