"""What the command online does: decoder and learner, streams or a recording, the log, and the answer in the end."""

from __future__ import annotations

import contextlib
import gc
import json
import os
import resource
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from hrcneuro import interrupts
from hrcneuro.cli import bring, online_answer
from hrcneuro.cli.online_view import View
from hrcneuro.cli.options import Options
from hrcneuro.config.settings import Settings
from hrcneuro.decoding.frozen import FrozenDecoder
from hrcneuro.errors import ConfigError, DataError, HardwareError
from hrcneuro.io.decoders import ABOUT, read_decoder
from hrcneuro.io.places import new_folder, unwritable
from hrcneuro.learning.learners import Kind, kinds
from hrcneuro.learning.online import OnlineLearner, rates_of
from hrcneuro.learning.rates import Rates
from hrcneuro.live import decisions, going_on, online_streams, replaying
from hrcneuro.live.lsl import LslNetwork, LslOutlet
from hrcneuro.live.online import Online
from hrcneuro.live.parameters import OnlineOptions
from hrcneuro.live.policies import running, source_of
from hrcneuro.live.transport import DECISIONS, Network
from hrcneuro.pipeline.workdir import Workdir

_SOON_S, _QUICK_S, _STEP_S = 0.02, 0.0005, 0.004
_SWITCH_S = 0.0005  # so long may the thread that looks for streams keep a decision waiting


class Task:
    """One call of the command."""

    def __init__(self, study: Settings, subject: str, options: Options, decoder: Path | None) -> None:
        """Read the decoder.

        Raises:
            DataError: There is none, or it cannot be read.
        """
        self._subject, self._options, self._talk = subject, options, bring.console(options)
        self._wanted: OnlineOptions = study.live["online"]
        self._record = study.live["record"]
        place = decoder or Workdir(options.workdir).artifact("calibrate", subject, ABOUT).parent
        self._decoder, about = read_decoder(place)
        self._about: Mapping[str, Any] = about
        self._parent = options.workdir.absolute() / self._record.folder / subject

    # --- live -----------------------------------------------------------------------------------------------------

    def look(self) -> int:
        """Find the EEG and say whether the decoder serves it; decide nothing; return the exit code."""
        with LslNetwork() as network:
            eeg = online_streams.find_eeg(network, network.clock, time.sleep, self._decoder, self._wanted)
            about = eeg.inlet.description
            eeg.inlet.close()
        told = {"stream": about.name, "sfreq": about.sfreq, "channels": len(eeg.rows), "mode": self._wanted.mode}
        print(
            json.dumps(told, indent=1)
            if self._options.json
            else f"{about.name}: the decoder serves it; nothing was decided"
        )
        return 0

    def live(self, seconds: float, *, go_on: bool = False) -> int:
        """Decide until a marker tells that the session has ended, Ctrl-C, or so many seconds; return the exit code.

        Raises:
            HardwareError: The EEG is not there, is lost for too long, or is none that the decoder serves; another loop
                of the subject is running.
            ConfigError, StageError: The log cannot be written.
            DataError: There is no loop to go on with, or it was another one.
        """
        learner = learner_of(self._wanted, self._about)
        path = going_on.newest(self._parent) if go_on else None
        before = self._relearn(learner, path) if path is not None else None
        # Threads of BLAS that wait for each other take longer than these products.
        with interrupts.whole(), threadpool_limits(1):
            with LslNetwork() as network:
                self._talk.say("looking for the EEG …")
                eeg = online_streams.find_eeg(network, network.clock, time.sleep, self._decoder, self._wanted)
                self._refuse_second(network)
                log = self._log()
                if path is not None:
                    log(going_on.goes_on(path))
                outlet = LslOutlet(
                    DECISIONS,
                    "Markers",
                    ["decision"],
                    sfreq=0,
                    source_id=source_of(self._subject, os.getpid()),
                )
                view = View(self._talk, self._record, self._wanted, log.path)
                loop = Online(
                    network, network.clock, eeg, self._decoder, learner, self._wanted, subject=self._subject,
                    publish=outlet.send, log=log, rail_uv=self._record.rail_uv, tell=view.tell,
                )  # fmt: skip
                if before is not None:
                    loop.deciding.go_on(before.policy, before.episode)
                interrupts.once(lambda: self._talk.say("the log is being ended; a moment"))
                interrupts.hold()
                begun, work = time.monotonic(), time.process_time()
                try:
                    self._go_on(loop, view, seconds)
                finally:
                    # Whatever ends it: what was decided stands in the log.
                    outlet.close()
                    log.close()
                share = (time.process_time() - work) / max(time.monotonic() - begun, 1e-9)
            interrupts.forget()
        told = self._told([loop], log.path) | {
            "cpu_share": share,
            "rss_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        }
        self._answer(told)
        return 0

    def _refuse_second(self, network: Network) -> None:
        if others := running(network, self._subject):
            raise HardwareError(
                f"a closed loop of {self._subject} is running ({others[0].source_id}); an experiment heeds one",
                cure="end that one first, with Ctrl-C in its terminal",
            )

    def _relearn(self, learner: OnlineLearner, path: Path) -> going_on.Before:
        before = going_on.relearned(going_on.history(path), learner, self._decoder, afresh=self._wanted.afresh)
        self._talk.say(f"goes on with what {path} tells: {learner.updates} decisions had taught")
        return before

    def _go_on(self, loop: Online, view: View, seconds: float) -> None:
        gc.collect()
        gc.freeze()
        # A decision is due within milliseconds; the samples before it cost next to nothing.
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, -10)
        begun, switch = time.monotonic(), sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_S)
        with view:
            while not (interrupts.asked() or loop.over or 0 < seconds <= time.monotonic() - begun):
                loop.step()
                view.show(loop)
                time.sleep(_QUICK_S if loop.deciding.due_s() < _SOON_S else _STEP_S)
            loop.finish()
        sys.setswitchinterval(switch)

    def _log(self) -> decisions.DecisionLog:
        try:
            return decisions.DecisionLog(new_folder(self._parent, "-online"))
        except OSError as error:
            raise unwritable("the log", self._parent, error) from error

    # --- a recording ----------------------------------------------------------------------------------------------

    def replay(self, recording: Path, chunk: int, log: Path | None) -> int:
        """Go over a recording; return 0, or 1 where scores differ from those of the live session, or none is alike.

        Raises:
            DataError: It, or the log, cannot be read.
        """
        parts = replaying.read(recording, self._wanted)
        found = [log] if log is not None else replaying.logs_beside(recording, parts)
        try:
            known = decisions.known(*found) if found else None
        except OSError as error:
            raise DataError(f"{log} cannot be read: {error.strerror or error}", cure="name another: --log") from error
        loops, lines = replayed(
            parts, self._decoder, self._about, self._wanted, subject=self._subject, chunk=chunk, known=known,
            rail_uv=self._record.rail_uv,
        )  # fmt: skip
        # A recording's clock stands still while it is decided: durations mean nothing.
        told = self._told(loops, found[-1] if found else None) | {"latency_ms": {}}
        code = 0
        if known is not None:
            same = compared(lines, known)
            told["against_log"] = same
            code = int(not as_live(same))
        self._answer(told, ok=code == 0)
        return code

    def _told(self, loops: Sequence[Online], log: Path | None) -> dict[str, Any]:
        return online_answer.told(loops, subject=self._subject, mode=self._wanted.mode, log=log)

    def _answer(self, told: dict[str, Any], *, ok: bool = True) -> None:
        if self._options.json:
            print(json.dumps({"ok": ok, **told}, indent=1))
        else:
            self._talk.results(online_answer.lines(told))


def learner_of(options: OnlineOptions, about: Mapping[str, Any]) -> OnlineLearner:
    """Return the learner that is configured; ``about`` is what a decoder's file says of it.

    Raises:
        ConfigError: It needs rates that the decoder has not.
    """
    kind, rates = kind_of(options), claimed(about)
    if rates is None and kind.evidence == "decision" and options.learner == "bayes":
        raise ConfigError(
            "online.learner = 'bayes' weighs an answer by the decoder's rates, and the decoder has none of its own",
            cure="calibrate on at least two blocks, or take another learner, such as 'bayes_graded'",
        )
    return OnlineLearner(kind, tau=options.tau, floor=options.floor, rates=rates)


def kind_of(options: OnlineOptions) -> Kind:
    """Return which learner is configured."""
    return kinds(alpha=options.alpha, ddof=0, horizon=options.horizon)[options.learner]


def claimed(about: Mapping[str, Any]) -> Rates | None:
    """Return the rates of a decoder's calibration, by what its file says of it; None where it has none."""
    return rates_of(about.get("summary", {}).get("problems", {}))


def replayed(
    parts: Sequence[tuple[replaying.Stream, replaying.Stream]], decoder: FrozenDecoder, about: Mapping[str, Any],
    options: OnlineOptions, *, subject: str, chunk: int, known: decisions.Known | None, rail_uv: float,
) -> tuple[list[Online], list[Mapping[str, Any]]]:  # fmt: skip
    """Return the loops that went over the parts of a recording, and the lines of their log.

    Args:
        parts: As :func:`~hrcneuro.live.replaying.read` has them.
        decoder, about: As :func:`~hrcneuro.io.decoders.read_decoder` has them.
        options: Of the loop.
        subject, chunk, known, rail_uv: As :func:`~hrcneuro.live.replaying.replay` takes them.
    """
    lines: list[Mapping[str, Any]] = []
    with threadpool_limits(1):
        loops = replaying.replay(
            parts, decoder, learner_of(options, about), options, subject=subject, chunk=chunk,
            publish=lambda text, stamp: None, log=lines.append, known=known, rail_uv=rail_uv,
        )  # fmt: skip
    return loops, lines


def as_live(same: Mapping[str, int]) -> bool:
    """Return whether a replay is the live session's: no score differs, and some are equal if there was any.

    ``same`` is of :func:`compared`.
    """
    return not same["different"] and (same["equal"] > 0 or not same["unknown"] + same["unrecorded"])


def compared(lines: Sequence[Mapping[str, Any]], known: decisions.Known) -> dict[str, int]:
    """Return how many moves of a replay have the score of the live session's log, or another.

    ``undecided`` are those for which live there was no score, ``unrecorded`` those whose epoch the recording does not
    hold, or before the first state of the live filter that it holds; ``unknown`` are not in the log.
    """
    counts = {"equal": 0, "different": 0, "undecided": 0, "unrecorded": 0, "unknown": 0}
    for line in lines:
        if line["kind"] != decisions.MOVE:
            continue
        key = line["marker"], line["marker_stamp"]
        if key not in known.scores:
            counts["unknown"] += 1
        elif known.scores[key] is None:
            counts["undecided"] += 1
        elif line["score"] is None and line["cause"] in ("missing", "gone"):
            counts["unrecorded"] += 1
        else:
            counts["equal" if line["score"] == known.scores[key] else "different"] += 1
    return counts
