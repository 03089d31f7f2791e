"""The study's design (paper Table 1, § 2.3.2), as the defaults of every stage; values only."""

from hrcneuro import published

T_F_S = published.MOVE_S.value
"""Shortest and longest duration of a motion from tile to tile, seconds."""

MOVE = "move"
"""The event of a movement onset, in the trial table and in the recording."""

CASES = ("HH", "HR", "RR", "RH")
"""The actors of two successive moves: HR is a human's move followed by the robot's."""
CONDITIONS = {
    **{f"{case}_before": f"condition_before == '{case}'" for case in CASES},
    **{f"{case}_after": f"condition_after == '{case}'" for case in CASES},
    **{f"{case}_after_ok": f"condition_after == '{case}' and not error" for case in CASES},
}
CONTRASTS = {
    f"{plus}-{minus}_{position}": (f"{plus}_{position}", f"{minus}_{position}")
    for position in ("before", "after", "after_ok")
    for plus, minus in (("HR", "HH"), ("RH", "RR"))
}
CUES = ("prev_error", "turn")
"""Columns of the trial table that tell a takeover without EEG: the move before was an error, a turn lies ahead."""

# Letter, scenario, takeover, continuation, position.
FIG_2 = (
    ("A", "all", "HR", "HH", "before"),
    ("B", "all", "HR", "HH", "after"),
    ("C", "all", "RH", "RR", "before"),
    ("D", "all", "RH", "RR", "after"),
)
"""The panels of the paper's Fig 2."""
FIG_3 = (("A", "sC", "RH", "RR", "before"), ("B", "iC", "RH", "RR", "before"))
"""The panels of the paper's Fig 3."""

PROBLEMS = {"HHvsHR": ("HH_before", "HR_before"), "RRvsRH": ("RR_before", "RH_before")}
DECODED = {name: CONDITIONS[name] for pair in PROBLEMS.values() for name in pair}
"""The conditions that problems use."""
