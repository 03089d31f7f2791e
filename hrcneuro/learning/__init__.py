"""A robot that learns who does what from decoded anticipation (paper §3): Eq 3–6 and the simulations SIM1–4.

Read in this order: ``task`` (who does which subtask, and every random draw), ``decoder`` (what it says of each event),
``reference`` (Eq 3–6 for one repetition, word for word), ``learner`` (the same for many at once), ``simulations``
(SIM1–4) and ``milestones``. ``gaze`` and what is named after it are another robot, which learned with people: its
policy, the counts that its logs keep to themselves, and the partner who reads it.
"""
