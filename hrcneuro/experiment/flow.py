"""The flow of a session: blocks, episodes and moves, pauses and trouble; it knows no clock, no file and no window.

Whoever runs it hands in what happened, each with its time, and carries away what the arm, the window and the log are to
take. The next move of the robot, and of a simulated person, is decided at the onset of the one before, and goes to the
arm when the tool comes within its radius, so that the arm never waits for this process.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from hrcneuro.experiment import messages as m
from hrcneuro.experiment import scenes
from hrcneuro.experiment.ports import Log, Order, Pacing, Seen
from hrcneuro.experiment.turns import Turns
from hrcneuro.paradigm import markers
from hrcneuro.paradigm.grid import Tile
from hrcneuro.paradigm.session import DrawnBlock

ESCAPE_TWICE_S = 2.0
_LEAST_READ_S = 1.0
"""A key that is still meant for the last move must not take the words away."""


class Flow:
    """A session under way.

    Attributes:
        seen: For the experimenter.
        over: Nothing more will happen.
        wakes: When :meth:`tick` is to be called next, seconds; none: nothing is waited for.
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
        self._ending = self._gone = False
        self._resting = False  # the arm was asked for nothing that it has not done
        self._approached: Callable[[float], None] = self._next_block
        self._afresh: Callable[[float], None] = self._next_block  # how it goes on with an arm that was stopped
        self._block: DrawnBlock | None = None
        self._episodes: Iterator[Any] = iter(())
        self._escaped = float("-inf")
        self._now = 0.0  # of what happened last
        self._tool: m.Motion | None = None
        show(scenes.welcome())

    # --- what happens ---------------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Let what was waited for happen, if its time has come."""
        self._now = now
        if self.wakes is not None and now >= self.wakes:
            then, self.wakes, self._then = self._then, None, None
            if then is not None:
                then(now)

    def report(self, report: m.Report) -> None:
        """Take what the arm's side says."""
        self._now = report.when
        if isinstance(report, m.Health):
            self.seen.health = report
        elif isinstance(report, m.Ready):
            self._log.event("arm ready", report.when, lead_s=round(report.lead, 5))
            self._gone, self._resting = False, True
            self._gate(report.when, self._approached)
        elif isinstance(report, m.Arrived):
            self._resting = True
            self._gate(report.when, self._approached)
        elif isinstance(report, m.Onset):
            self._onset(report)
        elif isinstance(report, m.InRadius):
            if not (self._pause is not None or self._ending or self._turns.done):
                self._offer(report.when)
        elif isinstance(report, m.Executed):
            self._executed(report)
        elif isinstance(report, m.Halted):
            self._halted(report)
        elif isinstance(report, m.Ended):
            self.over = True

    def key(self, key: m.Key) -> None:
        """Take a key of the person's."""
        if key.name == "escape":
            if key.when - self._escaped <= ESCAPE_TWICE_S:
                self.end(key.when, "Esc was pressed twice")
            self._escaped = key.when
        elif key.name in ("N", "E", "S", "W"):
            if self._read is not None:
                if key.when >= self._read_from:
                    self._go_on(key.when)
                return
            ignored = self._turns.key(key)
            self.seen.keys[ignored] += 1
            self._log.key(key.name, ignored, key.when)
            self._mark(markers.of_key(self._turns.subject, key.name, ignored.replace(" ", "_")), key.when)
            if not ignored:
                self._release(key.when)

    def order(self, order: Order, now: float) -> None:
        """Take what the experimenter asks for."""
        if order is Order.END:
            self.end(now, "the experimenter ended it")
        elif order is Order.PAUSE:
            self.pause(now, "")
        elif self._gone:
            self._again(now)
        elif self._held is not None:
            self._log.event("goes on", now)
            held, self._held, self._pause = self._held, None, None
            self.seen.trouble = self.seen.cure = ""
            held(now)
        elif self._pause is not None:
            # Nothing was held yet: it is as if nobody had asked.
            self._pause = None
            self.seen.trouble = self.seen.cure = ""
        elif self._read is not None:
            self._go_on(now)

    def remark(self, text: str, now: float) -> None:
        """Write down what the experimenter remarks."""
        self._log.event("remark", now, text=text)

    def pause(self, now: float, why: str) -> None:
        """Pause as soon as the arm rests; ``why`` is empty where the experimenter asked for it."""
        if self._pause is not None or self._gone or self._ending:
            return
        self._pause = why
        self.seen.trouble = why
        self._log.event("pause", now, why=why)
        if self._resting and self._read is None and self._held is None:
            then = self._path_appears if self.seen.phase == "moves" else self._then
            self.wakes = self._then = None
            self._turns.close()
            self._hold(then or self._path_appears)

    def trouble(self, problem: str, cure: str) -> None:
        """Pause for something that a person must mend."""
        self.pause(self._now, problem)
        self.seen.trouble, self.seen.cure = problem, cure

    def end(self, now: float, why: str) -> None:
        """End the session as soon as the arm rests."""
        if self._ending:
            return
        self._ending = True
        self._log.event("ends early", now, why=why)
        if self._gone:
            self._finished()
        elif self._resting:
            self._finish()

    # --- blocks and episodes --------------------------------------------------------------------------------------

    def _next_block(self, now: float) -> None:
        self._block = next(self._blocks, None)
        if self._block is None:
            self.seen.whole = True
            self._log.event("session ends", now)
            self._finish()
            return
        self.seen.block, self.seen.episode = self._block, 0
        self._turns.begin_block(self._block)
        self._words(scenes.before(self._block), now, self._begin_block, share=0.5)

    def _begin_block(self, now: float) -> None:
        block = self._the_block
        self._log.block(block, now)
        about = block.block
        self._mark(
            markers.of_block(self._turns.subject, scenario=about.scenario, block=about.number, practice=about.practice),
            now,
        )
        self._episodes = block.episodes()
        self._next_episode(now)

    def _next_episode(self, now: float) -> None:
        episode = next(self._episodes, None)
        if episode is None:
            self._log.event("block ends", now)
            self.seen.blocks_done += 1
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
            self._mark(markers.of_episode(**self._turns.where), now)
        self.seen.phase = "moves"
        self._turns.prepare()
        self._show_grid()
        self._offer(now, wait_s=self._pacing.pause_s * self._turns.stretch())

    # --- moves ----------------------------------------------------------------------------------------------------

    def _offer(self, now: float, wait_s: float = 0.0) -> None:
        """Give the turn to whom it is: the robot's move goes to the arm, a simulated person's in its time."""
        after = self._turns.open(now, wait_s)
        if after is None:
            return
        if after <= now:
            self._release(now, not_before=now + wait_s)
        else:
            self._wait(after, self._pressed)

    def _pressed(self, now: float) -> None:
        key = self._turns.pressed
        self.seen.keys[""] += 1
        self._log.key(key, "", now)
        self._mark(markers.of_key(self._turns.subject, key), now)
        self._release(now)

    def _release(self, now: float, *, not_before: float = 0.0) -> None:
        self._resting = False
        self._arm(self._turns.release(not_before))

    def _onset(self, report: m.Onset) -> None:
        turn = self._turns.onset(report)
        self.seen.markers += report.marked == report.marked
        if turn.move.error:
            self._mark(markers.of_error(**self._turns.where, trial=turn.move.trial), report.when)
        self._tool = m.Motion(turn.go.start, turn.go.end, report.when, turn.go.t_f)
        if (truth := self._turns.prepare(report.when)) is not None:
            self._arm(truth)
        self._show_grid()

    def _executed(self, report: m.Executed) -> None:
        turn = self._turns.executed(report)
        self.seen.n_moves += 1
        self.seen.moves.append(turn)
        self._log.move(turn, report.when)
        self._resting = not self._turns.released
        if not self._resting:
            return
        if self._turns.done:
            self._gate(report.when, self._next_episode)
        elif self._pause is not None or self._ending:
            self.wakes = self._then = None
            self._turns.close()
            self._gate(report.when, self._path_appears)

    # --- pauses, trouble, the end ---------------------------------------------------------------------------------

    def _gate(self, now: float, then: Callable[[float], None]) -> None:
        """Go on with ``then``, unless a pause or the end was asked for: the arm rests."""
        if self._ending:
            self._finish()
        elif self._pause is not None:
            self._hold(then)
        else:
            then(now)

    def _hold(self, then: Callable[[float], None]) -> None:
        self.seen.phase = "pause"
        # After a pause among moves the path appears anew, and the person has time to see it.
        self._held = then
        self._show(scenes.pause(self._pause or ""))

    def _halted(self, report: m.Halted) -> None:
        self.seen.stops += 1
        self.seen.phase, self.seen.trouble, self.seen.cure = "the arm was stopped", report.problem, report.cure
        self._log.event("arm stopped", report.when, problem=report.problem, cure=report.cure, rests=report.rests)
        self._gone, self._resting, self._pause, self._held = True, False, None, None
        self.wakes = self._then = self._read = None
        self._turns.close()
        if self._ending or self.seen.whole:
            self._finished()
        else:
            self._show(scenes.trouble("The robot was stopped."))

    def _again(self, now: float) -> None:
        """Begin with the arm anew; a move that was under way is made again, from its start tile."""
        self._log.event("goes on", now)
        self.seen.trouble = self.seen.cure = ""
        self._gone, self._approached = False, self._afresh
        self._show(scenes.welcome())
        self._restart()

    def _episode_again(self, now: float) -> None:
        self._tool = None
        self._approach(self._turns.take_back(), self._arrived)

    def _finish(self) -> None:
        self._turns.close()
        self.wakes = self._then = self._read = None
        self.seen.phase = "the end"
        self._show(scenes.end() if self.seen.whole else scenes.ended_early())
        self._ending = True
        self._resting = False
        self._arm(m.Finish())

    def _finished(self) -> None:
        self._show(scenes.end() if self.seen.whole else scenes.ended_early())
        self.over = True

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
        self.seen.markers += 1
        self._arm(m.Mark(text, when))
