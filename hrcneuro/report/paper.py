"""Every number that the paper prints and that is no result: how the study was set up, and what was chosen.

Ehrlich et al. 2023, PLoS ONE 18(7) e0287958, doi:10.1371/journal.pone.0287958. Results are in ``published.py``.
"""

from __future__ import annotations

from dataclasses import dataclass

BY_DESIGN = "by design"  # fixed in the program: no run measures it, no setting changes it


@dataclass(frozen=True)
class Printed:
    """A number that has no verdict.

    ``ours`` is a format string over the sections of the configuration and ``found``, what this run has measured; empty
    where the run has nothing to say, ``BY_DESIGN`` where it could say nothing else.
    """

    place: str
    what: str
    printed: str
    ours: str = ""


SETUP = (
    Printed("2.1", "participants", "12", "{found.subjects}"),
    Printed("2.1", "excluded for heavy contamination (s07)", "1", "{found.excluded}"),
    Printed("2.1, Table 2", "analysed", "11 (more than 10)", "{found.included}"),
    Printed("2.1", "women, men", "5, 6"),
    Printed("2.1", "age", "26.8 ± 3.7 years"),
    Printed("2.1", "left-handed (s05)", "1"),
    Printed("2.1", "ethics approval", "769/20 S-KK"),
    Printed("2.3.1", "degrees of freedom of the arm (UR10-CB3)", "6", BY_DESIGN),
    Printed("2.3.1", "monitor", "42 inch"),
    Printed("2.3.1", "table: from the arm's base; length", "0.8 m; 1 m"),
    Printed("2.3.1", "subject from the arm's base", "1.8 m"),
    Printed("2.3.1", "visual angle to the monitor", "30 to 35°"),
    Printed("2.3.2", "control computer", "AMD Ryzen 7 3800x, Ubuntu 20.04"),
    Printed("2.3.3", "recording computer", "Core i5 750, 2.67 GHz"),
    Printed("2.3.3", "electrodes", "32 (30 are named)", "{found.eeg} EEG + {found.eog} EOG"),
    Printed("2.3.3", "EOG electrodes", "3", "{found.eog}"),
    Printed("2.3.3", "channels of the reference (TP9, TP10)", "2", "{found.reference}"),
    Printed("2.3.4", "experiments that validate the timing", "1"),
    Printed("2.5", "takeover situations (Table 1)", "4", BY_DESIGN),
    Printed("2.5.1", "conditions", "8", "{found.conditions}"),
    Printed("3.3", "duration of a trial that the minutes assume", "2 s", "{simulate.trial_s} s"),
)

PARAMETERS = (
    Printed("2.2", "grid", "7 × 7 tiles", BY_DESIGN),
    Printed("2.2", "inner grid of start and goal", "5 × 5 tiles", BY_DESIGN),
    Printed("2.2", "steps from start to goal, at least", "7", "{found.least_steps}"),
    Printed("2.2", "direction changes of a trajectory, at least", "1", BY_DESIGN),
    Printed("2.2", "scenarios", "2", "{found.scenarios}"),
    Printed("2.2", "tiles of an area (sC)", "19 to 30", BY_DESIGN),
    Printed("2.2", "directions a partner controls (iC)", "2 of 4", BY_DESIGN),
    Printed("2.2", "robot mistakes", "30 %", "{found.error_rate}"),
    Printed("2.3.1", "near edge of the grid from the base", "0.76 m", "{robot.cell.near_edge:g} m"),
    Printed("2.3.1", "far edge of the grid from the base", "1.25 m", "{found.far_edge}"),
    Printed("2.3.1", "height of the screen", "0.6 m", "{robot.cell.screen_height:g} m"),
    Printed("2.3.1", "tip above the screen", "2 cm", "{robot.cell.hover:g} m"),
    Printed("2.3.1", "grid on the screen", "49 × 49 cm", "{found.grid_edge}"),
    Printed("2.3.1", "tile", "7 × 7 cm", "{robot.cell.tile:g} m"),
    Printed("2.3.1", "radius in which the next command is accepted", "2 mm", "{robot.cell.radius:g} m"),
    Printed("2.3.2", "order of the polynomial x(t)", "5", BY_DESIGN),
    Printed("2.3.2", "coefficients of s(t) (Eq 2)", "6, -15, 10", BY_DESIGN),
    Printed(
        "2.3.2", "duration of a movement t_f", "0.6 to 1.2 s", "{robot.t_f_range_s[0]:g} to {robot.t_f_range_s[1]:g} s"
    ),
    Printed("2.3.2", "control loop", "125 Hz", "{found.loop_hz}"),
    Printed("2.3.3", "EEG channels (27 of the 30 named)", "27", "{found.eeg}"),
    Printed("2.3.3", "sampling rate of the recording", "1000 Hz", "{found.source_sfreq}"),
    Printed("2.3.3", "pass band", "1 to 40 Hz", "{preprocess.l_freq:g} to {preprocess.h_freq:g} Hz"),
    Printed("2.3.3", "threshold of normalised kurtosis", "2 SD", "{preprocess.threshold:g} SD"),
    Printed("2.3.3", "sampling rate after preprocessing", "512 Hz", "{found.sfreq}"),
    Printed("2.4", "blocks", "12", "{found.blocks}"),
    Printed("2.4", "episodes a block", "13", "{found.episodes}"),
    Printed("2.4", "practice blocks a scenario, episodes in each", "1, 5", "{found.practice}"),
    Printed("2.5.1", "epoch", "-200 to 1200 ms", "{epoch.tmin:g} to {epoch.tmax:g} s"),
    Printed("2.5.1", "amplitude taken as implausible", "1000 V (read as µV)", "{epoch.reject_uv:g} µV"),
    Printed("2.5.2", "baseline of the ERP", "-200 to 0 ms", "{erp.baseline_s[0]:g} to {erp.baseline_s[1]:g} s"),
    Printed("2.6.1", "level of the tests", "p < 0.05", "{erp.alpha:g} (ERP), {ersp.alpha:g} (ERSP)"),
    Printed("2.5.3", "length of the wavelets", "1 s", "{ersp.kernel_s:g} s"),
    Printed("2.5.3", "frequencies", "2 to 30 Hz", "{ersp.low_hz:g} to {ersp.high_hz:g} Hz"),
    Printed("2.5.3", "step of the frequencies", "2 Hz", "{ersp.step_hz:g} Hz"),
    Printed("2.5.3", "cycles", "2 to 10", "{ersp.low_cycles:g} to {ersp.high_cycles:g}"),
    Printed("2.5.3", "factor of the magnitude", "2", BY_DESIGN),
    Printed("2.5.3", "down-sampling in time", "2", "{ersp.decimate}"),
    Printed(
        "2.5.4", "mean that is removed", "0 to 800 ms", "{decode.mean_window_s[0]:g} to {decode.mean_window_s[1]:g} s"
    ),
    Printed("2.5.4", "short windows", "4 of 50 ms in 400 to 600 ms", "{found.short_windows}"),
    Printed("2.5.4", "long windows", "11 of 100 ms in 0 to 600 ms", "{found.long_windows}"),
    Printed("2.5.4", "inter-trial times", "600 to 1200 ms", "{found.soa_range}"),
    Printed("2.5.4", "last time used", "600 ms", "{found.last_window}"),
    Printed("2.5.4", "component that the short windows cover", "500 ms"),
    Printed("2.5.4", "features", "405 = 27 × 15", "{found.features}"),
    Printed("2.5.4", "classes and their labels", "2; -1 and +1", f"{BY_DESIGN}: 0 and 1"),
    Printed("2.5.4", "classification problems", "2", "{found.problems}"),
    Printed("2.5.4", "range of λ", "0 to 1", BY_DESIGN),
    Printed("2.5.4", "λ", "0.9 (close to 1)", "{decode.shrinkage:g}"),
    Printed("2.5.4", "repeats × folds", "10 × 10 (9 to train, 1 to test)", "{decode.repeats} × {decode.folds}"),
    Printed("3.1", "rates of the simulated decoder (Table 1)", "4", BY_DESIGN),
    Printed("3.1", "initial memory q", "0", BY_DESIGN),
    Printed("3.1", "reward R", "1", BY_DESIGN),
    Printed("3.1", "actions of a subtask", "2", BY_DESIGN),
    Printed("3.1", "draws of the decoder (Eq 4)", "0 to 100, uniform", BY_DESIGN),
    Printed("3.2", "simulations (SIM1 to SIM4)", "4", BY_DESIGN),
    Printed("3.2", "subtasks n", "4", "{simulate.subtasks}"),
    Printed("3.2", "subtasks m that the human takes", "2", "{simulate.chosen}"),
    Printed("3.2", "learning rate α", "0.05", "{simulate.alpha:g}"),
    Printed("3.2", "temperature τ", "0.1", "{simulate.tau:g}"),
    Printed("3.2, Fig 4", "events in an episode o", "10", "{simulate.events}"),
    Printed("3.2", "episodes", "200", "{simulate.episodes}"),
    Printed("3.2", "repetitions", "100", "{simulate.repetitions}"),
    Printed("3.2", "decoders of SIM2", "50, 60, 70, 80 %", "{found.levels}"),
    Printed("3.2, Fig 4C", "SIM3: new tasks after", "40 episodes (Fig 4C: every 40)", "{found.reassigned}"),
    Printed("3.2", "SIM4: (n, m)", "(6, 3), (10, 5), (10, 2)", "{found.test_cases}"),
    Printed("Fig 4D", "SIM4: subtasks of human and robot", "2 and 8", "{found.test_cases}"),
    Printed("3.2", "decoder of SIM1 (Table 2, iC)", "51.5, 51.4, 57.9, 56.1 %", "{found.rates}"),
)
