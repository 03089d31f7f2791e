"""The lines that a session of closed blocks leaves in its two logs, played here without EEG, stream or file."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np

from hrcneuro.learning.learners import kinds
from hrcneuro.learning.loop_decoders import LoopDecoder
from hrcneuro.learning.online import SUBTASKS, OnlineLearner
from hrcneuro.live.decisions import Trial
from hrcneuro.paradigm import markers
from hrcneuro.paradigm.closed import draw_closed, play_closed
from hrcneuro.paradigm.params import ClosedParams
from hrcneuro.paradigm.partners import Human, Move

_KINDS = kinds(alpha=0.05, ddof=0, horizon=40.0)
_DEADLINE_MS = 750.0


class PlayedLogs:
    """A session's lines.

    Attributes:
        experiment, decisions: Lines as JSON has them.
    """

    def __init__(
        self, decoder: LoopDecoder, params: ClosedParams, *, rng: np.random.Generator, late: float = 0.0,
        human: Human | None = None, mode: str = "closed", learner: str = "paper",
    ) -> None:  # fmt: skip
        """Play it; a share ``late`` of the decisions comes after the deadline."""
        self._rng, self._decoder, self._late, self._mode = rng, decoder, late, mode
        self.learner = OnlineLearner(_KINDS[learner], tau=0.1, rates=decoder.claimed)
        self.experiment: list[dict[str, Any]] = [{"kind": "session", "s": 0.0, "subject": "s01"}]
        self.decisions: list[dict[str, Any]] = [{"kind": "begin", "stamp": 0.0}]
        self._now, self._policy = 1.0, dict.fromkeys(SUBTASKS, 0.5)
        for block in draw_closed(params, rng=rng):
            number = block.block.number
            self._tell("block", practice=False, block=number, human_directions=sorted(block.owners.human))
            if mode == "shadow":
                self._policy = {s: float(s in block.owners.human) for s in SUBTASKS}
            for index, episode in enumerate(block.episodes(), start=1):
                self._tell("episode", practice=False, block=number, episode=index, path=list(episode.path))
                self._play({"block": number, "episode": index}, episode, human or Human(), block)
                self.learner.end_episode()

    def _play(self, where: dict[str, int], episode: Any, human: Human, block: Any) -> None:
        decided, in_time = "", None
        for choice, move in play_closed(episode, human, self._policy, keys=block.draw.keys, choices=block.choices):
            self._tell(
                "choice", practice=False, **where, trial=move.trial, step=choice.step, owner=choice.owner,
                drawn=choice.drawn, actor=choice.actor, human=choice.human, decided=decided, in_time=in_time,
            )  # fmt: skip
            self._now += 0.1
            onset, ahead = self._now, "" if episode.over else episode.target
            text = markers.of_move("s01", scenario="iC", **where, trial=move.trial, practice=False,
                                   actor=move.actor, next=ahead)  # fmt: skip
            expected = "" if episode.over else episode.expected
            in_time = self._decide(text, where, move, ahead, expected, onset)
            decided = text if in_time else decided
            self._now = onset + 0.9
            self._tell("move", practice=False, **where, **asdict(move), onset_s=onset, last=episode.over)

    def _decide(self, text: str, where: dict[str, int], move: Move, ahead: str, expected: str, onset: float) -> bool:
        trial = Trial(text, onset, onset, **where, trial=move.trial, practice=False, scenario="iC",
                      actor=move.actor, next=ahead)  # fmt: skip
        sent_ms = 760.0 if self._rng.random() < self._late else 612.0 + self._rng.gamma(2.0, 4.0)
        trial.pulled_s, trial.decided_s, trial.sent_s = (onset + 1e-3 * (sent_ms - ms) for ms in (1.5, 0.6, 0.0))
        by_human = move.actor == "human"
        takeover = expected != move.actor
        probability = self._decoder.says_takeover(by_human, takeover, ahead != move.target, False)
        uniform = self._rng.random()
        odds = self._decoder.log_odds(by_human, probability, uniform)
        trial.score, trial.takeover = probability - uniform, uniform < probability
        trial.probability = 1 / (1 + np.exp(-odds))
        trial.predicted = {True: "robot", False: "human"}[by_human == trial.takeover]
        trial.deadline_met = sent_ms <= _DEADLINE_MS
        trial.cause = "" if trial.deadline_met else "late"
        trial.cause = trial.cause or ("last" if not ahead else "diagonal" if len(ahead) > 1 else "")
        trial.update = not trial.cause
        trial.policy_before = self.learner.policy()
        if trial.update:
            self.learner.update(ahead, before=move.actor, takeover=trial.takeover, log_odds=odds)
        trial.policy_after = self.learner.policy()
        self.decisions.append(trial.line)
        self._now = onset + 1e-3 * sent_ms + 0.002
        if self._mode == "closed":
            self._policy.update(self.learner.policy())
        self._tell("policy", marker=text, mode=self._mode, sent_s=trial.sent_s, policy=dict(self._policy))
        return True

    def _tell(self, kind: str, **about: Any) -> None:
        self.experiment.append({"kind": kind, "s": self._now, **about})


def moves_of(lines: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield the lines of moves."""
    return (line for line in lines if line["kind"] == "move")
