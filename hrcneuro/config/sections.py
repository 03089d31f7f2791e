"""The sections of a configuration that are no stages: of running a session, and of running jobs elsewhere."""

from __future__ import annotations

from hrcneuro.config.cluster import ClusterOptions, check_cluster
from hrcneuro.experiment.sections import SECTIONS as _SESSIONS
from hrcneuro.live.sections import Section

SECTIONS = {**_SESSIONS, "cluster": Section(ClusterOptions, check_cluster)}
