"""A laboratory's small study as a configuration: few short blocks at 128 Hz, for what a stage does from outside."""

from __future__ import annotations

import json


def text(*subjects, stages="", more=""):
    """Return the configuration; ``stages`` is a line of ``[study]``, ``more`` are further sections."""
    return f"""
[study]
name = "lab"
subjects = {json.dumps(subjects)}
exclude = []
{stages}

[acquire]
sfreq = 128.0

[acquire.session]
practice_episodes = 1
blocks = 4
episodes_per_block = 4

[acquire.eeg]
dipoles = 20

[preprocess]
sfreq = 128.0
{more}"""
