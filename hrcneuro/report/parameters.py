"""What the paper prints and no result is: how the study was set up and what was chosen, and where this run says it."""

from __future__ import annotations

import string
from types import SimpleNamespace
from typing import Any, NamedTuple

from hrcneuro import published
from hrcneuro.published import Printed
from hrcneuro.report.results import Results

BY_DESIGN = "by design"  # fixed in the program: no run measures it, no setting changes it


class Given(NamedTuple):
    """A printed number that gets no verdict.

    Attributes:
        printed: The number.
        ours: A format string over the sections of the configuration and ``run``, the :mod:`facts` of this run; empty
            where the run has nothing to say, ``BY_DESIGN`` where it could say nothing else.
    """

    printed: Printed[Any]
    ours: str = ""


SETUP = (
    Given(published.PARTICIPANTS, "{run.subjects}"),
    Given(published.EXCLUDED, "{run.excluded}"),
    Given(published.ANALYSED, "{run.included}"),
    Given(published.WOMEN_MEN),
    Given(published.AGE),
    Given(published.LEFT_HANDED),
    Given(published.ETHICS_APPROVAL),
    Given(published.ARM_JOINTS, BY_DESIGN),
    Given(published.MONITOR_INCH),
    Given(published.TABLE_M),
    Given(published.SUBJECT_M),
    Given(published.VISUAL_ANGLE_DEG),
    Given(published.CONTROL_COMPUTER),
    Given(published.RECORDING_COMPUTER),
    Given(published.ELECTRODES, "{run.eeg} EEG + {run.eog} EOG"),
    Given(published.EOG_ELECTRODES, "{run.eog}"),
    Given(published.REFERENCES, "{run.reference}"),
    Given(published.TIMING_EXPERIMENTS),
    Given(published.SITUATIONS, BY_DESIGN),
    Given(published.CONDITIONS, "{run.conditions}"),
    Given(published.ASSUMED_TRIAL_S, "{simulate.trial_s} s"),
)

PARAMETERS = (
    Given(published.GRID_TILES, BY_DESIGN),
    Given(published.INNER_TILES, BY_DESIGN),
    Given(published.LEAST_STEPS, "{run.least_steps}"),
    Given(published.LEAST_TURNS, BY_DESIGN),
    Given(published.SCENARIOS, "{run.scenarios}"),
    Given(published.AREA_TILES, BY_DESIGN),
    Given(published.PARTNER_DIRECTIONS, BY_DESIGN),
    Given(published.ERROR_SHARE, "{run.error_rate}"),
    Given(published.NEAR_EDGE_M, "{robot.cell.near_edge:g} m"),
    Given(published.FAR_EDGE_M, "{run.far_edge}"),
    Given(published.SCREEN_HEIGHT_M, "{robot.cell.screen_height:g} m"),
    Given(published.HOVER_M, "{robot.cell.hover:g} m"),
    Given(published.GRID_EDGE_M, "{run.grid_edge}"),
    Given(published.TILE_M, "{robot.cell.tile:g} m"),
    Given(published.RADIUS_M, "{robot.cell.radius:g} m"),
    Given(published.POLYNOMIAL_ORDER, BY_DESIGN),
    Given(published.POLYNOMIAL, BY_DESIGN),
    Given(published.MOVE_S, "{robot.t_f_range_s[0]:g} to {robot.t_f_range_s[1]:g} s"),
    Given(published.LOOP_HZ, "{run.loop_hz}"),
    Given(published.EEG_CHANNELS, "{run.eeg}"),
    Given(published.RECORDED_HZ, "{run.source_sfreq}"),
    Given(published.PASS_BAND_HZ, "{preprocess.l_freq:g} to {preprocess.h_freq:g} Hz"),
    Given(published.KURTOSIS_SD, "{preprocess.threshold:g} SD"),
    Given(published.CLEAN_HZ, "{run.sfreq}"),
    Given(published.BLOCKS, "{run.blocks}"),
    Given(published.EPISODES_A_BLOCK, "{run.episodes}"),
    Given(published.PRACTICE, "{run.practice}"),
    Given(published.EPOCH_S, "{epoch.tmin:g} to {epoch.tmax:g} s"),
    Given(published.IMPLAUSIBLE_UV, "{epoch.reject_uv:g} µV"),
    Given(published.BASELINE_S, "{erp.baseline_s[0]:g} to {erp.baseline_s[1]:g} s"),
    Given(published.LEVEL, "{erp.alpha:g} (ERP), {ersp.alpha:g} (ERSP)"),
    Given(published.WAVELET_S, "{ersp.kernel_s:g} s"),
    Given(published.FREQUENCIES_HZ, "{ersp.low_hz:g} to {ersp.high_hz:g} Hz"),
    Given(published.FREQUENCY_STEP_HZ, "{ersp.step_hz:g} Hz"),
    Given(published.CYCLES, "{ersp.low_cycles:g} to {ersp.high_cycles:g}"),
    Given(published.MAGNITUDE_FACTOR, BY_DESIGN),
    Given(published.DECIMATION, "{ersp.decimate}"),
    Given(published.REMOVED_MEAN_S, "{decode.mean_window_s[0]:g} to {decode.mean_window_s[1]:g} s"),
    Given(published.SHORT_WINDOWS, "{run.short_windows}"),
    Given(published.LONG_WINDOWS, "{run.long_windows}"),
    Given(published.INTER_TRIAL_S, "{run.soa_range}"),
    Given(published.LAST_TIME_S, "{run.last_window}"),
    Given(published.COMPONENT_S),
    Given(published.FEATURES, "{run.features}"),
    Given(published.CLASSES, f"{BY_DESIGN}: 0 and 1"),
    Given(published.PROBLEMS, "{run.problems}"),
    Given(published.SHRINKAGE_RANGE, BY_DESIGN),
    Given(published.SHRINKAGE, "{decode.shrinkage:g}"),
    Given(published.REPEATS_FOLDS, "{decode.repeats} × {decode.folds}"),
    Given(published.DECODER_RATES, BY_DESIGN),
    Given(published.INITIAL_MEMORY, BY_DESIGN),
    Given(published.REWARD, BY_DESIGN),
    Given(published.ACTIONS, BY_DESIGN),
    Given(published.DRAWS, BY_DESIGN),
    Given(published.SIMULATIONS, BY_DESIGN),
    Given(published.SUBTASKS, "{simulate.subtasks}"),
    Given(published.CHOSEN, "{simulate.chosen}"),
    Given(published.LEARNING_RATE, "{simulate.alpha:g}"),
    Given(published.TEMPERATURE, "{simulate.tau:g}"),
    Given(published.EVENTS, "{simulate.events}"),
    Given(published.EPISODES, "{simulate.episodes}"),
    Given(published.REPETITIONS, "{simulate.repetitions}"),
    Given(published.LEVELS, "{run.levels}"),
    Given(published.REASSIGNED_AFTER, "{run.reassigned}"),
    Given(published.SUBTASK_CASES, "{run.test_cases}"),
    Given(published.CASE_OF_FIG_4D, "{run.test_cases}"),
    Given(published.SIM1_RATES, "{run.rates}"),
)


def fill(ours: str, results: Results, run: SimpleNamespace) -> str:
    """Return a format string of :class:`Given` with this run's values, or a dash for an empty one."""
    return _Words().format(ours, run=run, **results.settings.sections) if ours else "-"


class _Words(string.Formatter):
    """Formats lists and missing values as people write them."""

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, tuple | list):
            return ", ".join(f"{v:g}" if isinstance(v, float) else str(v) for v in value)
        return "-" if value is None else str(super().format_field(value, format_spec))
