"""The published logs (read once) and a simulated study of twelve subjects."""

from pathlib import Path

import numpy as np
import pytest

from hrcneuro.paradigm.session import SessionParams, simulate_session
from hrcneuro.sources.logs import read_log

LOGS = Path(__file__).parents[2] / "../shared/data/HRC_neurobased_taskplanning"
SUBJECTS = [f"s{number:02d}" for number in range(1, 13)]


@pytest.fixture(scope="session")
def logs():
    """Subject -> the moves of the published logs."""
    if not LOGS.is_dir():
        pytest.skip("the published logs are not at hand")
    return {subject: read_log(LOGS, subject) for subject in SUBJECTS}


@pytest.fixture(scope="session")
def study():
    """Subject -> the moves of a simulated study."""
    return {
        subject: simulate_session(SessionParams(), rng=np.random.default_rng([2023, *subject.encode()]))
        for subject in SUBJECTS
    }
