"""What the paper prints, each thing once, with unit and place: its numbers and its findings. A leaf of values.

Ehrlich et al. 2023, PLoS ONE 18(7) e0287958, doi:10.1371/journal.pone.0287958. Lengths are in m, times in s and shares
of 1 where a setting of this program takes them so; ``text`` says them as the paper does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

T = TypeVar("T")
DOI = "10.1371/journal.pone.0287958"


class MeanSd(NamedTuple):
    """Mean and standard deviation."""

    mean: float
    sd: float


@dataclass(frozen=True)
class Printed(Generic[T]):
    """A number, several that belong together, or a finding in words.

    Attributes:
        place: Section, table or figure of the paper; several where it stands in several.
        quantity: What it is, in a few words.
        value: In ``unit``, or in the unit that the constant's name ends in.
        unit: Of the text.
        words: The text, where it is more than value and unit.
    """

    place: str
    quantity: str
    value: T
    unit: str = ""
    words: str = ""

    @property
    def text(self) -> str:
        """What the paper prints, as people read it."""
        return self.words or f"{_text(self.value)} {self.unit}".rstrip()


def _text(value: object) -> str:
    if isinstance(value, MeanSd):
        return f"{value.mean} ± {value.sd}"
    if isinstance(value, tuple):
        return ", ".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


# Participants and apparatus (2.1, 2.3)
PARTICIPANTS = Printed("2.1", "participants", 12)
EXCLUDED = Printed("2.1", "excluded for heavy contamination (s07)", ("s07",), words="1")
ANALYSED = Printed("2.1, Table 2", "analysed", 11, words="11 (more than 10)")
WOMEN_MEN = Printed("2.1", "women, men", (5, 6))
AGE = Printed("2.1", "age", MeanSd(26.8, 3.7), "years")
LEFT_HANDED = Printed("2.1", "left-handed (s05)", 1)
ETHICS_APPROVAL = Printed("2.1", "ethics approval", "769/20 S-KK")
ARM_JOINTS = Printed("2.3.1", "degrees of freedom of the arm (UR10-CB3)", 6)
MONITOR_INCH = Printed("2.3.1", "monitor", 42, "inch")
TABLE_M = Printed("2.3.1", "table: from the arm's base; length", (0.8, 1.0), words="0.8 m; 1 m")
SUBJECT_M = Printed("2.3.1", "subject from the arm's base", 1.8, "m")
VISUAL_ANGLE_DEG = Printed("2.3.1", "visual angle to the monitor", (30, 35), words="30 to 35°")
CONTROL_COMPUTER = Printed("2.3.2", "control computer", "AMD Ryzen 7 3800x, Ubuntu 20.04")
RECORDING_COMPUTER = Printed("2.3.3", "recording computer", "Core i5 750, 2.67 GHz")
ELECTRODES = Printed("2.3.3", "electrodes", 32, words="32 (30 are named)")
EOG_ELECTRODES = Printed("2.3.3", "EOG electrodes", 3)
REFERENCES = Printed("2.3.3", "channels of the reference (TP9, TP10)", 2)
TIMING_EXPERIMENTS = Printed("2.3.4", "experiments that validate the timing", 1)

# The game, the cell and the arm's moves (2.2, 2.3.1, 2.3.2)
GRID_TILES = Printed("2.2", "grid", 7, words="7 × 7 tiles")
INNER_TILES = Printed("2.2", "inner grid of start and goal", 5, words="5 × 5 tiles")
LEAST_STEPS = Printed("2.2", "steps from start to goal, at least", 7)
LEAST_TURNS = Printed("2.2", "direction changes of a trajectory, at least", 1)
SCENARIOS = Printed("2.2", "scenarios", 2)
AREA_TILES = Printed("2.2", "tiles of an area (sC)", (19, 30), words="19 to 30")
PARTNER_DIRECTIONS = Printed("2.2", "directions a partner controls (iC)", (2, 4), words="2 of 4")
ERROR_SHARE = Printed("2.2", "robot mistakes", 0.3, words="30 %")
NEAR_EDGE_M = Printed("2.3.1", "near edge of the grid from the base", 0.76, "m")
FAR_EDGE_M = Printed("2.3.1", "far edge of the grid from the base", 1.25, "m")
SCREEN_HEIGHT_M = Printed("2.3.1", "height of the screen", 0.6, "m")
HOVER_M = Printed("2.3.1", "tip above the screen", 0.02, words="2 cm")
GRID_EDGE_M = Printed("2.3.1", "grid on the screen", 0.49, words="49 × 49 cm")
TILE_M = Printed("2.3.1", "tile", 0.07, words="7 × 7 cm")
RADIUS_M = Printed("2.3.1", "radius in which the next command is accepted", 0.002, words="2 mm")
POLYNOMIAL_ORDER = Printed("2.3.2", "order of the polynomial x(t)", 5)
POLYNOMIAL = Printed("2.3.2", "coefficients of s(t) (Eq 2)", (6, -15, 10))
MOVE_S = Printed("2.3.2", "duration of a movement t_f", (0.6, 1.2), words="0.6 to 1.2 s")
LOOP_HZ = Printed("2.3.2", "control loop", 125.0, "Hz")

# From recordings to decoders (2.3.3 to 2.6)
EEG_CHANNELS = Printed("2.3.3", "EEG channels (27 of the 30 named)", 27)
RECORDED_HZ = Printed("2.3.3", "sampling rate of the recording", 1000.0, "Hz")
PASS_BAND_HZ = Printed("2.3.3", "pass band", (1.0, 40.0), words="1 to 40 Hz")
KURTOSIS_SD = Printed("2.3.3", "threshold of normalised kurtosis", 2.0, "SD")
CLEAN_HZ = Printed("2.3.3", "sampling rate after preprocessing", 512.0, "Hz")
BLOCKS = Printed("2.4", "blocks", 12)
EPISODES_A_BLOCK = Printed("2.4", "episodes a block", 13)
PRACTICE = Printed("2.4", "practice blocks a scenario, episodes in each", (1, 5))
SITUATIONS = Printed("2.5", "takeover situations (Table 1)", 4)
CONDITIONS = Printed("2.5.1", "conditions", 8)
EPOCH_S = Printed("2.5.1", "epoch", (-0.2, 1.2), words="-200 to 1200 ms")
IMPLAUSIBLE_UV = Printed("2.5.1", "amplitude taken as implausible", 1000.0, words="1000 V (read as µV)")
BASELINE_S = Printed("2.5.2", "baseline of the ERP", (-0.2, 0.0), words="-200 to 0 ms")
LEVEL = Printed("2.6.1", "level of the tests", 0.05, words="p < 0.05")
WAVELET_S = Printed("2.5.3", "length of the wavelets", 1.0, "s")
FREQUENCIES_HZ = Printed("2.5.3", "frequencies", (2.0, 30.0), words="2 to 30 Hz")
FREQUENCY_STEP_HZ = Printed("2.5.3", "step of the frequencies", 2.0, "Hz")
CYCLES = Printed("2.5.3", "cycles", (2.0, 10.0), words="2 to 10")
MAGNITUDE_FACTOR = Printed("2.5.3", "factor of the magnitude", 2)
DECIMATION = Printed("2.5.3", "down-sampling in time", 2)
REMOVED_MEAN_S = Printed("2.5.4", "mean that is removed", (0.0, 0.8), words="0 to 800 ms")
SHORT_WINDOWS = Printed("2.5.4", "short windows", 4, words="4 of 50 ms in 400 to 600 ms")
LONG_WINDOWS = Printed("2.5.4", "long windows", 11, words="11 of 100 ms in 0 to 600 ms")
INTER_TRIAL_S = Printed("2.5.4", "inter-trial times", (0.6, 1.2), words="600 to 1200 ms")
LAST_TIME_S = Printed("2.5.4", "last time used", 0.6, words="600 ms")
COMPONENT_S = Printed("2.5.4", "component that the short windows cover", 0.5, words="500 ms")
FEATURES = Printed("2.5.4", "features", 405, words="405 = 27 × 15")
CLASSES = Printed("2.5.4", "classes and their labels", (-1, 1), words="2; -1 and +1")
PROBLEMS = Printed("2.5.4", "classification problems", 2)
SHRINKAGE_RANGE = Printed("2.5.4", "range of λ", (0.0, 1.0), words="0 to 1")
SHRINKAGE = Printed("2.5.4", "λ", 0.9, words="0.9 (close to 1)")
REPEATS_FOLDS = Printed("2.5.4", "repeats × folds", (10, 10), words="10 × 10 (9 to train, 1 to test)")

# What came out of it
_NOTHING = "no significant difference"
_RH_RR = "ERSP, RH against RR before"
REPLACED_CHANNELS = Printed("2.3.3", "channels replaced a subject", (3, 6), words="3 to 6")
OUTLIERS = Printed("2.5.1", "subjects with implausible amplitudes", ("s07",), words="1 (s07)")
REJECTED_EPOCHS = Printed("2.5.1", "epochs of the others excluded for their amplitude", 0)
STEPS = Printed("2.2", "steps from start to goal", MeanSd(7.19, 0.39))
SOA_MS = {
    "sC": Printed("2.3.1", "duration of a trial, sC", MeanSd(875.88, 133.91), "ms"),
    "iC": Printed("2.3.1", "duration of a trial, iC", MeanSd(872.34, 131.35), "ms"),
}
TRIAL_S = Printed("3.3", "duration of a trial in the experiment", 2.0, words="approximately 2 seconds")
TRIALS = {
    case: Printed("2.5.1", f"trials {case}, tr-1 and tr, a subject", MeanSd(mean, sd), "each")
    for case, mean, sd in (("HH", 611, 43), ("HR", 148, 14), ("RR", 530, 25), ("RH", 212, 22))
}
SEQUENTIAL_SHARE = Printed("2.5.1", "share of a condition's trials in sC", 0.5, words="about half")
MISTAKES = Printed(
    "2.2", "mistakes (errors) and takeovers", "not every mistake leads to a takeover; human or robot corrects it"
)
TRIGGER_TIMING = Printed(
    "2.3.4", "latency and jitter between motion and trigger", "small enough not to compromise the analyses"
)
ERP_HR_HH_BEFORE = Printed("2.6.1, Fig 2A", "ERP, HR against HH before", _NOTHING)
ERP_HR_HH_AFTER = Printed("2.6.1, Fig 2B", "ERP, HR against HH after", _NOTHING)
ERP_RH_RR_BEFORE = Printed("2.6.1, 4.1, Fig 2C", "ERP, RH against RR before", "larger, prefrontal, 500 ms, p < 0.05")
ERP_RH_RR_AFTER = Printed("2.6.1, Fig 2D", "ERP, RH against RR after", _NOTHING)
ERP_RH_RR_BEFORE_SC = Printed("2.6.1, Fig 3A", "ERP, RH against RR before, sC", _NOTHING)
ERP_RH_RR_BEFORE_IC = Printed("2.6.1, Fig 3B", "ERP, RH against RR before, iC", "as in Fig 2C, p < 0.05")
ERP_ALIKE = Printed("2.6.1, Fig 3", "ERP and its maps, sC beside iC", "qualitatively comparable")
TIME_AND_PHASE = Printed("4.1", "RH against RR before, about 500 ms", "both time- and phase-locked to the onset")
ERSP_HR_HH_BEFORE = Printed("Fig 2A", "ERSP, HR against HH before", _NOTHING)
ERSP_HR_HH_AFTER = Printed(
    "2.6.1, 4.1, Fig 2B", "ERSP, HR against HH after", "less alpha with an own action, motor areas, p < 0.05"
)
ERSP_RH_RR_BEFORE_ALPHA = Printed("2.6.1, 4.1, Fig 2C", _RH_RR, "less alpha, motor areas, from 700 ms, p < 0.05")
ERSP_RH_RR_BEFORE_THETA = Printed("2.6.1, 4.1, Fig 2C", _RH_RR, "theta, prefrontal, 500 ms, p < 0.05")
ERSP_RH_RR_AFTER = Printed(
    "2.6.1, 4.1, Fig 2D", "ERSP, RH against RR after", "more beta, left temporal, mostly 600 ms, p < 0.05"
)
ERSP_SCENARIOS_ALPHA = Printed("2.6.1, Fig 3", _RH_RR, "alpha, motor areas, in sC and iC")
ERSP_SCENARIOS_THETA = Printed("2.6.1, Fig 3", _RH_RR, "theta, prefrontal, in sC and iC")
ERSP_SCENARIOS_MOTOR = Printed("2.6.1, Fig 3", "ERSP, motor areas", "stronger and earlier in sC")
ERSP_SCENARIOS_PREFRONTAL = Printed("2.6.1, Fig 3", "ERSP, prefrontal theta", "more pronounced in iC")


def _rates(
    scenario: str,
    problem: str,
    tnr: tuple[float, float],
    tpr: tuple[float, float],
    acc: tuple[float, float],
    *,
    text: str = "",
    headline: str = "",
) -> dict[str, Printed[MeanSd]]:
    """Return measure -> what a cell of Table 2 prints; ``text`` and ``headline``: where it stands, too."""
    also = {"tnr": text, "tpr": text, "acc": text + headline}
    return {
        name: Printed(f"Table 2{also[name]}", f"{name.upper()}, {problem}, {scenario}", MeanSd(*rate), "%")
        for name, rate in (("tnr", tnr), ("tpr", tpr), ("acc", acc))
    }


# Over the analysed subjects; (scenario, problem) -> measure.
TABLE_2 = {
    ("sC", "HHvsHR"): _rates("sC", "HHvsHR", (52.0, 3.7), (51.4, 5.1), (51.9, 3.7)),
    ("sC", "RRvsRH"): _rates("sC", "RRvsRH", (52.9, 2.6), (53.3, 5.3), (53.0, 3.0)),
    ("iC", "HHvsHR"): _rates("iC", "HHvsHR", (51.5, 3.4), (51.4, 3.5), (51.4, 3.3)),
    ("iC", "RRvsRH"): _rates("iC", "RRvsRH", (57.9, 4.3), (56.1, 3.2), (57.1, 3.7), text=", 2.6.2", headline=", 5"),
}
CHANCE = Printed("2.6.2, Table 2", "chance level", 54.3, "%")
# The same keys: what is printed bold and starred is significantly above the chance level.
ABOVE_CHANCE = {
    (scenario, problem): {
        measure: Printed(
            "Table 2, 2.6.2",
            f"{problem}, {scenario}, {measure.upper()}",
            above,
            words="significantly above chance" if above else "not significantly above chance",
        )
        for measure in rates
    }
    for (scenario, problem), rates, above in ((key, rates, key == ("iC", "RRvsRH")) for key, rates in TABLE_2.items())
}

# The robot that learns (3)
DECODER_RATES = Printed("3.1", "rates of the simulated decoder (Table 1)", 4)
INITIAL_MEMORY = Printed("3.1", "initial memory q", 0)
REWARD = Printed("3.1", "reward R", 1)
ACTIONS = Printed("3.1", "actions of a subtask", 2)
DRAWS = Printed("3.1", "draws of the decoder (Eq 4)", (0, 100), words="0 to 100, uniform")
SIMULATIONS = Printed("3.2", "simulations (SIM1 to SIM4)", 4)
SUBTASKS = Printed("3.2", "subtasks n", 4)
CHOSEN = Printed("3.2", "subtasks m that the human takes", 2)
LEARNING_RATE = Printed("3.2", "learning rate α", 0.05)
TEMPERATURE = Printed("3.2", "temperature τ", 0.1)
EVENTS = Printed("3.2, Fig 4", "events in an episode o", 10)
EPISODES = Printed("3.2", "episodes", 200)
REPETITIONS = Printed("3.2", "repetitions", 100)
LEVELS = Printed("3.2", "decoders of SIM2", (50.0, 60.0, 70.0, 80.0), "%")
REASSIGNED_AFTER = Printed("3.2, Fig 4C", "SIM3: new tasks after", 40, words="40 episodes (Fig 4C: every 40)")
SUBTASK_CASES = Printed("3.2", "SIM4: (n, m)", ((6, 3), (10, 5), (10, 2)), words="(6, 3), (10, 5), (10, 2)")
CASE_OF_FIG_4D = Printed("Fig 4D", "SIM4: subtasks of human and robot", (2, 8), words="2 and 8")
ASSUMED_TRIAL_S = Printed("3.3", "duration of a trial that the minutes assume", 2.0, "s")
# After a human's action HH and HR, after a robot's RR and RH.
SIM1_RATES = Printed(
    "3.2",
    "decoder of SIM1 (Table 2, iC)",
    tuple(TABLE_2["iC", problem][rate].value.mean for problem in ("HHvsHR", "RRvsRH") for rate in ("tnr", "tpr")),
    "%",
)
# Episode -> choice accuracy.
SIM1_ACCURACY = {
    35: Printed("3.3, Fig 4A", "SIM1, choice accuracy at episode 35", 0.7, words="about 70 %"),
    100: Printed("Abstract, 3.3, Fig 4A", "SIM1, choice accuracy at episode 100", 0.8, words="about 80 %"),
}
# Episodes -> how long they take, at two seconds a trial.
SIM1_MINUTES = {
    35: Printed("3.3", "SIM1, 35 episodes, at 2 s a trial", 6.0, words="about 6 min"),
    100: Printed("Abstract, 3.3", "SIM1, 100 episodes, at 2 s a trial", 17.0, words="about 17 min"),
}
SIM3_MINUTES = {40: Printed("3.3", "SIM3: 40 episodes, at 2 s a trial", (6.0, 7.0), words="6 to 7 min")}
SIM2_ORDER = Printed("3.3, Fig 4B", "SIM2: better decoders learn faster", "50 < emp. < 60 < 70 < 80 %")
SIM2_50 = Printed("3.3, Fig 4B", "SIM2: a decoder of 50 %", "learns nothing")
SIM3_LOSS = Printed("3.3, Fig 4C", "SIM3: relearning", "no notable loss in the long run")
SIM4_SUBTASKS = Printed("3.3, 4.3, Fig 4D", "SIM4: 4, 6, 10 subtasks", "the more, the slower")
SIM4_TWO = Printed("3.3, Fig 4D", "SIM4: human takes 2 of 10", "steeper than 5 of 10")
SIM4_EIGHT = Printed("3.3", "SIM4: robot has fewer subtasks", "shallower than 5 of 10")
SIM4_BALANCE = Printed(
    "3.3, 4.3, 5, Fig 4D", "SIM4: imbalanced assignment", "comparable performance, does not affect the learning"
)
