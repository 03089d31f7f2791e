"""Session logs in the layout of Ehrlich & Cheng 2018, of simulated people: what a test knows, it has planted."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hrcneuro.learning.gaze import STATES, TRIALS, GazeSession, uniform, update
from hrcneuro.learning.gaze_counts import looks
from hrcneuro.learning.gaze_partner import adapted, guess_probabilities

OBJECTS = ("left", "middle", "right")
_COLUMNS = [f"x{i}{j}" for j in range(STATES) for i in range(STATES)]


def walk(policy: np.ndarray, length: int, rng: np.random.Generator) -> np.ndarray:
    """Return how often a gaze that begins anywhere goes from where to where: ndarray, shape (4, 4), int."""
    counts, at = np.zeros((STATES, STATES), int), int(rng.integers(STATES))
    for _ in range(length):
        to = int(rng.choice(STATES, p=policy[at]))
        counts[at, to] += 1
        at = to
    return counts


def session(
    subject: str, run: int, *, seed: int, weight: float = 6.0, rate: float = 0.0, tnr: float = 0.9, tpr: float = 0.9
) -> tuple[GazeSession, np.ndarray]:
    """Return a session of a person with such a weight, and its true transitions, shape (50, 4, 4)."""
    rng = np.random.default_rng([seed, run])
    policy, all_counts, policies, right, error = uniform(), [], [], [], []
    w = np.array([weight])
    for _ in range(TRIALS):
        counts = walk(policy, int(rng.integers(4, 20)), rng)
        seen = looks(counts)[None]
        guessed = bool(rng.random() < guess_probabilities(w, seen)[0, 0])
        wrong = bool(rng.random() < (1 - tnr if guessed else tpr))
        w = adapted(w, seen, rate)
        policy = update(policy, counts, np.array(wrong))
        # As the logs have them: twelve digits, from which the next trial goes on with all of them.
        for kept, value in zip(
            (all_counts, policies, right, error), (counts, np.vectorize(rounded)(policy), guessed, wrong), strict=True
        ):
            kept.append(value)
    counted = np.stack(all_counts)
    made = GazeSession(subject, run, np.array(error), np.stack(policies), np.array(right), counted.sum(axis=(1, 2)))
    return made, counted


def rounded(value: float) -> float:
    """Return a probability with the twelve digits of a log."""
    return float(f"{value:.12g}")


def write_log(folder: Path, one: GazeSession) -> Path:
    """Write ``sNN_corlR_log``; run 3 without guesses and transitions, and counted from 0, as published."""
    unscored = one.run == 3
    names = ["Trial", "naoDecision", "errpDetector"]
    if not unscored:
        names = ["Trial", "nTrans", "naoDecision", "humanDecision", "guessCorr", "errpDetector"]
    lines = ["\t".join([*names, *_COLUMNS])]
    for trial in range(TRIALS):
        chosen = OBJECTS[trial % 3]
        right = bool(one.right[trial]) if one.right is not None else True
        cells = {
            "Trial": str(trial + (0 if unscored else 1)),
            "nTrans": "" if one.transitions is None else str(int(one.transitions[trial])),
            "naoDecision": chosen,
            "humanDecision": chosen if right else OBJECTS[(trial + 1) % 3],
            "guessCorr": str(int(right)),
            "errpDetector": "ERROR" if one.error[trial] else "noError",
        }
        policy = [f"{one.policies[trial, int(name[1]), int(name[2])]:.12g}" for name in _COLUMNS]
        lines.append("\t".join([*(cells[name] for name in names), *policy]))
    path = folder / f"{one.subject}_corl{one.run}_log"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def write_calibration(folder: Path, subject: str) -> Path:
    """Write ``sNN_calib_log``: three blocks with the policy that looks at the chosen object."""
    names = ["Block", "Trial", "nTrans", "naoDecision", "humanDecision", "guessCorr", "falseFeedback"]
    policy = ["0.85" if name[2] == "0" else "0.05" for name in _COLUMNS]
    rows = [[str(block), str(trial), "9", "left", "left", "1", "0"] for block in (1, 2, 3) for trial in range(1, 51)]
    lines = ["\t".join([*names, *_COLUMNS]), *("\t".join([*row, *policy]) for row in rows)]
    path = folder / f"{subject}_calib_log"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def write_study(folder: Path, *, subjects: int = 3) -> list[GazeSession]:
    """Write calibration and four runs of some people, better and worse decoders among them; return what is in them."""
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for i in range(subjects):
        name = f"s{i + 3:02d}"
        write_calibration(folder, name)
        for run in (1, 2, 3, 4):
            quality = (0.95, 0.7, 0.5)[i % 3]
            one, _ = session(name, run, seed=i, weight=4.0 + 3 * i, tnr=quality, tpr=quality)
            if run == 3:
                one = GazeSession(name, 3, one.error, one.policies, None, None)
            write_log(folder, one)
            made.append(one)
    return made
