"""The sections of a configuration that are about running a session, and are no stages."""

from __future__ import annotations

from hrcneuro.experiment import parameters
from hrcneuro.live.sections import SECTIONS as _STREAMS
from hrcneuro.live.sections import Section

SECTIONS = {**_STREAMS, "experiment": Section(parameters.ExperimentOptions, parameters.check_experiment)}
