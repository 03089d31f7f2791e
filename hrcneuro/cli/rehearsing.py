"""What the command rehearse does: a recorded session without a person, its analysis, and a page that tells of both."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from hrcneuro.answers.words import counted
from hrcneuro.cli import bring, experimenting, recording, results, timing_of
from hrcneuro.cli.options import Options
from hrcneuro.config.settings import Settings
from hrcneuro.errors import ConfigError, HardwareError, StageInterrupted, did_you_mean
from hrcneuro.experiment import session
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.ports import Seen
from hrcneuro.io.places import check_room, new_folder
from hrcneuro.live.part import newest
from hrcneuro.pipeline import graph
from hrcneuro.pipeline.walk import Item

_ARMS = {"virtual": "sim", "real": "ursim"}
_PACES = tuple(_ARMS)
_STAGES = ("erp", "decode")
ROOM = 450_000_000
"""Bytes: 50 minutes of 31 channels at 1 kHz, and what is made of them."""
SYNTHETIC = "SYNTHETIC: EEG, person and arm were simulated by hrcneuro."


def run(options: Options, subject: str, pace: str, *, screen: bool, patient: bool) -> int:
    """Rehearse; return the exit code.

    Raises:
        HrcError: The session cannot be begun, or was stopped.
    """
    check_pace(pace)
    given = given_at(pace, screen=screen, patient=patient)
    study = bring.settings(options, others=given)
    graph.check_subject(study, subject)
    ahead = session.looked_ahead(experimenting.setup_of(study, subject, options.workdir))
    if options.dry_run:
        print(f"{subject}: a session at {pace} pace in {parent(options, subject)}, then {', '.join(_STAGES)}")
        return 0
    check_room(
        parent(options, subject), ROOM, what="a rehearsal", then="nothing was begun",
        cure="free space, or rehearse elsewhere: --workdir",
    )  # fmt: skip
    folder = new_folder(parent(options, subject))
    given |= placed(study, folder)
    study = bring.settings(options, others=given)
    talk = bring.console(options)
    talk.say(f"rehearsing {subject} at {pace} pace in {folder}")
    if pace == "virtual":
        seen = virtual(study, subject, folder, ahead)
    else:
        from hrcneuro.cli.rehearsing_real import real

        seen = real(options, study, subject, folder, given, ahead)
    if not seen.whole:
        raise broken_off(seen, folder)
    return _told(options, subject, folder, seen, patient=patient and pace == "real")


def check_pace(pace: str) -> None:
    """Refuse a pace that there is not. Raises ConfigError."""
    if pace not in _PACES:
        raise ConfigError(
            f"--pace {pace!r}{did_you_mean(pace, _PACES)}; allowed: {', '.join(_PACES)}", cure="choose one of them"
        )


def placed(study: Settings, folder: Path) -> dict[str, Sequence[str]]:
    """Return where a rehearsal is recorded, and at which rate: the study's own, whatever a laboratory has declared."""
    rate, streams = study.sections["acquire"].sfreq, study.live["record"].streams
    places = [f"{key}={folder / 'recordings'}" for key in ("record.folder", "robot.rescue_folder")]
    rates = [f"record.streams.{key}.sfreq={rate}" for key, one in streams.items() if one.sfreq]
    return {"--workdir": [*places, *rates]}


def broken_off(seen: Seen, folder: Path) -> HardwareError | StageInterrupted:
    """Return why a session was broken off, as an error."""
    kept = f"what was recorded until then is in {folder}"
    cure = "rehearse again: the same command, which begins in a new folder"
    if seen.interrupted:
        return StageInterrupted(f"interrupted; {kept}", cure=cure)
    return HardwareError(f"the session was broken off: {seen.trouble}; {kept}", cure=seen.cure or cure)


def parent(options: Options, subject: str) -> Path:
    """Return the folder of a subject's rehearsals."""
    return options.workdir.absolute() / "rehearsals" / subject


def given_at(pace: str, *, screen: bool, patient: bool) -> dict[str, Sequence[str]]:
    """Return the settings of a rehearsal at a pace."""
    base = [
        "experiment.human=simulated", f"experiment.pace={pace}", f"experiment.screen={str(screen).lower()}",
        # A laboratory's arm and its port are not for rehearsals.
        "experiment.drawn_tool=false", f"robot.backend={_ARMS[pace]}", "robot.trigger.port=none",
        "robot.at_the_robot=false", "robot.markers=none", "robot.truth=false",
        f"robot.patient={str(patient and pace == 'real').lower()}",
    ]  # fmt: skip
    if pace == "real":
        base += [
            "experiment.truth=true", "robot.recorder_wait_s=60", "record.wait_s=60",
            "acquire.session.blocks=1", "acquire.session.practice_episodes=0",
        ]  # fmt: skip
    return {"--pace": base}


def virtual(study: Settings, subject: str, folder: Path, ahead: Ahead) -> Seen:
    """Run a session of the study at virtual pace; return what was seen of it."""
    from hrcneuro.cli.amplifying import brain_of, kinds
    from hrcneuro.experiment.rehearsal import Lab, Rehearsal

    setup = experimenting.setup_of(study, subject, folder)
    lab = Lab(brain_of(study, subject), kinds(), study.live["record"], SYNTHETIC, new_folder(setup.folder / subject))
    return Rehearsal(setup, lab, ahead=ahead).run()


def _told(options: Options, subject: str, folder: Path, seen: Seen, *, patient: bool) -> int:
    """Analyse what was recorded, and tell what came of it all."""
    where = replace(options, workdir=folder, set=[*(options.set or ()), *analysed(subject, folder)])
    study = bring.settings(where)
    setup = experimenting.setup_of(study, subject, folder)
    talk = bring.console(options)
    place = newest(setup.folder / subject)
    assert place is not None
    checked, trouble = recording.read_back(place)
    kept = [*(_borne(seen) if patient else []), *recording.verdict(place, checked), *([trouble] if trouble else [])]
    timing = timing_of.measure(folder, subject, study, place, talk)
    with bring.logged("rehearse", where, study) as log:
        items = bring.bring(where, study, graph.targets(study, _STAGES, [subject]), log)
        code = talk.failures(items)
        log.end(items, code)
    rules, counts = _rules(study, subject), _counts(where, subject)
    page = _page(folder, subject, seen, rules, counts, kept, timing, items)
    broken = [one["rule"] for one in rules if not one["ok"]]
    about = {
        "command": "rehearse", "ok": not (code or trouble or broken), "folder": str(folder), "page": str(page),
        "session": experimenting.told(setup, seen), "rules": rules, "counts": counts, "recording": checked,
        "timing": timing.about,
        "stages": {item.stage: item.summary for item in _main(items)},
    }  # fmt: skip
    if options.json:
        print(json.dumps(about, indent=1, default=str))
    else:
        lines = [*experimenting.lines(setup, seen), *kept, timing.about["verdict"], *_kept_to(rules, counts)]
        talk.results([*lines, *_answers(items), f"in {page}"])
    return code or int(bool(trouble or broken))


def analysed(subject: str, folder: Path) -> list[str]:
    """Return the settings with which a rehearsal's recording is analysed."""
    path = folder / "recordings" / "{subject}" / "*"
    return [
        "acquire.source=recording", f"acquire.path={path}", f"study.subjects=['{subject}']", "study.exclude=[]",
        f"record.folder={folder / 'recordings'}", "experiment.human=simulated",
    ]  # fmt: skip


def _borne(seen: Seen) -> list[str]:
    late = seen.health.late_packets if seen.health else 0
    return [f"  the simulated arm ran with --patient: {counted(late, 'packet')} came late, and did not stop it"]


def _rules(study: Settings, subject: str) -> list[dict[str, Any]]:
    """Return the rules that every session keeps without exception: the others are about chance in a whole study."""
    from hrcneuro.sources import behaviour

    rules = behaviour.listed(behaviour.study_rules({subject: study.section("acquire", subject)}))
    return [one for one in rules if "…" not in one["target"]]


def _counts(options: Options, subject: str) -> list[dict[str, Any]]:
    from hrcneuro.io.tables import read_table
    from hrcneuro.paradigm.session_counts import session_counts
    from hrcneuro.pipeline.workdir import Workdir

    table = read_table(Workdir(options.workdir).artifact("acquire", subject, "trials.parquet"))
    rows = session_counts(table).to_dict("records")
    return [{str(key): bool(value) if key == "ok" else value for key, value in row.items()} for row in rows]


def _kept_to(rules: Sequence[Mapping[str, Any]], counts: Sequence[Mapping[str, Any]]) -> list[str]:
    broken = [
        f"BROKEN: {one['rule']} ({_number(one['measured'])}, not {one['target']})" for one in rules if not one["ok"]
    ]
    odd = [f"  {one['quantity']}: {_number(one['measured'])}" for one in counts if not one["ok"]]
    held = f"{len(rules) - len(broken)} of {len(rules)} rules without exception hold"
    inside = f"{len(counts) - len(odd)} of {len(counts)} counts and durations are as in the study's sessions"
    return [f"{held}; {inside}", *broken, *odd]


def _main(items: Sequence[Item]) -> list[Item]:
    return [item for item in items if item.state.done and not item.draws]


def _answers(items: Sequence[Item]) -> list[str]:
    return results.blocks([(item.stage, item.unit, item.summary) for item in _main(items)])


def _page(
    folder: Path, subject: str, seen: Seen, rules: Sequence[Mapping[str, Any]], counts: Sequence[Mapping[str, Any]],
    kept: Sequence[str], timing: timing_of.Measured, items: Sequence[Item],
) -> Path:  # fmt: skip
    from hrcneuro.report import markup

    rows = [
        (one["quantity"], *(_number(one[key]) for key in ("measured", "low", "high")), "" if one["ok"] else "outside")
        for one in counts
    ]
    page = markup.render(
        "rehearsal.html",
        title=f"rehearsal of {subject}",
        style=markup.own("page.css"),
        subject=subject,
        remark=SYNTHETIC,
        session=[f"{seen.blocks_done} blocks, {seen.n_moves} moves, {seen.keys['']} keys", *kept],
        timing=[*timing.lines],
        rules=_kept_to(rules, counts),
        counts=markup.PageTable(("quantity", "this session", "least", "most", ""), rows),
        answers=_answers(items),
    )
    place = folder / "rehearsal.html"
    place.write_text(page, encoding="utf-8")
    return place


def _number(value: float | None) -> str:
    # A rule of which a short session has no case.
    return "" if value is None else f"{value:.4g}"
