"""Tiles, poses and the keep-inside box in the arm's frame, and whether the arm reaches them (paper § 2.3.1).

Row 0 is the subject's top row. The subject sits across from the arm, so it is the row next to the arm, and column 0,
the subject's left, lies to the arm's right. The arm looks along −x of its frame ``base``.
"""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hrcneuro.paradigm.grid import CENTRE, SIZE, distance, neighbours
from hrcneuro.robot import kinematics
from hrcneuro.robot.cell import Cell, Position
from hrcneuro.robot.limits import MAX_ANGLE, MAX_SPEED
from hrcneuro.robot.minimum_jerk import minimum_jerk

_SHARES = np.linspace(0.0, 1.0, 9)  # of a straight way, where it is looked at
# The tool points down (−z); its x axis looks back at the arm.
DOWN = np.diag([-1.0, 1.0, -1.0])


class Flaw(enum.Enum):
    """What a cell, or a way in it, asks of the arm that it cannot do."""

    NO_ROOM = enum.auto()  # the heights of tool and box contradict each other
    OUT_OF_BOX = enum.auto()
    OUT_OF_REACH = enum.auto()
    OUT_OF_RANGE = enum.auto()  # of a joint
    SINGULAR = enum.auto()


class CellError(ValueError):
    """The arm cannot work in the cell; ``flaw`` says in a word why."""

    def __init__(self, flaw: Flaw, problem: str) -> None:
        super().__init__(flaw, problem)
        self.flaw = flaw
        self.problem = problem

    def __str__(self) -> str:
        return self.problem


class WayError(CellError):
    """The tip cannot go a way."""


@dataclass(frozen=True)
class Reach:
    """How well the arm reaches every tile: arrays over (row, column)."""

    q: np.ndarray  # (7, 7, 6), radians
    singular_value: np.ndarray  # (7, 7), smallest of the Jacobian at the tool's tip
    condition: np.ndarray  # (7, 7)


class Workspace:
    """The study's grid in one cell."""

    def __init__(self, cell: Cell) -> None:
        """Place the grid and solve every tile.

        Raises:
            CellError: The box leaves no room, a tile is out of reach, or one lies too near a singularity.
        """
        self.cell = cell
        self.height, self.box = cell.height, cell.box
        if not cell.floor < cell.hover < cell.ceiling or not cell.floor < cell.home < cell.ceiling:
            raise CellError(
                Flaw.NO_ROOM,
                f"the tool hovers at {cell.hover} m and rests at {cell.home} m above the screen; the "
                f"keep-inside box reaches from {cell.floor} to {cell.ceiling} m",
            )
        self.reach = self._solve()
        self._peaks: dict[tuple[int, ...], tuple[np.ndarray, np.ndarray]] = {}  # of moves that were asked for

    def position(self, row: int, col: int) -> Position:
        """Return the tip's position over the centre of a tile."""
        return self.cell.position(row, col)

    def tile(self, position: Sequence[float] | np.ndarray) -> tuple[int, int]:
        """Return (row, column) of the tile nearest to a tip position (x, y, …) in ``base``."""
        row, col = self.cell.steps(float(position[0]), float(position[1]))
        return int(np.clip(np.rint(row), 0, SIZE - 1)), int(np.clip(np.rint(col), 0, SIZE - 1))

    def inside(self, position: Sequence[float] | np.ndarray) -> bool:
        """Return whether a tip position lies in the keep-inside box."""
        low, high = self.box
        return all(a <= float(v) <= b for a, v, b in zip(low, position, high, strict=True))

    def check_way(self, start: Sequence[float], end: Sequence[float], *, near: np.ndarray) -> None:
        """Refuse a straight way of the tip that leads out of the box or too near a singularity.

        Args:
            start, end: Tip positions (x, y, z) in ``base``, metres.
            near: Joint angles near the start, shape (6,).

        Raises:
            WayError: With the place and what is wrong with it.
        """
        if self._clear(start, end, near):
            return
        q = near
        for share in _SHARES:
            place = tuple((1 - share) * a + share * b for a, b in zip(start, end, strict=True))
            at = "({:.3f}, {:.3f}, {:.3f}) m".format(*place)
            if not self.inside(place):
                raise WayError(Flaw.OUT_OF_BOX, f"the way leads through {at}, outside the keep-inside box")
            try:
                q = kinematics.inverse(pose(place), q, tool=self.cell.tool)
            except kinematics.Unreachable as error:
                problem = f"the way leads through {at}, which the arm does not reach: {error}"
                raise WayError(Flaw.OUT_OF_REACH, problem) from error
            least = float(np.linalg.svd(kinematics.jacobian(q, tool=self.cell.tool), compute_uv=False)[-1])
            if least < self.cell.min_singular_value:
                raise WayError(
                    Flaw.SINGULAR,
                    f"the way leads through {at}, where the smallest singular value of the Jacobian is {least:.3f}; at "
                    f"least {self.cell.min_singular_value} is asked for",
                )

    def doubtful(self, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return which straight ways between tiles :meth:`check_way` must look at; the others are sound, shape (ways,).

        Args:
            starts: Tiles (row, column), shape (ways, 2).
            ends: The same for the ends.
        """
        # All tiles lie in the box, and a box is convex: what is left is the joints, all ways at once.
        first, last = (np.array([self.position(r, c) for r, c in tiles]) for tiles in (starts, ends))
        guess, goal = (self.reach.q[tiles[:, 0], tiles[:, 1]] for tiles in (starts, ends))
        return ~self._sound(first, last, guess, goal)

    def _clear(self, start: Sequence[float], end: Sequence[float], near: np.ndarray) -> bool:
        # The quick look, some milliseconds: an arm that stands at the start is watched by nobody meanwhile.
        if not (self.inside(start) and self.inside(end)):
            return False
        first, last = np.asarray(start, float), np.asarray(end, float)
        try:
            guess = kinematics.inverse(pose(first), near, tool=self.cell.tool)
            goal = kinematics.inverse(pose(last), guess, tool=self.cell.tool)
        except kinematics.Unreachable:
            return False
        return bool(self._sound(first[None], last[None], guess[None], goal[None])[0])

    def _sound(self, first: np.ndarray, last: np.ndarray, guess: np.ndarray, goal: np.ndarray) -> np.ndarray:
        # Of straight ways between positions (ways, 3) with the joint angles there (ways, 6): whether the arm follows
        # each of them clear of singularities, shape (ways,).
        share = _SHARES[:, None]
        targets = pose(first[:, None] + share * (last - first)[:, None])
        try:
            q = refine(guess[:, None] + share * (goal - guess)[:, None], targets, tool=self.cell.tool)
        except np.linalg.LinAlgError:
            return np.zeros(len(first), bool)
        off = np.abs(kinematics.pose_error(targets, kinematics.forward(q, tool=self.cell.tool))).max(axis=(1, 2))
        least = np.linalg.svd(kinematics.jacobian(q, tool=self.cell.tool), compute_uv=False)[..., -1].min(axis=1)
        return np.asarray((off < 1e-9) & (least >= self.cell.min_singular_value))

    def home(self) -> np.ndarray:
        """Return the joint angles of the home position above the grid's centre, shape (6,), radians.

        Raises:
            CellError: The arm does not reach it, or a joint does not turn so far.
        """
        above = pose(self.home_position())
        try:
            q = kinematics.inverse(above, self.reach.q[CENTRE], tool=self.cell.tool)
        except kinematics.Unreachable as error:
            problem = f"the arm does not reach its home, {self.cell.home} m above the screen: {error}"
            raise CellError(Flaw.OUT_OF_REACH, problem) from error
        _check_range(q, "at home")
        return q

    def home_position(self) -> Position:
        """Return the tip's home position above the grid's centre, (x, y, z) in ``base``, metres."""
        x, y, z = self.position(*CENTRE)
        return x, y, z - self.cell.hover + self.cell.home

    def move_peaks(self, starts: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the peaks of joint velocity and acceleration of minimum-jerk moves of one second, each (moves, 6).

        At another duration t_f they are 1 / t_f and 1 / t_f² of it.

        Args:
            starts: Tiles (row, column), shape (moves, 2).
            ends: The same for the ends.
        """
        ways = [(int(r), int(c), int(row), int(col)) for (r, c), (row, col) in zip(starts, ends, strict=True)]
        if new := [way for way in dict.fromkeys(ways) if way not in self._peaks]:
            tiles = np.array(new)
            self._peaks |= dict(zip(new, zip(*self._peaks_of(tiles[:, :2], tiles[:, 2:]), strict=True), strict=True))
        peaks = np.array([self._peaks[way] for way in ways]).reshape(-1, 2, 6)
        return peaks[:, 0], peaks[:, 1]

    def _peaks_of(self, starts: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u = np.linspace(0.0, 1.0, 101)
        s = minimum_jerk(u)[0][None, :, None]
        first, last = (np.array([self.position(r, c) for r, c in tiles])[:, None] for tiles in (starts, ends))
        guess, goal = (self.reach.q[tiles[:, 0], tiles[:, 1]][:, None] for tiles in (starts, ends))
        q = refine(guess + s * (goal - guess), pose(first + s * (last - first)), tool=self.cell.tool)
        qd = np.gradient(q, u, axis=1, edge_order=2)
        return np.abs(qd).max(axis=1), np.abs(np.gradient(qd, u, axis=1, edge_order=2)).max(axis=1)

    def speed_share(self, t_f: float) -> np.ndarray:
        """Return how much of a joint's greatest speed the moves from each tile take, the quickest joint: shape (7, 7).

        Args:
            t_f: Duration of the moves, seconds.
        """
        ways = [((r, c), end) for r, c in np.ndindex(SIZE, SIZE) for end in neighbours((r, c))]
        starts, ends = (np.array([way[i] for way in ways]) for i in (0, 1))
        speed, _ = self.move_peaks(starts, ends)
        share = np.zeros((SIZE, SIZE))
        np.maximum.at(share, tuple(starts.T), (speed / t_f / np.array(MAX_SPEED)).max(axis=1))
        return share

    def _solve(self) -> Reach:
        q = np.zeros((SIZE, SIZE, 6))
        seed = np.radians(self.cell.seed_deg)
        order = sorted(np.ndindex(SIZE, SIZE), key=lambda tile: (distance(tile, CENTRE), tile))
        for row, col in order:
            if (row, col) != CENTRE:
                # One step nearer to the centre, first along the column, is solved already.
                down, right = np.sign(np.subtract((row, col), CENTRE))
                seed = q[(row - down, col) if down else (row, col - right)]
            try:
                q[row, col] = kinematics.inverse(pose(self.position(row, col)), seed, tool=self.cell.tool)
            except kinematics.Unreachable as error:
                x, y, z = self.position(row, col)
                raise CellError(
                    Flaw.OUT_OF_REACH,
                    f"the arm does not reach tile ({row}, {col}), {np.hypot(x, y):.3f} m from its axis and "
                    f"{abs(z):.3f} m {'below' if z < 0 else 'above'} its base: {error}",
                ) from error
        for tile in order:
            _check_range(q[tile], f"over tile {tile}")
        values = np.linalg.svd(kinematics.jacobian(q, tool=self.cell.tool), compute_uv=False)
        reach = Reach(q, values[..., -1], values[..., 0] / values[..., -1])
        row, col = np.unravel_index(int(np.argmin(np.round(reach.singular_value, 9))), (SIZE, SIZE))
        if reach.singular_value[row, col] < self.cell.min_singular_value:
            raise CellError(
                Flaw.SINGULAR,
                f"on tile ({row}, {col}) the smallest singular value of the Jacobian is "
                f"{reach.singular_value[row, col]:.3f}; at least {self.cell.min_singular_value} is asked for",
            )
        return reach


@lru_cache(maxsize=2)
def workspace_of(cell: Cell) -> Workspace:
    """Return the grid in a cell, solved once for all sessions there.

    Raises:
        CellError: As of :class:`Workspace`.
    """
    return Workspace(cell)


def _check_range(q: np.ndarray, place: str) -> None:
    joint = int(np.argmax(np.abs(q)))
    if abs(q[joint]) > MAX_ANGLE:
        raise CellError(
            Flaw.OUT_OF_RANGE,
            f"{place} joint {joint + 1} would stand at {np.degrees(q[joint]):.0f}°; it turns to "
            f"±{np.degrees(MAX_ANGLE):.0f}°",
        )


def pose(position: np.ndarray | tuple[float, ...]) -> np.ndarray:
    """Return the poses at tip positions, shape (..., 3), with the tool pointing down: shape (..., 4, 4)."""
    position = np.asarray(position, float)
    full = np.zeros((*position.shape[:-1], 4, 4))
    full[..., :3, :3], full[..., :3, 3], full[..., 3, 3] = DOWN, position, 1.0
    return full


def refine(q: np.ndarray, targets: np.ndarray, *, tool: float) -> np.ndarray:
    """Return configurations (..., 6), three Newton steps from good guesses ``q`` towards ``targets`` (..., 4, 4)."""
    for _ in range(3):
        at, jacobian = kinematics.pose_and_jacobian(q, tool=tool)
        q = q + np.linalg.solve(jacobian, kinematics.pose_error(targets, at)[..., None])[..., 0]
    return q
