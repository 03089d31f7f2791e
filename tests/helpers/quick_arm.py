"""An arm that does what it is asked for in no time of this machine's: for what the flow decides, not how arms move."""

from __future__ import annotations

import heapq
import itertools
from dataclasses import asdict

import numpy as np
import pandas as pd

from hrcneuro.experiment import messages as m
from hrcneuro.experiment.closed import ClosedTurns
from hrcneuro.experiment.flow import Flow
from hrcneuro.experiment.person import SimulatedPerson
from hrcneuro.experiment.ports import Pacing
from hrcneuro.experiment.turns import Turns
from hrcneuro.paradigm.closed import draw_closed
from hrcneuro.paradigm.conditions import annotate
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.paradigm.session import draw_session
from hrcneuro.paradigm.timing import IN_RADIUS

APPROACH_S = 1.0


class Rows:
    """Takes down what the flow writes."""

    def __init__(self):
        self.rows, self.keys, self.events, self.blocks, self.episodes, self.onsets = [], [], [], [], [], []

    def block(self, block, when):
        self.blocks.append(block)

    def episode(self, number, path, when):
        self.episodes.append((number, path, when))

    def onset(self, turn):
        self.onsets.append((turn.where["practice"], turn.where["block"], turn.where["episode"], turn.move.trial))

    def move(self, turn, when):
        where = {name: turn.where[name] for name in ("scenario", "practice", "block", "episode")}
        self.rows.append(where | asdict(turn.move) | {"event": "move", "onset_s": turn.onset, "t_f_s": turn.go.t_f})

    def key(self, direction, ignored, when):
        self.keys.append((direction, ignored, when))

    def event(self, kind, when, **about):
        self.events.append((kind, when, about))

    def table(self):
        return annotate(pd.DataFrame(self.rows))


class Lab:
    """A session with such an arm, on a virtual clock."""

    def __init__(
        self, params=SessionParams(), *, seed=0, simulated=True, truth=False, blocks=slice(None), policies=None,
        wait_s=2.0, **pacing,
    ):  # fmt: skip
        """``params`` are ClosedParams where there are ``policies``: the session is one of closed blocks."""
        usual = SessionParams() if policies is not None else params
        human, drawn = draw_session(usual, rng=np.random.default_rng(seed))
        if policies is not None:
            drawn = draw_closed(params, rng=np.random.default_rng(seed))
        self.now, self._queue, self._number = 0.0, [], itertools.count()
        self.sent, self.scenes, self.log = [], [], Rows()
        person = SimulatedPerson(human, TimingParams()) if simulated else None
        shape = {"n_blocks": len(drawn[blocks]), "person": person, "truth": truth}
        if policies is not None:
            self.turns = ClosedTurns("s01", TimingParams(), policies=policies, wait_s=wait_s, **shape)
        else:
            self.turns = Turns("s01", TimingParams(), **shape)
        self._free = 0.0  # when the arm rests again
        self.flow = Flow(
            drawn[blocks], self.turns, Pacing(**pacing), arm=self._take, restart=self._restart,
            show=self.scenes.append, log=self.log,
        )  # fmt: skip
        self._at(0.0, m.Ready(0.0, 0.03))

    def _at(self, when, report):
        heapq.heappush(self._queue, (when, next(self._number), report))

    def _restart(self):
        self._free = self.now
        self._at(self.now + 5.0, m.Ready(self.now + 5.0, 0.03))

    def _take(self, request):
        self.sent.append((self.now, request))
        if isinstance(request, m.Finish):
            self._at(self.now, m.Ended(self.now))
        elif isinstance(request, m.Approach):
            self._free = self.now + APPROACH_S
            self._at(self._free, m.Arrived(request.tile, self._free))
        elif isinstance(request, m.Go):
            onset = max(self.now, self._free, request.not_before)
            self._free = onset + request.t_f
            self._at(onset, m.Onset(request.index, onset))
            radius = onset + IN_RADIUS * request.t_f
            self._at(radius, m.InRadius(request.index, radius))
            self._at(self._free, m.Executed(request.index, self._free))

    def halt(self):
        """The arm is stopped now."""
        self._queue.clear()
        self._at(self.now, m.Halted("stopped", "go on", True, self.now))

    def step(self):
        """Let the next thing happen; return whether there was one."""
        wakes = self.flow.wakes
        if self._queue and (wakes is None or self._queue[0][0] <= wakes):
            self.now, _, report = heapq.heappop(self._queue)
            self.flow.report(report)
        elif wakes is not None:
            self.now = max(self.now, wakes)
            self.flow.tick(self.now)
        else:
            return False
        return True

    def after(self, steps):
        """Let so many things happen."""
        for _ in range(steps):
            self.step()
        return self

    def run(self, until=lambda lab: False):
        """Let things happen until ``until`` holds, or nothing more does."""
        while not self.flow.over and not until(self):
            if not self.step():
                break
        return self
