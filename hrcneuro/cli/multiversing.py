"""What the command multiverse does: plan, say what it costs, run and judge each universe, let go of what is over."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from hrcneuro import interrupts, stages
from hrcneuro.answers.words import counted, roughly
from hrcneuro.cache.disk import guarded
from hrcneuro.cli import bring, plan
from hrcneuro.cli.at_once import answered
from hrcneuro.cli.console import Console
from hrcneuro.cli.multiverse_plan import Work, planned
from hrcneuro.cli.options import Options
from hrcneuro.config.multiverses import Choice
from hrcneuro.errors import ConfigError, StageError
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.provenance import provenance
from hrcneuro.pipeline.runlog import RunLog
from hrcneuro.pipeline.universe_cost import Cost, cost
from hrcneuro.pipeline.universes import Universe, in_order, last_uses, let_go
from hrcneuro.report import multiverse as told_of
from hrcneuro.report.multiverse import Judged
from hrcneuro.report.multiverse_files import Written, write
from hrcneuro.report.results import Results


def run(options: Options, file: Path, disk_gb: float | None) -> int:
    """Plan, run and judge a multiverse; return the exit code."""
    if disk_gb is not None and not 0 < disk_gb < math.inf:
        raise ConfigError(f"--disk is {disk_gb:g}", cure="give a number of GB above 0, such as --disk 10")
    work = planned(options, file)
    talk = bring.console(options)
    for one in work.every:
        if (rows := told_of.read_judged(work.kept(one))) is not None and not options.force:
            work.judged[one.number] = rows
    pending = in_order([one for one in work.every if one.number not in work.judged])
    limit = None if disk_gb is None else round(disk_gb * 1e9)
    wanted = cost(
        work.study,
        work.every,
        pending,
        lambda one: work.walk(one).plan(),
        chains=len(set(work.chains.values())),
        limit=limit,
    )
    if options.dry_run:
        talk.results(wanted.lines())
    else:
        for line in wanted.lines():
            talk.say(line)
    wanted.refuse()
    if options.dry_run:
        if options.json:
            print(json.dumps({"command": "multiverse", "ok": True, "cost": wanted.document()}, indent=1))
        return 0
    with bring.logged("multiverse", options, work.every[0].settings) as log:
        _run(work, pending, talk, log)
        written = _written(work, wanted) if work.judged else Written()
        failed = [item for items in work.failed.values() for item in items if item.state is State.FAILED]
        code = _finished(work, talk, wanted, written, failed)
        log.end(failed, code)
    return code


def _run(work: Work, pending: Sequence[Universe], talk: Console, log: RunLog) -> None:
    """Run and judge universes, one after the other; after each, drop what none of the others needs."""
    if not pending:
        return
    options, note = work.options, None if work.options.quiet else partial(talk.say, style="yellow")
    first = work.walk(pending[0])
    executor = bring.executor_of(options, first, note)
    last = last_uses(pending)
    answer = partial(talk.say, "interrupted: what is under way is being ended", style="yellow")

    def tell(item: Item) -> None:
        if options.verbose or item.state is State.FAILED:
            talk.report(item)
        log.item(item)

    try:
        with answered(answer), executor, interrupts.whole():
            for place, one in enumerate(pending, 1):
                study = work.walk(one)
                study.second_cache = first.second_cache
                items = study.run(executor, provenance=provenance, report=tell, tell=note)
                if again := plan.sent_again(items):
                    talk.say(f"note: {again}", style="yellow")
                _judge(work, one, items)
                _let_go(work, one, items, last)
                if one.number in work.judged:
                    with guarded(work.place.place):
                        told_of.keep_judged(work.kept(one), work.judged[one.number])
                talk.say(f"{place}/{len(pending)} {work.words(one)}: {_counts(items)}")
    except BaseException:
        work.study.cache.sweep()
        raise


def _judge(work: Work, one: Universe, items: Sequence[Item]) -> None:
    work.seconds += sum(item.seconds for item in items if item.state is State.RAN)
    bad = [item for item in items if not item.state.done]
    if bad:
        work.failed[one.number] = bad
    else:
        work.judged[one.number] = told_of.judge(one.settings, items)


def _let_go(work: Work, one: Universe, items: Sequence[Item], last: Mapping[Any, int]) -> None:
    """Drop what this universe was the last to need, before it counts as judged: else a kill would leave it there."""
    over = {lineage[:2] for lineage in one.lineages.values() if last[lineage] == one.number}
    let_go(work.place, work.study, [item for item in items if item.state.done and (item.stage, item.unit) in over])


def _counts(items: Sequence[Item]) -> str:
    ran, failed = (sum(item.state is state for item in items) for state in (State.RAN, State.FAILED))
    return f"{ran} ran, {len(items) - ran - failed} fresh" + (f", {failed} failed" if failed else "")


def _written(work: Work, wanted: Cost) -> Written:
    """Write tables, pictures and the page of what is judged."""
    ended = [
        Judged(
            one.number,
            work.chains[one.number],
            one.chosen,
            work.judged[one.number],
            {name: one.analysis(name) for name in stages.NAMES},
        )
        for one in work.every
        if one.number in work.judged
    ]
    study = work.every[0]
    # Its recordings may be dropped by now; what their records say of their origin is there.
    reality = Results(study.settings, work.walk(study).plan()).reality[1]
    notes = [f"failed and not judged: {work.words(work.every[number])}" for number in work.failed]
    try:
        with guarded(work.out):
            return write(
                work.out,
                ended,
                study=study.settings.study.name,
                own=study.chosen,
                reality=reality,
                what=f"{wanted.lines()[0].partition(';')[0]}. {_how(work.choices)}",
                notes=notes,
                drawn=not work.options.no_figures,
                choices=[_choice(one) for one in work.choices],
                curves=work.asked.curves or told_of.CURVES,
                failed=[Judged(number, work.chains[number], work.every[number].chosen, ()) for number in work.failed],
            )
    except (ValueError, KeyError, TypeError) as error:
        # What was judged is kept.
        problem = f"the multiverse's page could not be made: {type(error).__name__}: {error}"
        raise StageError(problem, cure="--debug shows where; please report it as a bug") from error


def _how(choices: Sequence[Choice]) -> str:
    crossed = [one.name for one in choices if one.crossed]
    alone = [one.name for one in choices if not one.crossed]
    parts = [f"Crossed in full: {', '.join(crossed)}." if crossed else ""]
    parts += [f"One at a time, all else as in the study: {', '.join(alone)}." if alone else ""]
    return " ".join(part for part in parts if part)


def _choice(one: Choice) -> tuple[str, str, str]:
    return one.name, "crossed" if one.crossed else "one at a time", "; ".join(value.name for value in one.values)


def _finished(work: Work, talk: Console, wanted: Cost, written: Written, failed: Sequence[Item]) -> int:
    """Print what came out; return the exit code."""
    if work.options.json:
        answer = {
            "command": "multiverse",
            "ok": not work.failed,
            "cost": wanted.document(),
            "judged": len(work.judged),
            "failed": {number: work.words(work.every[number]) for number in work.failed},
            "seconds": round(work.seconds, 3),
            "summary": written.summary,
            "files": {name: str(path) for name, path in written.files.items()},
        }
        print(json.dumps(answer, indent=1))
    if written.files:
        talk.results([*written.lines, f"page: {written.page}"])
    code = talk.failures(failed)
    blocked = f", {counted(len(work.failed), 'universe')} failed" if work.failed else ""
    took = f"; {roughly(work.seconds)} of work" if work.seconds else ""
    talk.say(f"multiverse: {counted(len(work.judged), 'universe')} judged{blocked}{took}")
    return code or int(bool(work.failed))
