"""The null model of the closed loop: Eq 4's coin flips while a simulated person and the robot play closed episodes.

At each move after which the path leads straight on, one of four directions, a decoder that is a mere set of
probabilities says who is expected to make the next step; a learner takes it, and the robot draws by its policy.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from hrcneuro.learning.learners import Kind
from hrcneuro.learning.loop_decoders import LoopDecoder
from hrcneuro.learning.online import HUMAN, ROBOT, SUBTASKS, OnlineLearner, Policy
from hrcneuro.paradigm.closed import Choice, ClosedBlock, ClosedEpisode, draw_closed, play_closed
from hrcneuro.paradigm.params import ClosedParams, SessionParams
from hrcneuro.paradigm.partners import Move
from hrcneuro.paradigm.session import draw_habits

MODES = ("shadow", "semi", "closed", "direct")
STEPS = ("human", "taken", "robot", "left", "diagonal")
"""What can come of a step: the person makes the own one, the robot takes it from them, the robot makes the own one at
once, it leaves that lying and makes it later, and a diagonal, which is the robot's."""
CASES = ("RR", "RH", "HR", "HH")
"""Who makes the move at whose onset it is decided, and whose the next step is by the person's choice."""


@dataclass(frozen=True)
class LoopModel:
    """How a simulated session of closed blocks goes.

    Attributes:
        kind: Which learner, from :func:`.learners.kinds`.
        tau: Temperature of Eq 5.
        mode: ``closed``: the robot acts by all that was learned; ``semi``: by what was learned up to the end of the
            last block; ``shadow``: by ownership, as in the study's blocks: each makes the own steps, and the learner
            looks on; ``direct``: by the last decision alone, as if it were certain, at the step that it is about
            (paper §4.2), and by a coin where there is none.
        floor: Least probability of each action.
        afresh: The learner forgets all at a block's beginning.
        teaches: Probability that a decision teaches: others are missing, late or not to be trusted.
        errp: Rates at which an error-related potential is decoded of a step that the robot takes from the person or
            leaves lying (TPR, %), and of one that comes as expected (TNR): this, too, teaches who is expected to make
            such steps (paper §4.4), through a learner that counts decisions; None: it is not decoded.
        in_time: Probability that it is taken up before keys open for the step that it is about; otherwise the robot
            heeds it one step later.
        closed: The protocol.
        session: What is said there of the person's habits, such as how often a key is wrong.

    Raises:
        ValueError: An unknown mode, or a probability outside 0 and 1.
    """

    kind: Kind
    tau: float
    mode: str = "closed"
    floor: float = 0.0
    afresh: bool = False
    teaches: float = 1.0
    in_time: float = 1.0
    errp: tuple[float, float] | None = None
    closed: ClosedParams = field(default_factory=ClosedParams)
    session: SessionParams = field(default_factory=SessionParams)

    def __post_init__(self) -> None:
        if self.mode not in MODES:
            raise ValueError(f"mode {self.mode!r}; allowed: {', '.join(MODES)}")
        for name in ("teaches", "in_time"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} is {getattr(self, name):g}; it is a probability: 0 to 1")
        if self.errp is not None and self.mode == "shadow":
            raise ValueError("errp in mode shadow: where each makes the own steps, nothing surprises")
        if self.errp is not None and self.kind.evidence != "decision":
            raise ValueError("errp for a learner that weighs evidence: an error-related potential has a rate alone")


@dataclass(frozen=True)
class LoopSessions:
    """What came of sessions of closed blocks, simulated or recorded; the directions are in the order of ``SUBTASKS``.

    Attributes:
        policies: ndarray, shape (n_sessions, n_episodes, 4): π(human | direction) that the learner holds after each
            episode; NaN after the last one of a session that is shorter than others.
        owners: ndarray, shape (n_sessions, n_episodes, 4), bool: whether the direction is the person's.
        updates: ndarray, shape (n_sessions, n_episodes), int: answers taken since the session began.
        steps: ndarray, shape (n_sessions, n_episodes, 5), int: steps of each kind of ``STEPS``.
        decisions: ndarray, shape (n_sessions, 4, 2), int: decisions that taught, by ``CASES`` and by whether they said
            "no takeover" or "takeover".
    """

    policies: np.ndarray
    owners: np.ndarray
    updates: np.ndarray
    steps: np.ndarray
    decisions: np.ndarray

    @property
    def n_sessions(self) -> int:
        """How many sessions there are."""
        return len(self.policies)

    @classmethod
    def joined(cls, parts: list[LoopSessions]) -> LoopSessions:
        """Return sessions of one length put together in order."""
        names = cls.__dataclass_fields__
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def simulate_loop(model: LoopModel, decoder: LoopDecoder, *, sessions: int, seed: int, first: int = 0) -> LoopSessions:
    """Return simulated sessions, each with a person, owners, paths and answers of its own.

    Session k has a generator seeded with (seed, k), and each thing that is drawn one of its own: results do not depend
    on how sessions are split up, and models and decoders that are compared meet the same people and paths.

    Args:
        model: How they go.
        decoder: What the robot listens to.
        sessions: How many.
        seed: Of every draw.
        first: Number of the first session.
    """
    played = [_session(model, decoder, np.random.default_rng([seed, k])) for k in range(first, first + sessions)]
    return LoopSessions(*(np.array(parts) for parts in zip(*played, strict=True)))


def kind_of(choice: Choice) -> str:
    """Return which of ``STEPS`` a step is."""
    if not choice.drawn:
        return "diagonal"
    if choice.taken:
        return "taken"
    return "left" if choice.left else choice.owner


def _session(model: LoopModel, decoder: LoopDecoder, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    person, protocol, *answers = rng.spawn(6)
    human = draw_habits(model.session, person)
    learner = OnlineLearner(model.kind, tau=model.tau, floor=model.floor, rates=decoder.claimed)
    robot = _Robot(model, decoder, learner, answers)
    policies, owners, updates, steps = [], [], [], []
    for block in draw_closed(model.closed, rng=protocol):
        robot.begin_block(block)
        for episode in block.episodes():
            counts = dict.fromkeys(STEPS, 0)
            for choice, move in play_closed(episode, human, robot.policy, keys=block.draw.keys, choices=block.choices):
                counts[kind_of(choice)] += 1
                robot.perceive(choice)
                robot.hear(None if episode.over else _ahead(episode, move))
            policies.append(list(robot.learned.values()))
            robot.end_episode()
            owners.append([s in block.owners.human for s in SUBTASKS])
            updates.append(robot.updates)
            steps.append(list(counts.values()))
    return np.array(policies), np.array(owners), np.array(updates), np.array(steps), robot.decisions


@dataclass(frozen=True)
class _Ahead:
    """What a move leads to: the direction of the next step, of eight, and what decides the answer at the move's onset.

    ``by_human``: whose the move is; ``humans``: whose the step is by the person's choice; ``expects_human``: whom they
    expect to make it; ``turn``: it leads another way than the move's.
    """

    step: str
    by_human: bool
    humans: bool
    expects_human: bool
    turn: bool


def _ahead(episode: ClosedEpisode, move: Move) -> _Ahead:
    step = episode.target
    owner, expected = episode.owner == HUMAN, episode.expected == HUMAN
    return _Ahead(step, move.actor == HUMAN, owner, expected, step != move.target)


class _Robot:
    """Decides, learns and acts.

    Attributes:
        policy: What it acts by.
        learned: What it would act by, had it learned in time and in this mode.
        updates: Answers that it has taken.
        decisions: As in :class:`LoopSessions`.
    """

    def __init__(
        self, model: LoopModel, decoder: LoopDecoder, learner: OnlineLearner, answers: list[np.random.Generator]
    ) -> None:
        self._model, self._decoder, self._learner = model, decoder, learner
        self._draws: list[Iterator[float]] = [_uniforms(one) for one in answers]
        self.policy: Policy = {}
        self.learned: Policy = learner.policy()
        self.updates = 0
        self.decisions = np.zeros((len(CASES), 2), int)

    def begin_block(self, block: ClosedBlock) -> None:
        """Begin a block: act by what was learned so far, or by ownership."""
        if self._model.afresh:
            self._learner.afresh()
        self.learned = self._learner.policy()
        if self._model.mode == "direct":
            self.policy.update(dict.fromkeys(SUBTASKS, 0.5))
        elif self._model.mode == "shadow":
            self.policy.update({s: float(s in block.owners.human) for s in SUBTASKS})
        else:
            self.policy.update(self.learned)

    def end_episode(self) -> None:
        """End an episode; of what is forgotten between two, the robot hears with the next move, as it does live."""
        self._learner.end_episode()
        self.learned = self._learner.policy()

    def hear(self, ahead: _Ahead | None) -> None:
        """Decide at the onset of a move; None at the path's last."""
        # All are drawn at every move, so that what one answer is does not depend on how many were taken before.
        answer, arrives, in_time = (next(one) for one in self._draws[:3])
        known = self.learned
        if self._model.mode == "direct":
            self.policy.update(dict.fromkeys(SUBTASKS, 0.5))
        if ahead is not None and ahead.step in SUBTASKS and arrives < self._model.teaches:
            said = self._learn(ahead, answer)
            if self._model.mode == "direct" and in_time < self._model.in_time:
                self.policy[ahead.step] = float(ahead.by_human != said)
        if self._model.mode == "closed":
            self.policy.update(self.learned if in_time < self._model.in_time else known)

    def perceive(self, choice: Choice) -> None:
        """Learn from whether the person is surprised by who makes a step, where that is decoded."""
        uniform = next(self._draws[3])
        if self._model.errp is None or not choice.drawn:
            return
        tpr, tnr = self._model.errp
        wrong = choice.drawn != choice.owner
        surprised = uniform < (tpr / 100.0 if wrong else 1.0 - tnr / 100.0)
        human = (choice.drawn == HUMAN) != surprised
        # Of a step by the robot, takeover means the human.
        self._learner.update(choice.step, before=ROBOT, takeover=human, log_odds=0.0)
        self.learned = self._learner.policy()
        self.updates += 1

    def _learn(self, ahead: _Ahead, answer: float) -> bool:
        by_human = ahead.by_human
        said = self._decoder.teach(
            self._learner, self._model.kind, ahead.step, answer, by_human=by_human,
            takeover=by_human != ahead.expects_human, turn=ahead.turn, error=False,
        )  # fmt: skip
        self.learned = self._learner.policy()
        self.updates += 1
        self.decisions[2 * by_human + ahead.humans, int(said)] += 1
        return said


def _uniforms(rng: np.random.Generator) -> Iterator[float]:
    while True:
        yield from rng.random(256).tolist()
