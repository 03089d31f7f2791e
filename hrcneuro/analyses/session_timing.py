"""How punctual a recorded session was: the links from command to trigger edge, each with its delay and jitter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.answers.words import number
from hrcneuro.eeg.latency import Estimate, Latency, drift_ppm, latency, nearest, slope
from hrcneuro.paradigm.markers import move_in

LINKS = {
    "command_motion_ms": "command to motion (Eq 2 fitted)",
    "motion_sent_ms": "start of the motion to marker sent",
    "marker_edge_ms": "marker to trigger edge in the EEG",
    "marker_end_ms": "marker to end point",
    "edge_end_ms": "trigger edge to end point",
}
"""Column of the table of moves -> what it is, in the order of the chain."""
EDGE = "marker_edge_ms"
_SAME_STAMP_S = 1e-3
_NAMED = 3


@dataclass(frozen=True)
class Link:
    """A link of the chain.

    Attributes:
        name: A column of the table of moves.
        latency: Of all moves, ms.
        by_duration: How it grows with the duration of a move, ms a second; NaN where durations are not known.
    """

    name: str
    latency: Latency
    by_duration: Estimate


@dataclass(frozen=True)
class SessionTiming:
    """What is known of a session's timing.

    Attributes:
        links: Those that were seen.
        drift: How much faster the amplifier's clock runs than the one that stamps the markers, parts in a million.
        moves: A row a marker; the columns of :data:`LINKS`, ``t_f_s``, ``marker_s``.
        without_edge: Markers beside which the trigger channel shows nothing.
        amp_delay: How much later the amplifier's stamps show something than it happened, ms: marker to edge less half
            the sampling interval, since an edge is first seen in the sample behind it. Where markers keep step with
            the samples, they may all lie anywhere within an interval: so much wider are the limits.
    """

    links: list[Link]
    drift: Estimate
    moves: pd.DataFrame
    without_edge: int
    amp_delay: Estimate

    @property
    def summary(self) -> dict[str, Any]:
        """All of it as JSON values but for the moves."""
        rows = {one.name: {**asdict(one.latency), "by_duration": asdict(one.by_duration)} for one in self.links}
        counts = {"markers": len(self.moves), "without_edge": self.without_edge}
        return {"links": rows, "drift_ppm": asdict(self.drift), "amp_delay_ms": asdict(self.amp_delay), **counts}


def session_timing(chain: pd.DataFrame, sfreq: float, driven: pd.DataFrame | None = None) -> SessionTiming:
    """Return what a recording tells of its timing.

    Args:
        chain: As :class:`hrcneuro.sources.chain.Chain` has it.
        sfreq: Nominal rate of the EEG, Hz.
        driven: Rows of the robot's moves.parquet of the same session, with ``lsl_s``; none where there are none.
    """
    moves = chain.copy()
    moves["marker_edge_ms"] = 1e3 * (moves["edge_s"] - moves["marker_s"])
    if "end_s" in moves:
        moves["marker_end_ms"] = 1e3 * (moves["end_s"] - moves["marker_s"])
        moves["edge_end_ms"] = 1e3 * (moves["end_s"] - moves["edge_s"])
    moves = _with_robot(moves, driven)
    t_f = moves["t_f_s"].to_numpy(float)
    links = []
    for name in LINKS:
        if name in moves and moves[name].notna().any():
            values = moves[name].to_numpy(float)
            links.append(Link(name, latency(values), slope(t_f, values)))
    # Each part, and what lies between two gaps, has samples of its own: over all, what is missing would be a drift.
    stretch = moves.groupby(["part", "segment"]).ngroup().to_numpy(int)
    drift = drift_ppm(moves["edge_sample"].to_numpy(float), moves["sent_s"].to_numpy(float), sfreq, stretch)
    return SessionTiming(links, drift, moves, int(moves["edge_s"].isna().sum()), _amp_delay(links, sfreq))


def _amp_delay(links: list[Link], sfreq: float) -> Estimate:
    found = next((one.latency.delay for one in links if one.name == EDGE), None)
    if found is None:
        return Estimate(np.nan, np.nan, np.nan)
    step = 1e3 / sfreq
    return Estimate(found.value - step / 2, found.low - step, found.high)


def is_of(driven: pd.DataFrame, moves: pd.DataFrame) -> bool:
    """Return whether a robot's record is of a session: a move of it was marked with the very stamp that was recorded.

    Args:
        driven: Rows of moves.parquet.
        moves: As :class:`hrcneuro.sources.chain.Chain` has them.
    """
    if "lsl_s" not in driven:
        return False
    stamps = np.sort(driven["lsl_s"].dropna().to_numpy(float))
    return bool((nearest(moves["sent_s"].to_numpy(float), stamps, window=_SAME_STAMP_S) >= 0).any())


def _with_robot(moves: pd.DataFrame, driven: pd.DataFrame | None) -> pd.DataFrame:
    """Return the moves with what the robot's own record says of each: duration, and its two links."""
    wanted = {"t_f_s": "t_f_s", "command_motion_ms": "trigger_latency_ms", "motion_sent_ms": "marker_latency_ms"}
    if driven is None or "lsl_s" not in driven:
        return moves.assign(t_f_s=np.nan)
    known = driven[driven["lsl_s"].notna()]
    keys = ["practice", "block", "episode", "trial"]
    of_move = {tuple(row[key] for key in keys): row for row in known.to_dict("records")}
    rows: list[Mapping[Any, Any]] = []
    for text, sent in zip(moves["marker"], moves["sent_s"], strict=True):
        named = move_in(text) or {}
        row = of_move.get(tuple(named.get(key) for key in keys), {})
        # The same move of another session has another stamp; the robot's machine may have a clock of its own.
        rows.append(row if row and abs(row["lsl_s"] - sent) < _SAME_STAMP_S else {})
    return moves.assign(**{to: [row.get(of, np.nan) for row in rows] for to, of in wanted.items()})


def verdict(timing: SessionTiming) -> str:
    """Return a sentence for a methods section."""
    edge = next((one for one in timing.links if one.name == EDGE), None)
    if edge is None:
        return "No trigger edges were recorded: the delay between markers and EEG is not known."
    of, delay = edge.latency, edge.latency.delay
    text = (
        f"Trigger edges in the EEG followed the markers of motion onset by {number(delay.value, 2)} ms (median of "
        f"{of.n:,}; 95 % CI {number(delay.low, 2)} to {number(delay.high, 2)} ms), with a jitter of SD "
        f"{number(of.sd, 2)} ms{_interval(of.jitter)} (99 % within {number(of.p99, 2)} ms of the median, worst "
        f"{number(of.worst, 2)} ms): an amplifier delay of {number(timing.amp_delay.value, 2)} ms "
        f"({number(timing.amp_delay.low, 2)} to {number(timing.amp_delay.high, 2)} ms, sampling included)"
    )
    if timing.drift.value == timing.drift.value:
        text += f"; the amplifier's clock ran {number(timing.drift.value, 2)} ± {number(timing.drift.half, 2)} ppm fast"
    grows = edge.by_duration
    if grows.value == grows.value:
        sign = "did not depend" if grows.low <= 0 <= grows.high else "depended"
        text += f"; the delay {sign} on the duration of the motion ({number(grows.value, 2)} ms/s)"
    return f"{text}."


def _interval(of: Estimate) -> str:
    return f", {number(of.low, 2)} to {number(of.high, 2)} ms" if of.low == of.low else ""


def without_edge_in_words(timing: SessionTiming) -> list[str]:
    """Return a sentence on the markers beside which the trigger channel shows nothing; none where it shows all."""
    if not timing.without_edge:
        return []
    lost = timing.moves[timing.moves["edge_s"].isna()]
    named = ", ".join(lost["marker"].iloc[:_NAMED]) + (", …" if len(lost) > _NAMED else "")
    return [f"{timing.without_edge} of {len(timing.moves)} markers have no trigger edge beside them: {named}"]


def rows_in_words(timing: SessionTiming) -> list[tuple[str, ...]]:
    """Return the links as a table: what, n, median, 95 % CI, SD, 99 %, worst, growth with the duration."""
    rows: list[tuple[str, ...]] = [("ms", "n", "median", "95 % CI", "SD", "99 % within", "worst", "ms per s of motion")]
    for one in timing.links:
        of, grows = one.latency, one.by_duration
        growth = "" if grows.value != grows.value else f"{number(grows.value, 2)} ± {number(grows.half, 2)}"
        interval = f"{number(of.delay.low, 2)} … {number(of.delay.high, 2)}"
        numbers = (number(value, 2) for value in (of.sd, of.p99, of.worst))
        rows.append((LINKS[one.name], f"{of.n:,}", number(of.delay.value, 2), interval, *numbers, growth))
    return rows
