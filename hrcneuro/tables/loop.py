"""The tables of closed blocks: a row a step, a row an episode."""

from __future__ import annotations

from hrcneuro.io.tables import Column, Table
from hrcneuro.learning.online import SUBTASKS

_WHERE = {
    "subject": Column("category", "", "subject"),
    "session": Column("category", "", "session of the subject, by when it began"),
    "block": Column("int", "", "closed block, from 1"),
    "episode": Column("int", "", "episode in the block, from 1"),
}
LOOP_STEPS = Table(
    1,
    "one row a step of a closed block, as it was decided when keys opened; columns from predicted on tell of the "
    "decision at the onset of the move before, and are null at an episode's first step",
    {
        **_WHERE,
        "trial": Column("int", "", "move in the episode, from 0"),
        "step": Column("category", "", "direction of the step, of eight"),
        "owner": Column("category", "", "whose it is by the person's choice; of a diagonal the robot's"),
        "drawn": Column("category", "", "whom the robot drew from its policy; null on a diagonal"),
        "actor": Column("category", "", "who made it"),
        "taken": Column("bool", "", "the robot took a step that is the person's"),
        "left": Column("bool", "", "the robot left a step lying that is its own, and made it later"),
        "human": Column("float", "", "the policy's probability that the robot leaves it to the person, when drawn"),
        "before": Column("category", "", "who made the move before, tr-1; null at an episode's first step"),
        "expected_case": Column(
            "category",
            "",
            "who made tr-1, and whose this step is: HH, HR, RR, RH; null where before is, and on a diagonal",
        ),
        "predicted": Column("category", "", "who was decided to be expected; null where nothing was decided"),
        "score": Column("float", "", "discriminant, positive where takeover is decided"),
        "probability": Column("float", "", "calibrated probability of a takeover"),
        "update": Column("bool", "", "the learner took the decision"),
        "cause": Column("category", "", "why not, see the closed loop's causes; null where it did"),
        "deadline_met": Column("bool", "", "it was decided before the deadline"),
        "in_time_for_tr": Column("bool", "", "it was taken up when keys opened for this step"),
        "onset_to_received_ms": Column("float", "ms", "onset of tr-1 until its last sample was received"),
        "onset_to_decided_ms": Column("float", "ms", "the same until it was decided"),
        "onset_to_sent_ms": Column("float", "ms", "the same until that was sent"),
        "onset_to_taken_up_ms": Column("float", "ms", "the same until the robot's side took it up"),
    },
)
LOOP_EPISODES = Table(
    1,
    "one row an episode of a closed block: what the robot has learned when it ends",
    {
        **_WHERE,
        "number": Column("int", "", "episode of the session, from 1"),
        "arrived": Column("bool", "", "it came to its goal; false where it was broken off"),
        "updates": Column("int", "", "answers that the learner has taken since the session began"),
        **{
            f"human_{one}": Column("float", "", f"policy: probability that the robot leaves a step {one} to the person")
            for one in SUBTASKS
        },
        **{f"owner_{one}": Column("category", "", f"whose steps {one} are by the person's choice") for one in SUBTASKS},
    },
)
