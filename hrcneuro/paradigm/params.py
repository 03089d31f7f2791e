"""What can be set of a simulated session: protocol and partners, and when moves begin. Light to import."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro import published
from hrcneuro.contract import option
from hrcneuro.paradigm.design import T_F_S

START_NEXT = ("at_rest", "in_radius")


@dataclass(frozen=True)
class SessionParams:
    """The protocol and the partners of a session (paper §2.4); the defaults are the study's.

    ``wrong_key_rate`` and ``undo_rate`` None draw the subject's own (0.1 to 7 % of the keys; most errors taken back).
    A high ``wrong_key_rate`` falls short of its share: see :class:`~hrcneuro.paradigm.partners.Human`.
    Practice has fewer errors in the logs.
    """

    practice_episodes: int = option(
        published.PRACTICE.value[1], "episodes in each of the two practice blocks; 0 for none", low=0
    )
    blocks: int = option(published.BLOCKS.value, "main blocks; odd ones iC, even ones sC", low=1, high=99)
    episodes_per_block: int = option(published.EPISODES_A_BLOCK.value, "episodes in a main block", low=1)
    error_rate: float = option(
        published.ERROR_SHARE.value, "probability that a move after no error goes wrong", low=0, high=1, share=True
    )
    practice_error_rate: float = option(0.22, "the same in practice blocks", low=0, high=1, share=True)
    wrong_key_rate: float | None = option(
        None, "share of keys outside the target, roughly: from 0.05 on, less; none: drawn", low=0, high=1, share=True
    )
    undo_rate: float | None = option(
        None, "share of errors that the next key takes back; none: drawn", low=0, high=1, share=True
    )


@dataclass(frozen=True)
class ClosedParams:
    """The protocol of a session of closed blocks."""

    blocks: int = option(6, "closed blocks of a session", low=1, high=99, keyed=False)
    episodes_per_block: int = option(13, "episodes in a closed block", low=1, keyed=False)
    wait_s: float = option(
        2.0,
        "so long the robot waits for the person, where it has left a step to them that is its own",
        unit="s",
        low=0.1,
        high=60.0,
        keyed=False,
    )
    reassign: bool = option(
        False, "draw the person's two directions anew in each block; otherwise once a session", keyed=False
    )
    adapts: bool = option(
        False, "a simulated person comes to expect what the robot does; otherwise the own directions", keyed=False
    )


@dataclass(frozen=True)
class TimingParams:
    """When moves begin (paper §2.3.1), in seconds.

    The defaults give the published 876 ± 134 ms (sC) and 872 ± 131 ms (iC) from onset to onset. ``t_f`` is drawn anew
    for every move between ``t_f_min_s`` and ``t_f_max_s``, beta-distributed with ``t_f_mean_s`` and ``t_f_sd_s``. One
    t_f a session, as the paper may also be read, would spread the subjects' means so far that the published standard
    deviation left nothing to the moves.
    """

    t_f_min_s: float = option(T_F_S[0], "shortest motion", unit="s", low=0, open_low=True)
    t_f_max_s: float = option(T_F_S[1], "longest motion", unit="s", low=0, open_low=True)
    t_f_mean_s: float = option(0.82, "mean duration of a motion", unit="s", low=0, open_low=True)
    t_f_sd_s: float = option(0.12, "its standard deviation", unit="s", low=0)
    reaction_mean_s: float = option(0.23, "a human's mean reaction time", unit="s", low=0)
    reaction_sd_s: float = option(0.07, "its standard deviation", unit="s", low=0)
    soa_min_s: float = option(published.INTER_TRIAL_S.value[0], "shortest time from onset to onset", unit="s", low=0)
    start_next: str = option("at_rest", "when the next motion may start", choices=START_NEXT)
    lead_in_s: float = option(5.0, "recorded before the first move", unit="s", low=0)
    pause_s: float = option(1.5, "pause between episodes", unit="s", low=0)
    break_s: float = option(8.0, "break between blocks", unit="s", low=0)
