"""From a subject's trial log to the moves that the arm makes (paper § 2.3.1–2.3.2, behaviour.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from hrcneuro.paradigm import markers
from hrcneuro.paradigm.grid import CENTRE, OPPOSITE, SIZE, Tile, beyond, distance, inside
from hrcneuro.robot.limits import MAX_SPEED
from hrcneuro.robot.parameters import Durations, Pace, Selection
from hrcneuro.robot.workspace import WayError, Workspace


@dataclass(frozen=True)
class PlannedMove:
    """One row of the log as the arm is to execute it."""

    scenario: str
    practice: bool
    block: int
    episode: int
    trial: int
    start: Tile
    end: Tile
    first: bool  # of its episode
    t_f: float  # seconds
    gap: float  # onset to the next onset in the log, seconds; nan where unknown

    @property
    def dwells(self) -> bool:
        """Return whether the move was clamped at the grid's edge: the arm stays."""
        return self.start == self.end

    def marker(self, subject: str) -> str:
        """Return the text of the move's marker: tags between slashes, by which MNE selects epochs."""
        names = ("scenario", "block", "episode", "trial", "practice")
        return markers.of_move(subject, **{name: getattr(self, name) for name in names})


class TooQuick(ValueError):
    """A move asks a joint for more than it may do; ``least_s`` is a duration that suits every move, seconds."""

    def __init__(self, problem: str, *, least_s: float) -> None:
        super().__init__(problem)
        self.least_s = least_s


def grid_moves(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of a subject's trial table (design/artifacts.md) that are moves on the grid, in their order.

    Raises:
        ValueError: There is none.
    """
    moves = trials[trials["row"].notna() & trials["col"].notna()] if {"row", "col"} <= set(trials) else trials.iloc[:0]
    if moves.empty:
        raise ValueError(f"no moves in the trial table ({len(trials)} rows without a grid position)")
    return moves


def select(moves: pd.DataFrame, selection: Selection) -> pd.DataFrame:
    """Return the rows of :func:`grid_moves` that are replayed, in their order.

    Raises:
        ValueError: A block or an episode is not in the log, or nothing is left of the selection.
    """
    if not selection.practice:
        moves = moves[~moves["practice"].fillna(False).astype(bool)]
    for name, wanted in (("block", selection.blocks), ("episode", selection.episodes)):
        if not wanted:
            continue
        have = sorted({int(v) for v in moves[name]})
        unknown = sorted(set(wanted) - set(have))
        if unknown:
            raise ValueError(f"{name}s: {unknown} not in the log, which has {_ranges(have)}")
        moves = moves[moves[name].isin(list(wanted))]
    if moves.empty:
        raise ValueError("blocks, episodes and practice leave no move to replay")
    return moves


def plan(moves: pd.DataFrame, durations: Durations) -> list[PlannedMove]:
    """Return the moves in order; a duration is the one given, else the log's t_f_s, else its soa_s clipped, else the
    default.

    Args:
        moves: Rows of :func:`select`.
        durations: What is given, the range of what soa_s is clipped to, and the default.

    Raises:
        ValueError: A row is off the grid or more than one tile from the row before.
    """
    nothing = np.full(len(moves), np.nan)
    known, soa = (moves[n].to_numpy(float, na_value=np.nan) if n in moves else nothing for n in ("t_f_s", "soa_s"))
    least, most = durations.t_f_range_s
    guess = np.where(np.isfinite(soa), np.clip(np.nan_to_num(soa), least, most), durations.t_f_default_s)
    length = np.where(np.isfinite(known), known, guess)
    if durations.t_f_s is not None:
        length = np.full(len(moves), durations.t_f_s)
    columns = ["scenario", "practice", "block", "episode", "trial", "row", "col", "executed"]
    out: list[PlannedMove] = []
    before: tuple[object, ...] = ()
    for n, (scenario, practice, block, episode, trial, row, col, executed) in enumerate(
        moves[columns].itertuples(index=False, name=None)
    ):
        episode_of = (scenario, bool(practice), int(block), int(episode))
        end = (int(row), int(col))
        first = episode_of != before
        back = end if pd.isna(executed) else beyond(end, OPPOSITE[str(executed)])
        start = back if first else out[-1].end
        name = f"block {block}, episode {episode}, trial {trial}"
        if not (inside(start) and inside(end)):
            raise ValueError(f"{name}: {start} → {end} leaves the {SIZE} × {SIZE} grid")
        if distance(start, end) > 1:
            raise ValueError(f"{name}: the log jumps from tile {start} to {end}; a move goes one tile")
        out.append(PlannedMove(*episode_of, int(trial), start, end, first, float(length[n]), float(soa[n])))
        before = episode_of
    return out


def evoking(moves: Sequence[PlannedMove], trials: pd.DataFrame) -> list[dict[str, object]]:
    """Return what each move evokes in a person who knows the log: its row's actor, errors, case and turn, plain values.

    Args:
        moves: What is replayed.
        trials: The subject's trial table.
    """
    names = ("actor", "error", "prev_error", "condition_before", "turn", "scenario")
    keys = ("practice", "block", "episode", "trial")
    rows = {tuple(row[key] for key in keys): row for row in trials.to_dict("records")}
    found = []
    for move in moves:
        row = rows[tuple(getattr(move, key) for key in keys)]
        plain = {name: row[name] for name in names}
        found.append({name: None if value != value or value is None else value for name, value in plain.items()})
    return found


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


def check_durations(moves: Sequence[PlannedMove], workspace: Workspace, *, acceleration: float) -> None:
    """Refuse a duration in which a joint would have to run faster than it may.

    Args:
        moves: What is about to be replayed.
        workspace: Tells what each move asks of the joints.
        acceleration: The limit of every joint, rad/s².

    Raises:
        TooQuick: With the move, the joint and the least duration.
    """
    shortest: dict[tuple[Tile, Tile], float] = {}
    for move in moves:
        if not move.dwells:
            way = (move.start, move.end)
            shortest[way] = min(move.t_f, shortest.get(way, np.inf))
    if not shortest:
        return
    ways = list(shortest)
    t_f = np.array([shortest[w] for w in ways])[:, None]
    qd, qdd = workspace.move_peaks(np.array([w[0] for w in ways]), np.array([w[1] for w in ways]))
    # A tenth is left to the feedback.
    need = np.maximum(qd / (0.9 * np.array(MAX_SPEED)), np.sqrt(qdd / (0.9 * acceleration)))
    # A way there and back ask the same: which of them is named must not hang on a processor's last digit.
    worst, joint = np.unravel_index(int(np.argmax(np.round(need / t_f, 9))), need.shape)
    if need[worst, joint] > t_f[worst, 0]:
        seconds = t_f[worst, 0]
        raise TooQuick(
            f"t_f {seconds:g} s from tile {ways[worst][0]} to {ways[worst][1]} asks joint {joint + 1} for "
            f"{qd[worst, joint] / seconds:.2f} rad/s and {qdd[worst, joint] / seconds**2:.1f} rad/s²; it may do "
            f"{MAX_SPEED[joint]:.2f} and {acceleration:g}",
            least_s=float(np.ceil(100 * need.max()) / 100),
        )


def check_paths(moves: Sequence[PlannedMove], workspace: Workspace) -> None:
    """Refuse a session one of whose straight ways, moves and approaches, leads out of the box or near a singularity.

    Args:
        moves: What is about to be replayed, in order.
        workspace: Where the tiles are.

    Raises:
        WayError: With the tiles, the place between them and what is wrong with it.
    """
    workspace.check_way(workspace.home_position(), workspace.position(*CENTRE), near=workspace.home())
    ways, tile = [], CENTRE
    for move in moves:
        ways += [(tile, move.start), (move.start, move.end)]
        tile = move.end
    distinct = np.array(list(dict.fromkeys((a, b) for a, b in ways if a != b))).reshape(-1, 2, 2)
    doubtful = distinct[workspace.doubtful(distinct[:, 0], distinct[:, 1])] if len(distinct) else distinct
    for start, end in ((tuple(a), tuple(b)) for a, b in doubtful.tolist()):
        try:
            workspace.check_way(workspace.position(*start), workspace.position(*end), near=workspace.reach.q[start])
        except WayError as error:
            raise WayError(error.flaw, f"from tile {start} to {end} {error}") from error


def expected_ends(moves: Sequence[PlannedMove], workspace: Workspace, pace: Pace) -> list[float]:
    """Return about when each move ends, seconds after the session's arm has come home and its lead is known."""
    ends, seconds, tile = [], 0.0, CENTRE
    for move in moves:
        if move.first:
            way = np.subtract(workspace.position(*tile), workspace.position(*move.start))
            seconds += pace.pause_s + float(np.linalg.norm(way)) / pace.approach_speed + 1.0
        gap = min(move.gap, pace.longest_gap_s) if np.isfinite(move.gap) else 0.0
        seconds += max(gap, move.t_f + 0.2)
        tile = move.end
        ends.append(seconds)
    return ends


def _ranges(numbers: Sequence[int]) -> str:
    dense = len(numbers) > 1 and list(numbers) == list(range(numbers[0], numbers[-1] + 1))
    return f"{numbers[0]} … {numbers[-1]}" if dense else ", ".join(map(str, numbers))
