"""A simulated session, played into the log of an experiment on a clock of its own."""

from dataclasses import dataclass, fields

import numpy as np

from hrcneuro.experiment import opening
from hrcneuro.paradigm.conditions import EPISODE
from hrcneuro.paradigm.owners import DIRECTION_PAIRS, Areas, Directions, actor_of
from hrcneuro.paradigm.params import SessionParams
from hrcneuro.paradigm.partners import Move, robot_plan
from hrcneuro.paradigm.retrace import retrace
from hrcneuro.paradigm.session import protocol, simulate_session

SHORT = SessionParams(practice_episodes=1, blocks=4, episodes_per_block=2)
OPTIONS = {"seed": 7, "session": {"blocks": 4, "error_rate": 0.3}}


@dataclass
class Clock:
    """A clock that is set."""

    t: float = 1000.0

    def __call__(self):
        return self.t


def simulated(seed=1, params=SHORT):
    """Return the moves of a simulated session."""
    return simulate_session(params, rng=np.random.default_rng(seed))


def begun(folder, subject="s01", *, clock=None, resume=False, **options):
    """Open the log of a session at virtual pace, begun or resumed."""
    given = {"options": OPTIONS, "simulated": True, "real_time": False, "now": clock or Clock()} | options
    return (opening.resume if resume else opening.begin)(folder, subject, **given)


def play(log, trials, params=SHORT, *, clock=None, most=None, flush=True, cut=False):
    """Play the blocks that a log does not have, at most so many moves; return how many there were.

    ``cut``: the motion after these begins, and nobody sees its end.
    """
    study = retrace({"s": trials})
    paths = dict(
        zip(zip(*(study.episodes[name] for name in EPISODE), strict=True), study.episodes["path"], strict=True)
    )
    start = clock.t if clock else 1000.0
    moves = 0
    for block in protocol(params):
        if log.progress.done(block):
            continue
        log.block(block, owners_of(block, study))
        inside = trials[(trials["practice"] == block.practice) & (trials["block"] == block.number)]
        for number, rows in inside.groupby("episode", sort=False):
            log.episode(number, paths[block.practice, block.number, number])
            for row in rows.itertuples():
                onset = start + row.onset_s
                if row.executed and (moves != most or cut):
                    log.onset(row.trial, onset)
                if moves == most:
                    return moves
                if clock:
                    clock.t = onset + row.t_f_s
                log.move(move_of(row), onset=onset, t_f=row.t_f_s, ended=onset + row.t_f_s)
                moves += 1
            if flush:
                log.flush_table()
    return moves


def move_of(row):
    return Move(**{field.name: getattr(row, field.name) for field in fields(Move)})


def owners_of(block, study):
    """Return owners under which the moves of a block can have happened."""
    moves = study.moves[(study.moves["practice"] == block.practice) & (study.moves["block"] == block.number)]
    human = moves["actor"] == "human"
    if block.scenario == "sC":
        return Areas(frozenset(zip(*(moves[human][f"before_{name}"].tolist() for name in ("row", "col")), strict=True)))
    rows = list(zip(moves["actor"], moves["target"], moves["intended"], strict=True))
    return next(owners for owners in map(Directions, DIRECTION_PAIRS) if all(_fits(owners, *row) for row in rows))


def _fits(owners, actor, target, intended):
    if actor != actor_of(owners, (0, 0), target):
        return False
    return intended in owners.human if actor == "human" else intended == robot_plan(owners, target)
