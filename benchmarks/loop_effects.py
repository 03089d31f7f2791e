"""What decoders of different things teach a robot in the closed loop: synthetic people, whole sessions.

For each planted effect (``acquire.eeg.effect``), people are rehearsed in the study's session, errors and all, a decoder
is calibrated on it, and closed sessions follow, which have no errors: in ``shadow``, where each makes the own steps,
and in ``closed``. A row an effect and mode: what the robot knows in the end, the person's and the robot's directions
apart, beside what coin flips of the same rates give in the same loop, and beside decisions that are drawn independently
of the truth with the same P(takeover | actor of tr−1). Intervals are 95 %, over people where there are several: the
sessions of one share a decoder.

    python benchmarks/loop_effects.py --people 16 --sessions 4 --folder /somewhere    # 512 sessions; hours
    python benchmarks/loop_effects.py --people 1 --sessions 2 --effect none           # a look

    python benchmarks/loop_effects.py --effect anticipation --mode closed --picture loop.png --folder /somewhere
    python benchmarks/loop_effects.py --blocks 4 --effect anticipation --mode closed --folder /another  # fewer blocks

What a folder holds already is not done again.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from hrcneuro.analyses import loop_sessions as made
from hrcneuro.cli.rehearsing import SYNTHETIC
from hrcneuro.learning import loop_scores as scores
from hrcneuro.learning.learners import kinds
from hrcneuro.learning.loop import LoopModel
from hrcneuro.report.loop import chapter, null_of

EFFECTS = ("anticipation", "none", "post_error", "turn")
MODES = ("shadow", "closed")
COMMAND = [sys.executable, "-m", "hrcneuro"]


def rehearse(
    folder: Path, person: str, effect: str, mode: str, sessions: int, rate: int, jobs: int, blocks: int
) -> Path:
    """Return the folder of a person's closed sessions, which are run unless they have been."""
    done = folder / effect / mode / f"{person}.json"
    if not done.is_file():
        known = folder / effect / f"{person}.decoder"
        decoder = ["--decoder", known.read_text()] if known.is_file() else []
        settings = [
            f"acquire.eeg.effect={effect}", f"acquire.sfreq={rate}", f"preprocess.sfreq={rate}",
            f"record.streams.eeg.sfreq={rate}",
        ]  # fmt: skip
        if blocks:
            settings.append(f"calibrate.blocks={list(range(1, blocks + 1))}")
        words = [word for one in settings for word in ("--set", one)]
        told = subprocess.run(
            [*COMMAND, "rehearse", person, "--closed", "--mode", mode, "--sessions", str(sessions), "-j", str(jobs),
             "--json", "--no-figures", *decoder, *words, "--workdir", str(folder / effect)],
            check=True, stdout=subprocess.PIPE, text=True,
        ).stdout  # fmt: skip
        done.parent.mkdir(parents=True, exist_ok=True)
        done.write_text(told)
        if not decoder:
            (found,) = Path(json.loads(told)["folder"]).glob(f"cache/calibrate/{person}/*/decoder.json")
            known.write_text(str(found.parent))
    return Path(json.loads(done.read_text())["folder"])


def tables(folders: list[Path]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the steps and the episodes of all of them."""
    steps, episodes = (
        pd.concat([pd.read_parquet(one / f"loop_{name}.parquet") for one in folders]) for name in ("steps", "episodes")
    )
    return steps, episodes


def by_person(values: np.ndarray, people: np.ndarray, how: Callable[..., np.ndarray]) -> np.ndarray:
    """Return the mean or the sum over each person's sessions; the sessions themselves where all are of one."""
    names = list(dict.fromkeys(people))
    return values if len(names) == 1 else np.stack([how(values[people == one], axis=0) for one in names])


def row(effect: str, mode: str, folders: list[Path], picture: Path | None = None) -> str:
    """Return a row of the table; draw it, too, where a ``picture`` is named."""
    steps, episodes = tables(folders)
    played = made.loop_sessions(steps, episodes)
    people = episodes[["subject", "session"]].drop_duplicates()["subject"].to_numpy()
    counted = replace(played, decisions=by_person(played.decisions, people, np.sum))
    model = LoopModel(kinds(alpha=0.05, ddof=0, horizon=40)["paper"], 0.1, mode=mode)
    null = null_of(steps, episodes, model, sessions=1000, repetitions=100, seed=1)
    if picture is not None:
        chapter(steps, episodes, null, picture=picture, deadline_s=0.75, mode=mode, remark=SYNTHETIC)
    cells = []
    for rows in ("all", "human", "robot"):
        here = scores.mean_over_sessions(by_person(scores.accuracy(played, rows), people, np.mean))
        beside = [""] * 2
        if null is not None:
            flips = scores.expected_mean(scores.accuracy(null.null, rows), played.n_sessions)
            nothing = scores.mean_over_sessions(scores.accuracy(null.independent, rows))
            beside = [f"{100 * one.mean[-1]:.1f} ± {100 * one.half_width[-1]:.1f}" for one in (flips, nothing)]
        cells += [f"{100 * here.mean[-1]:.1f} ± {100 * here.half_width[-1]:.1f}", *beside]
    rates = scores.rates_by_case(counted)
    right = " ".join(f"{100 * one:.0f}" for one in rates.mean)
    said, true = scores.continuing(counted), scores.staying(counted)
    stays = " ".join(f"{100 * a:.0f}/{100 * b:.0f}" for a, b in zip(said.mean, true.mean, strict=True))
    return f"| {effect} | {mode} | {played.n_sessions} | {' | '.join(cells)} | {right} | {stays} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=8)
    parser.add_argument("--sessions", type=int, default=8, help="of each person, effect and mode")
    parser.add_argument("--effect", action="append", choices=EFFECTS)
    parser.add_argument("--mode", action="append", choices=MODES)
    parser.add_argument("--rate", type=int, default=250, help="sampling rate of the synthetic EEG, Hz")
    parser.add_argument("--jobs", type=int, default=0)
    parser.add_argument("--blocks", type=int, default=0, help="calibrate on so many of the main blocks; 0: all")
    parser.add_argument("--picture", type=Path, help="draw the last effect and mode that are asked for, as a PNG")
    parser.add_argument("--folder", type=Path, required=True)
    given = parser.parse_args()
    people = [f"s{number:02d}" for number in range(1, given.people + 1)]
    print("| effect | mode | sessions | all: accuracy, % | coin flips | independent | the person's | coin flips "
          "| independent | the robot's | coin flips | independent | right: RR RH HR HH, % "
          "| says / is 'stays' after robot, person, % |")  # fmt: skip
    print("|---" * 14 + "|", flush=True)
    for effect in given.effect or EFFECTS:
        for mode in given.mode or MODES:
            folders = [
                rehearse(
                    given.folder.absolute(), one, effect, mode, given.sessions, given.rate, given.jobs, given.blocks
                )
                for one in people
            ]
            print(row(effect, mode, folders, given.picture), flush=True)


if __name__ == "__main__":
    main()
