"""The course of a session while nothing interrupts it: blocks, episodes, and the moves in them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from hrcneuro.experiment import messages as m
from hrcneuro.experiment import rows, scenes
from hrcneuro.experiment.ports import Log, Pacing, Seen
from hrcneuro.experiment.turns import Turns
from hrcneuro.paradigm import markers
from hrcneuro.paradigm.grid import Tile
from hrcneuro.paradigm.session import DrawnBlock
from hrcneuro.sources import experiments

_LEAST_READ_S = 1.0
"""A key that is still meant for the last move must not take the words away."""


class Course(ABC):
    """What comes after what; :class:`~hrcneuro.experiment.flow.Flow` interrupts it.

    Attributes:
        seen: For the experimenter.
        over: Nothing more will happen.
        wakes: When ``tick`` is to be called next, seconds; none: nothing is waited for.
    """

    def __init__(
        self,
        blocks: Sequence[DrawnBlock],
        turns: Turns,
        pacing: Pacing,
        *,
        arm: Callable[[m.Request], None],
        restart: Callable[[], None],
        show: Callable[[m.Scene], None],
        log: Log,
    ) -> None:
        """Begin; the arm is awaited.

        Args:
            blocks: What is left of the session.
            turns: Whose turn it is, and what becomes of it.
            pacing: What is waited for.
            arm, show, log: Who takes requests, scenes and what is written down.
            restart: Begins with the arm anew, after it was stopped.
        """
        self.seen = Seen()
        self.over = False
        self.wakes: float | None = None
        self._blocks, self._turns, self._pacing = iter(blocks), turns, pacing
        self._arm, self._restart, self._show, self._log = arm, restart, show, log
        self._then: Callable[[float], None] | None = None  # at ``wakes``
        self._read: Callable[[float], None] | None = None  # once somebody has read the words
        self._read_from = 0.0
        self._held: Callable[[float], None] | None = None  # how a pause goes on
        self._pause: str | None = None
        self._unoffered = False  # the turn after the move under way, because of a pause that may yet be taken back
        self._wrong: tuple[str, str] | None = None  # that nobody has paused for yet, and its cure
        self._ending = self._gone = False
        self._resting = False  # the arm was asked for nothing that it has not done
        self._approached: Callable[[float], None] = self._next_block
        self._afresh: Callable[[float], None] = self._next_block  # how it goes on with an arm that was stopped
        self._block: DrawnBlock | None = None
        self._episodes: Iterator[Any] = iter(())
        self._escaped = float("-inf")
        self._tool: m.Motion | None = None
        show(scenes.welcome())

    # --- blocks and episodes --------------------------------------------------------------------------------------

    def _next_block(self, now: float) -> None:
        self._block = next(self._blocks, None)
        if self._block is None:
            self.seen.whole = True
            self._log.event("session ends", now)
            self._finish(now)
            return
        self.seen.block, self.seen.episode = self._block, 0
        self._turns.begin_block(self._block)
        self._words(scenes.before(self._block), now, self._begin_block, share=0.5)

    def _begin_block(self, now: float) -> None:
        block = self._the_block
        self._log.block(block, now)
        about = block.block
        self._mark(
            markers.of_block(
                self._turns.subject,
                scenario=about.scenario,
                block=about.number,
                practice=about.practice,
                closed=block.closed,
            ),
            now,
        )
        self._episodes = block.episodes()
        self._next_episode(now)

    def _next_episode(self, now: float) -> None:
        episode = next(self._episodes, None)
        if episode is None:
            self._turns.close()
            if self.seen.blocks_done == self._turns.n_blocks:
                self._next_block(now)
            else:
                self._words(scenes.rest(), now, self._next_block, share=0.5)
            return
        self.seen.episode += 1
        self._turns.begin_episode(episode, self.seen.episode)
        self._log.episode(self.seen.episode, episode.path, now)
        self._tool = None
        self._afresh = self._episode_again
        self._approach(episode.path[0], self._arrived)

    def _approach(self, tile: Tile, then: Callable[[float], None]) -> None:
        self.seen.phase = "the arm goes to the start tile"
        self._approached, self._resting = then, False
        self._show(scenes.grid(self._the_block, tool=self._drawn(tile)))
        self._arm(m.Approach(tile))

    def _arrived(self, now: float) -> None:
        self._wait(now + self._pacing.path_after_s, self._path_appears)

    def _path_appears(self, now: float) -> None:
        if not self._turns.episode.moves:
            self._mark(markers.of_episode(**self._turns.where, closed=self._the_block.closed), now)
        self.seen.phase = "moves"
        self._prepare()
        self._show_grid()
        self._offer(now, wait_s=self._pacing.pause_s * self._turns.stretch())

    def _episode_again(self, now: float) -> None:
        self._tool = None
        tile = self._turns.take_back()
        if self._turns.done:
            self._next_episode(now)
        else:
            self._approach(tile, self._arrived)

    # --- moves ----------------------------------------------------------------------------------------------------

    def _offer(self, now: float, wait_s: float = 0.0) -> None:
        """Give the turn to whom it is: the robot's move goes to the arm, a simulated person's in its time."""
        after = self._turns.open(now, wait_s)
        if (chosen := self._turns.chosen()) is not None:
            self._log.event(experiments.CHOICE, now, **chosen)
            self.seen.taken += rows.is_taken(chosen)
            self.seen.left += rows.is_left(chosen)
            if self._pacing.show_turn:
                # Only now it is known whose turn it is.
                self._show_grid()
        self._tell_truths()
        if after is None:
            return
        if after <= now:
            self._release(now, not_before=now + wait_s)
        else:
            self._wait(after, self._due)

    def _due(self, now: float) -> None:
        """Let a move begin whose time has come; a simulated person presses for it."""
        if self._turns.next_actor == "human":
            key = self._turns.pressed
            self.seen.keys[""] += 1
            self._log.key(key, "", now)
            self._mark(markers.of_key(self._turns.subject, key), now)
        self._release(now)

    def _prepare(self, onset: float = math.nan) -> None:
        self._turns.prepare(onset)
        self._tell_truths()

    def _tell_truths(self) -> None:
        for truth in self._turns.truths():
            self._arm(truth)

    def _release(self, now: float, *, not_before: float = 0.0) -> None:
        self._resting = False
        self._arm(self._turns.release(not_before))

    def _onset(self, report: m.Onset) -> None:
        turn = self._turns.onset(report)
        # Where the grid's edge stops the move, nothing begins that a marker could tell of.
        if turn.go.start != turn.go.end:
            self.seen.markers += self._pacing.marks
            self._log.onset(turn)
        if turn.move.error:
            self._mark(markers.of_error(**self._turns.where, trial=turn.move.trial), report.when)
        self._tool = m.Motion(turn.go.start, turn.go.end, report.when, turn.go.t_f)
        self._prepare(report.when)
        self._show_grid()

    def _executed(self, report: m.Executed) -> None:
        turn = self._turns.executed(report)
        self.seen.n_moves += 1
        self.seen.unheard += 1
        self.seen.moves.append(turn)
        self._log.move(turn, report.when)
        self._resting = not self._turns.released
        if not self._resting:
            return
        if self._turns.done:
            self.seen.blocks_done += self.seen.episode == self._the_block.block.episodes
            self._gate(report.when, self._next_episode)
        elif self._pause is not None or self._ending:
            self.wakes = self._then = None
            self._turns.close()
            self._gate(report.when, self._path_appears)

    # --- where it can be interrupted ------------------------------------------------------------------------------

    def _gate(self, now: float, then: Callable[[float], None]) -> None:
        """Go on with ``then``, unless a pause or the end was asked for: the arm rests."""
        if self._ending:
            self._finish(now)
        elif self._pause is not None:
            self._hold(then)
        else:
            then(now)

    @abstractmethod
    def _hold(self, then: Callable[[float], None]) -> None:
        """Pause at rest; ``then`` is how it goes on."""

    @abstractmethod
    def _finish(self, now: float) -> None:
        """Let the arm go, and end."""

    # --- small things ---------------------------------------------------------------------------------------------

    @property
    def _the_block(self) -> DrawnBlock:
        assert self._block is not None
        return self._block

    def _words(self, scene: m.Scene, now: float, then: Callable[[float], None], *, share: float) -> None:
        self.seen.phase = scene.title.lower()
        self._show(scene)
        self._read, self._read_from = then, now + _LEAST_READ_S
        self._afresh = lambda when: self._words(scene, when, then, share=share)
        if self._turns.simulated:
            self._wait(now + share * self._pacing.break_s * self._turns.stretch(), self._go_on)

    def _go_on(self, now: float) -> None:
        then, self._read = self._read, None
        self.wakes = self._then = None
        if then is not None:
            self._gate(now, then)

    def _wait(self, until: float, then: Callable[[float], None]) -> None:
        self.wakes, self._then = until, then

    def _show_grid(self) -> None:
        turns = self._turns
        turn = turns.next_actor if self._pacing.show_turn else ""
        self._show(scenes.grid(self._the_block, path=turns.episode.path, turn=turn, tool=self._drawn(turns.tile)))

    def _drawn(self, tile: Tile) -> m.Motion | None:
        if not self._pacing.draw_tool:
            return None
        return self._tool or m.Motion(tile, tile, 0.0, 1.0)

    def _mark(self, text: str, when: float) -> None:
        self.seen.markers += self._pacing.marks
        self._arm(m.Mark(text, when))
