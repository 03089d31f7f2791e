"""The session logs of Ehrlich & Cheng 2018, as their public repository has them: tab-separated, a row a trial."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hrcneuro.errors import DataError
from hrcneuro.learning.gaze import STATES, TRIALS, UNSCORED_RUN, GazeSession
from hrcneuro.learning.gaze_counts import follows
from hrcneuro.sources import gaze_layout
from hrcneuro.sources.pointers import refuse_pointer

POLICY = tuple(f"x{i}{j}" for i in range(STATES) for j in range(STATES))
"""p(next state j | state i) after the trial, row by row; the logs have these columns in another order."""
_OBJECTS = ("left", "middle", "right")
_CLOSED = ("Trial", "nTrans", "naoDecision", "humanDecision", "guessCorr", "errpDetector")
_UNSCORED = ("Trial", "naoDecision", "errpDetector")
_CALIBRATION = ("Block", "Trial", "nTrans", "naoDecision", "humanDecision", "guessCorr", "falseFeedback")
_BLOCKS = 3  # of TRIALS trials each, in a calibration
_ALLOWED = {
    "naoDecision": _OBJECTS,
    "humanDecision": _OBJECTS,
    "errpDetector": ("noError", "ERROR"),
    "guessCorr": ("0", "1"),
    "falseFeedback": ("0", "1", "2"),
}
_ROUNDING = 1e-9  # how far a row's sum may be from 1: the logs have twelve digits


def read_sessions(folder: str | Path) -> list[GazeSession]:
    """Return the closed sessions of a folder, sorted by subject and run. Calibrations are checked, too.

    Raises:
        DataError: The folder holds none (:func:`hrcneuro.sources.gaze_layout.log_files`), or a log is not as published:
            its columns, its number of trials, a word, a policy that is none, or one that no gaze transitions make of
            the policy before it by what the decoder said.
    """
    sessions = []
    for label, path in gaze_layout.log_files(folder).items():
        subject, _, kind = label.partition(" ")
        if kind == "calib":
            _policies(path, _table(path, _CALIBRATION, _BLOCKS * TRIALS))
        else:
            sessions.append(_session(path, subject, int(kind[-1])))
    return sessions


def _session(path: Path, subject: str, run: int) -> GazeSession:
    scored = run != UNSCORED_RUN
    table = _table(path, _CLOSED if scored else _UNSCORED, TRIALS)
    right = table["guessCorr"] == "1" if scored else None
    if right is not None:
        same = table["naoDecision"] == table["humanDecision"]
        _refuse(path, "guessCorr", same == right, table["guessCorr"], "1 where both decisions are the same, else 0")
    session = GazeSession(
        subject=subject,
        run=run,
        error=table["errpDetector"] == "ERROR",
        policies=_policies(path, table),
        right=right,
        transitions=table["nTrans"].astype(int) if scored else None,
    )
    _refuse_altered(path, session)
    return session


def _refuse_altered(path: Path, session: GazeSession) -> None:
    """Refuse a session whose learner cannot be followed from trial to trial, as that of every published log can."""
    followed = follows(session.before, session.policies, session.error)
    if followed.all():
        return
    at = int(np.flatnonzero(~followed)[0])
    said, other = ("ERROR", "noError") if session.error[at] else ("noError", "ERROR")
    alike = f"{int((~followed).sum())} of {len(followed)} rows are so"
    turned = follows(session.before[[at]], session.policies[[at]], ~session.error[[at]])[0]
    raise DataError(
        f"{path.name}, row {at + 1}: errpDetector is {said!r}, but no gaze transitions make its policy of the one "
        f"before{f'; with {other!r} they would' * bool(turned)}; {alike}; allowed: none, as in every published log",
        cure=f"copy it again from {gaze_layout.REPOSITORY}; a log that was edited is no evidence",
    )


def _table(path: Path, columns: Sequence[str], trials: int) -> dict[str, np.ndarray]:
    """Return column -> cells as text, shape (n_trials,), of a log whose words and whole numbers have been checked."""
    refuse_pointer(path)
    try:
        lines = [line.split("\t") for line in path.read_text(encoding="utf-8").splitlines()]
    except UnicodeDecodeError as error:
        raise DataError(f"{path.name} is no text", cure=gaze_layout.CURE) from error
    head, rows = (lines[0], lines[1:]) if lines else ([], [])
    missing = [name for name in (*columns, *POLICY) if name not in head]
    others = [name for name in head if name not in (*columns, *POLICY) or head.count(name) > 1]
    if missing or others:
        flaws = [f"lacks {_few(missing)}"] * bool(missing) + [f"has {_few(others)}, which it should not"] * bool(others)
        raise DataError(
            f"{path.name} {' and '.join(flaws)}; expected columns: {', '.join(columns)} and x00 to x33, tab-separated",
            cure=f"{gaze_layout.CURE}; the logs of another study, or of another version, are not evidence here",
        )
    uneven = next((i for i, row in enumerate(rows, 1) if len(row) != len(head)), None)
    if uneven or len(rows) != trials:
        flaw = f"row {uneven} has {len(rows[uneven - 1])} cells of {len(head)}" if uneven else f"{len(rows)} trials"
        raise DataError(
            f"{path.name}: {flaw}; a whole session has {trials} trials, of as many cells each as its first line",
            cure=f"copy it again from {gaze_layout.REPOSITORY}: it seems to be cut off or put together",
        )
    table = {name: np.array(cells) for name, cells in zip(head, zip(*rows, strict=True), strict=True)}
    for name in columns:
        if name in _ALLOWED:
            _refuse(path, name, np.isin(table[name], _ALLOWED[name]), table[name], ", ".join(_ALLOWED[name]))
        else:
            whole = np.array([re.fullmatch(r"[0-9]{1,6}", cell) is not None for cell in table[name]])
            _refuse(path, name, whole, table[name], "a whole number")
    trial = table["Trial"].astype(int)
    counted = np.arange(trials) % TRIALS + min(int(trial[0]), 1)
    _refuse(path, "Trial", trial == counted, table["Trial"], "trials counted from the first")
    return table


def _policies(path: Path, table: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the policy after each trial: ndarray, shape (n_trials, 4, 4)."""
    for name in POLICY:
        fits = np.array([0.0 <= _float(cell) <= 1.0 for cell in table[name]])
        _refuse(path, name, fits, table[name], "a probability")
    policies = np.stack([table[name].astype(float) for name in POLICY], axis=1).reshape(-1, STATES, STATES)
    sums = policies.sum(axis=2)
    for state in range(STATES):
        given = np.array([f"{one:.6g} in all" for one in sums[:, state]])
        even = np.abs(sums[:, state] - 1.0) < _ROUNDING
        _refuse(path, f"x{state}0 to x{state}3", even, given, "a row that sums to 1")
    return policies


def _float(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")


def _refuse(path: Path, name: str, fits: np.ndarray, given: np.ndarray, allowed: str) -> None:
    if not fits.all():
        at = int(np.flatnonzero(~fits)[0])
        raise DataError(
            f"{path.name}, row {at + 1}: {name} is {str(given[at])!r}; allowed: {allowed}",
            cure=f"copy it again from {gaze_layout.REPOSITORY}; a log that was edited is no evidence",
        )


def _few(names: Sequence[str]) -> str:
    return f"{', '.join(names[:4])}{' …' if len(names) > 4 else ''}"
