"""From a subject's trial log to the moves that the arm makes (paper § 2.3.1–2.3.2, behaviour.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hrcneuro.errors import ConfigError, DataError
from hrcneuro.robot.cell import GRID
from hrcneuro.robot.limits import MAX_SPEED
from hrcneuro.robot.workspace import Workspace

_STEP = {"N": (-1, 0), "S": (1, 0), "W": (0, -1), "E": (0, 1)}


@dataclass(frozen=True)
class Move:
    """One row of the log as the arm executes it."""

    scenario: str
    practice: bool
    block: int
    episode: int
    trial: int
    start: tuple[int, int]  # row, column
    end: tuple[int, int]
    first: bool  # of its episode
    t_f: float  # seconds
    gap: float  # onset to the next onset in the log, seconds; nan where unknown

    @property
    def dwells(self) -> bool:
        """Return whether the move was clamped at the grid's edge: the arm stays."""
        return self.start == self.end

    def marker(self, subject: str) -> str:
        """Return the text of the move's marker: tags between slashes, by which MNE selects epochs."""
        numbers = "/".join(f"{name}={getattr(self, name)}" for name in ("scenario", "block", "episode", "trial"))
        return f"move/subject={subject}/{numbers}" + ("/practice" if self.practice else "")


def select(trials: pd.DataFrame, *, blocks: Sequence[int], episodes: Sequence[int], practice: bool) -> pd.DataFrame:
    """Return the rows of the log that are replayed, in their order.

    Args:
        trials: A subject's trial table (design/artifacts.md).
        blocks, episodes: Numbers to keep; all where empty.
        practice: Whether the practice blocks are replayed too.

    Raises:
        DataError: No row is a move on the grid.
        ConfigError: Nothing is left of the selection.
    """
    moves = trials[trials["row"].notna() & trials["col"].notna()] if {"row", "col"} <= set(trials) else trials.iloc[:0]
    if moves.empty:
        raise DataError(
            f"no moves in the trial table ({len(trials)} rows without a grid position)",
            cure="the robot stage replays the grid study only; leave it out for other paradigms",
        )
    rehearsal = moves["practice"].fillna(False).astype(bool)
    if not practice:
        moves = moves[~rehearsal]
    for name, wanted in (("block", blocks), ("episode", episodes)):
        if not wanted:
            continue
        have = sorted({int(v) for v in moves[name]})
        unknown = sorted(set(wanted) - set(have))
        if unknown:
            raise ConfigError(
                f"robot.{name}s: {unknown} not in the log, which has {_ranges(have)}",
                cure=f"choose among them, or leave robot.{name}s empty for all",
            )
        moves = moves[moves[name].isin(list(wanted))]
    if moves.empty:
        raise ConfigError(
            "robot.blocks, robot.episodes and robot.practice leave no move to replay",
            cure="leave robot.blocks and robot.episodes empty, or set robot.practice = true",
        )
    return moves


def plan(moves: pd.DataFrame, *, t_f: float | None, t_f_range: tuple[float, float], default_t_f: float) -> list[Move]:
    """Return the moves in order. Durations: ``t_f``, else the log's t_f_s, else its soa_s clipped, else the default.

    Args:
        moves: Rows of :func:`select`.
        t_f: The duration of every move, seconds, or None.
        t_f_range: Least and greatest duration taken from soa_s, seconds.
        default_t_f: Where the log has no times at all, seconds.

    Raises:
        DataError: A row is off the grid or more than one tile from the row before.
    """
    nothing = np.full(len(moves), np.nan)
    known, soa = (moves[n].to_numpy(float, na_value=np.nan) if n in moves else nothing for n in ("t_f_s", "soa_s"))
    guess = np.where(np.isfinite(soa), np.clip(np.nan_to_num(soa), *t_f_range), default_t_f)
    length = np.where(np.isfinite(known), known, guess) if t_f is None else np.full(len(moves), t_f)
    columns = ["scenario", "practice", "block", "episode", "trial", "row", "col", "executed"]
    out: list[Move] = []
    before: tuple[object, ...] = ()
    for n, (scenario, practice, block, episode, trial, row, col, executed) in enumerate(
        moves[columns].itertuples(index=False, name=None)
    ):
        episode_of = (scenario, bool(practice), int(block), int(episode))
        end = (int(row), int(col))
        first = episode_of != before
        step = (0, 0) if pd.isna(executed) else _STEP[str(executed)]
        start = (end[0] - step[0], end[1] - step[1]) if first else out[-1].end
        name = f"block {block}, episode {episode}, trial {trial}"
        if not all(0 <= v < GRID for v in (*start, *end)):
            raise DataError(f"{name}: {start} → {end} leaves the 7 × 7 grid", cure="check acquire's trials.parquet")
        if abs(end[0] - start[0]) + abs(end[1] - start[1]) > 1:
            raise DataError(
                f"{name}: the log jumps from tile {start} to {end}; a move goes one tile",
                cure="the log lost a row: acquire the subject again",
            )
        out.append(Move(*episode_of, int(trial), start, end, first, float(length[n]), float(soa[n])))
        before = episode_of
    return out


def sampling_rate(trials: pd.DataFrame) -> float:
    """Return the rate of the recording that a trial table belongs to, Hz; nan where it belongs to none."""
    if not {"onset_s", "onset_sample"} <= set(trials):
        return float("nan")
    known = trials[["onset_s", "onset_sample"]].astype(float).dropna().to_numpy()
    if len(known) < 2 or known[-1, 0] <= known[0, 0]:
        return float("nan")
    seconds, samples = known[-1] - known[0]
    # Onsets that were rounded to the millisecond leave a rate that is off by some parts in a million.
    return float(np.round(samples / seconds, 2))


def check_durations(moves: Sequence[Move], workspace: Workspace, *, acceleration: float) -> None:
    """Refuse a duration in which a joint would have to run faster than it may.

    Args:
        moves: What is about to be replayed.
        workspace: Tells what each move asks of the joints.
        acceleration: The limit of every joint, rad/s².

    Raises:
        ConfigError: Names the move, the joint and the least duration.
    """
    shortest: dict[tuple[tuple[int, int], tuple[int, int]], float] = {}
    for move in moves:
        if not move.dwells:
            way = (move.start, move.end)
            shortest[way] = min(move.t_f, shortest.get(way, np.inf))
    if not shortest:
        return
    ways = list(shortest)
    t_f = np.array([shortest[w] for w in ways])[:, None]
    speed, bend = workspace.move_peaks(np.array([w[0] for w in ways]), np.array([w[1] for w in ways]))
    # A tenth is left to the feedback.
    need = np.maximum(speed / (0.9 * np.array(MAX_SPEED)), np.sqrt(bend / (0.9 * acceleration)))
    worst, joint = np.unravel_index(int(np.argmax(need / t_f)), need.shape)
    if need[worst, joint] > t_f[worst, 0]:
        seconds = t_f[worst, 0]
        raise ConfigError(
            f"t_f {seconds:g} s from tile {ways[worst][0]} to {ways[worst][1]} asks joint {joint + 1} for "
            f"{speed[worst, joint] / seconds:.2f} rad/s and {bend[worst, joint] / seconds**2:.1f} rad/s²; it may do "
            f"{MAX_SPEED[joint]:.2f} and {acceleration:g}",
            cure=f"robot.t_f_s of at least {np.ceil(100 * need.max()) / 100:.2f} s suits every move of the selection",
        )


def check_paths(moves: Sequence[Move], workspace: Workspace) -> None:
    """Refuse a session one of whose straight ways, moves and approaches, leads out of the box or near a singularity.

    Args:
        moves: What is about to be replayed, in order.
        workspace: Where the tiles are.

    Raises:
        ConfigError: Names the tiles, the place between them and what is wrong with it.
    """
    middle = (GRID // 2, GRID // 2)
    workspace.check_way(workspace.home_position(), workspace.position(*middle), near=workspace.home())
    ways, tile = [], middle
    for move in moves:
        ways += [(tile, move.start), (move.start, move.end)]
        tile = move.end
    distinct = np.array(list(dict.fromkeys((a, b) for a, b in ways if a != b))).reshape(-1, 2, 2)
    doubtful = distinct[workspace.doubtful(distinct[:, 0], distinct[:, 1])] if len(distinct) else distinct
    for start, end in ((tuple(a), tuple(b)) for a, b in doubtful.tolist()):
        try:
            workspace.check_way(workspace.position(*start), workspace.position(*end), near=workspace.reach.q[start])
        except ConfigError as error:
            raise ConfigError(f"from tile {start} to {end} {error.problem}", cure=error.cure) from error


def _ranges(numbers: Sequence[int]) -> str:
    dense = len(numbers) > 1 and list(numbers) == list(range(numbers[0], numbers[-1] + 1))
    return f"{numbers[0]} … {numbers[-1]}" if dense else ", ".join(map(str, numbers))
