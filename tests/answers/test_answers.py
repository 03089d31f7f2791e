"""What came out, in words: everything said stands in the summary, whatever its order."""

import json
import random

import pytest
from scipy.stats import binomtest

from hrcneuro import answers
from hrcneuro.answers import html, words

PEAK = {"channel": "Cz", "time_s": 0.4124, "difference_uv": -3.456}
TESTED = {
    "n": 11,
    "significant": 132,
    "p_min": 0.0005,
    "peak": {**PEAK, "frequency_hz": 6.0, "t": -4.125, "p": 0.0117, "dz": -1.24, "dz_low": -2.0, "dz_high": -0.44},
}
UNTESTED = {"n": 1, "significant": 0, "p_min": None, "peak": PEAK}
PROBLEM = {"tnr": 60.04, "tpr": 58.2, "acc": 59.12, "bacc": 59.1, "chance": 54.3}
SUMMARIES = {
    ("acquire", "s01"): (
        {
            **{"source": "file", "origin": {"eeg": "real", "behaviour": "real"}, "channels": {"eog": 3, "eeg": 27}},
            **{"sfreq": 250.0, "duration_s": 120.0, "events": {"move": 2082}, "bads": ["T7"], "breaks": 1},
        },
        [
            "27 EEG and 3 EOG channels at 250 Hz, 2.0 min; recorded from people",
            "move 2,082",
            "marked bad: T7",
            "1 break",
        ],
    ),
    ("preprocess", "s01"): (
        {
            **{"sfreq": 128.0, "source_sfreq": 250.0, "downsampled": True, "seconds": 120.0, "channels": 27},
            **{"eog_channels": ["EOG1"], "interpolated": ["P8", "Fp1"], "bad": {"P8": "kurtosis", "Fp1": "flat"}},
            "noisy": {"FC5": "correlation", "C3": "deviation, correlation", "P8": "deviation"},
        },
        [
            "27 EEG channels at 128 Hz (recorded at 250 Hz), 2.0 min",
            "Fp1 (flat); P8 (kurtosis)",
            "with EOG1",
            "noisy all the time, and kept: C3 (deviation, correlation), FC5 (correlation)",
        ],
    ),
    ("calibrate", "s01"): (
        {
            **{"channels": 30, "kept": 27, "sfreq": 500.0, "epoch_samples": 300, "trials": 640},
            **{"dropped": {"amplitude": 4, "boundary": 1}, "matched": ["prev_error", "turn"]},
            "problems": {
                "RRvsRH": {
                    **{**PROBLEM, "bacc_se": 2.0, "n1": 236, "n2": 153, "n_blocks": 6, "log_loss": 0.98, "stays": 51.2},
                    "rules": {"stays": {"bacc": 50.0}, "prev_error": {"bacc": 70.8}, "turn": {"bacc": 88.7}},
                    "strata": {"turn yes": 56.5, "turn no": None, "prev_error yes": 57.25},
                }
            },
        },
        [
            "30 channels at 500 Hz, ready 600 ms after an onset; from 640 trials (dropped: amplitude 4, boundary 1), "
            "within strata of prev_error and turn",
            "RRvsRH  59.1 ± 3.9 %; takeovers 58.2 % of 153, others 60.0 % of 236; it says that the actor stays in",
            "RRvsRH  the actor stays 50.0 %, after an error 70.8 %, before a turn 88.7 %",
            "RRvsRH  prev_error yes 57.2 %, turn yes 56.5 %",
        ],
    ),
    ("epoch", "s01"): (
        {
            **{"counts": {"sC": {"HH": 9, "HR": 3}, "iC": {"HH": 23, "HR": 9}}, "total": {"HH": 32, "HR": 12}},
            **{"epochs": 44, "rejected": 2, "reasons": {"amplitude": 2}, "outlier": False, "sfreq": 128.0},
        },
        ["44 epochs at 128 Hz, 2 rejected (amplitude 2)", "all  HH 32, HR 12", "iC   HH 23, HR 9"],
    ),
    ("erp", "s01"): (
        {"trials": {"all": {"RH": 25, "RR": 50}}, "contrasts": {"all": {"RH-RR": {"peak": PEAK}}}},
        ["trials by condition: RH 25, RR 50", "all  RH-RR  −3.46 µV at Cz, 412 ms"],
    ),
    ("erp", "s02"): (
        {
            **{"trials": {"all": {"RH": 25, "RR": 50}}, "shortest_gap_s": 0.4},
            "contrasts": {
                "all": {
                    "early": {"peak": PEAK | {"time_s": -0.1}},
                    "at once": {"peak": PEAK | {"time_s": 0.4}},
                    "late": {"peak": PEAK},
                }
            },
        },
        [
            "all  early    −3.46 µV at Cz, −100 ms, before the onset\n",
            "all  at once  −3.46 µV at Cz, 400 ms\n",
            "all  late     −3.46 µV at Cz, 412 ms, after the earliest next onset (400 ms)",
        ],
    ),
    ("rerp", "s01"): (
        {
            **{"formula": "actor / takeover", "overlap": "regress", "trials": {"iC": 990}, "unknown": {"iC": 78}},
            "coefficients": {
                "iC": {
                    "Intercept": {"nonzero": 990, "inflation": None, "peak": PEAK},
                    "actor[robot]:takeover": {"nonzero": 151, "inflation": 2.31, "peak": PEAK},
                }
            },
            "shortest_gap_s": None,
        },
        [
            "potential ~ actor / takeover; overlap regressed out",
            "trials: iC 990; with something unknown: iC 78",
            "iC  actor[robot]:takeover  −3.46 µV at Cz, 412 ms; 151 trials not 0; variance inflation 2.3",
            "iC  Intercept              −3.46 µV at Cz, 412 ms; 990 trials not 0",
        ],
    ),
    ("rerp", "group"): (
        {
            **{"formula": "turn", "overlap": "keep", "subjects": ["s01"] * 11, "alpha": 0.05, "shortest_gap_s": 0.4},
            "coefficients": {"iC": {"Intercept": TESTED, "turn": TESTED}, "sC": {"turn": UNTESTED}},
        },
        [
            "potential ~ turn; overlap kept",
            "iC  turn       −3.46 µV at Cz, 6 Hz, 412 ms, after the earliest next onset (400 ms); t = −4.12",
            "sC  turn       −3.46 µV at Cz, 412 ms, after the earliest next onset (400 ms); not tested, n = 1",
            "significant at 0.05 somewhere on the map: 1 of 1 coefficients (iC turn)",
        ],
    ),
    ("ersp", "group"): (
        {"subjects": ["s01"] * 11, "alpha": 0.05, "contrasts": {"all": {"RH-RR": TESTED}, "iC": {"RH-RR": UNTESTED}}},
        [
            "11 subjects",
            "−3.46 µV at Cz, 6 Hz, 412 ms; t = −4.12, p = 0.012, n = 11; dz = −1.24 [−2.00, −0.44]",
            "iC   RH-RR  −3.46 µV at Cz, 412 ms; not tested, n = 1",
            "significant at 0.05 somewhere on the map: 1 of 1 contrasts (all RH-RR)",
        ],
    ),
    ("decode", "s01"): (
        {
            "iC": {
                "RRvsRH": {**PROBLEM, "p": 0.0004, "n1": 300, "n2": 110},
                "HHvsHR": {**dict.fromkeys(PROBLEM), "p": None, "n1": 9, "n2": 2},
            },
            "warnings": ["one"],
        },
        [
            "59.1 % [54.3, 63.8] of 410 trials; chance 54.3 %, p < 0.001; takeovers 58.2 %",
            "not decoded: 11 trials (9 and 2)",
        ],
    ),
    ("transfer", "s01"): (
        {
            **{"signals": ["offline", "causal"], "channels": 27, "lost": 3},
            "trials": {"iC": {"RRvsRH": [236, 153], "HHvsHR": [250, 1]}, "sC": {"RRvsRH": [200, 140]}},
        },
        [
            "offline and causal: trials of both classes at 27 channels; 3 epochs not seen by all",
            "iC  HHvsHR  250 and 1 trial\n",
            "sC  RRvsRH  200 and 140 trials",
        ],
    ),
    ("transfer", "group"): (
        {
            **{"subjects": ["s01"] * 11, "shuffled": False},
            "decoded": {
                "iC": {
                    "RRvsRH, causal": {
                        "own": {"bacc": 57.14, "half_width": 2.31, "p_holm": 0.0005, "minutes": 14.25, "n": 11},
                        "pooled": {
                            **{"bacc": 54.0, "half_width": None, "p_holm": 0.25, "minutes": 0.0, "n": 1},
                            **{"difference_to_own": -3.14, "p_holm_to_own": 0.0312, "worth_minutes": 6.51},
                        },
                        "recentred, none": {
                            **{"bacc": 56.0, "half_width": 1.0, "p_holm": 0.02, "minutes": 0.0, "n": 11},
                            **{"difference_to_own": -1.14, "p_holm_to_own": 0.0312, "worth_minutes": 6.51},
                        },
                        "joint": {
                            **{"bacc": 60.0, "half_width": 1.0, "p_holm": 0.02, "minutes": 14.25, "n": 11},
                            **{"difference_to_own": 2.86, "p_holm_to_own": 0.5, "worth_minutes": None},
                        },
                    }
                }
            },
        },
        [
            "own              57.1 ± 2.3 % after 14.2 min, n = 11, p < 0.001\n",
            "pooled           54.0 % after 0.0 min, n = 1, p = 0.250; −3.1, p = 0.031\n",
            "56.0 ± 1.0 % after 0.0 min, n = 11, p = 0.020; −1.1, p = 0.031; own reaches it after 6.5 min",
            "joint            60.0 ± 1.0 % after 14.2 min, n = 11, p = 0.020; +2.9, p = 0.500; own never reaches it",
        ],
    ),
    ("decode", "group"): (
        {"iC": {"RRvsRH": {**PROBLEM, "n": 11, "acc_half_width": 2.31, "p": 0.01, "p_holm": 0.0204}}},
        ["iC  RRvsRH  59.1 ± 2.3 %, n = 11; chance 54.3 %, p = 0.020; takeovers 58.2 %, others 60.0 %"],
    ),
    ("simulate", "group"): (
        {
            "SIM1": {"emp": {"35": 0.7, "120": 0.8123}},
            "milestones": {
                "SIM1": {
                    "emp": {
                        "70": {"episode": 35, "earliest": 33, "latest": 37, "minutes": {"1": 5.83, "2": 11.67}},
                        "80": {"episode": None, "earliest": None, "latest": None, "minutes": {"1": None, "2": None}},
                    }
                }
            },
        },
        ["SIM1  emp  70 % at episode 35 (minutes: 5.8 at 1 s, 11.7 at 2 s); 80 % never; 81.2 % at episode 120"],
    ),
    ("robot", "s01"): (
        {
            **{"moves": 59, "stops": 0, "max_error_mm": 0.3916, "end_error_mm": 0.0796, "t_2mm_s": 0.648},
            **{"loop_hz": 125.0, "jitter_p99_ms": None, "lead_ms": 26.98},
        },
        ["59 moves, never stopped", "0.392 mm", "0.080 mm", "0.648 s", "125.0 Hz", "not known", "lead 27.0 ms"],
    ),
    ("robot", "s02"): (
        {
            **{"moves": 1, "stops": 0, "max_error_mm": 0.4, "end_error_mm": 0.1, "t_2mm_s": 0.6, "loop_hz": 125.0},
            **{"jitter_p99_ms": 3.0, "lead_ms": 27.0, "late_packets": 12, "oldest_packet_ms": 83.4},
        },
        ["late packets were borne in 12 cycles, the oldest of 83 ms"],
    ),
}


def shuffled(value, rng):
    """Return a summary as it may come from elsewhere: every table in another order."""
    if not isinstance(value, dict):
        return value
    names = list(value)
    rng.shuffle(names)
    return {name: shuffled(value[name], rng) for name in names}


@pytest.mark.parametrize("place", SUMMARIES, ids=" ".join)
def test_a_summary_is_told_in_words_and_units(place):
    summary, said = SUMMARIES[place]
    told = "\n".join(answers.lines(*place, summary, every=True))
    for words_ in said:
        assert words_ in told


@pytest.mark.parametrize("place", SUMMARIES, ids=" ".join)
def test_the_order_in_a_summary_does_not_matter(place):
    summary, _ = SUMMARIES[place]
    again = shuffled(json.loads(json.dumps(summary)), random.Random(1))
    assert answers.lines(*place, again, every=True) == answers.lines(*place, summary, every=True)


@pytest.mark.parametrize("place", SUMMARIES, ids=" ".join)
def test_the_short_form_leaves_rows_out_and_says_nothing_else(place):
    summary, _ = SUMMARIES[place]
    short, whole = (answers.lines(*place, summary, every=every) for every in (False, True))
    assert short
    assert len(short) <= len(whole)
    assert {line.split()[0] for line in short} <= {line.split()[0] for line in whole}


@pytest.mark.parametrize("stage", ["acquire", "preprocess", "epoch", "decode", "robot", "calibrate"])
def test_several_subjects_are_told_together(stage):
    summary, _ = SUMMARIES[stage, "s01"]
    told = answers.together(stage, {"s01": summary, "s02": summary})
    assert told[0].startswith("2 ") or "2 subjects" in told[0]


def test_what_is_of_no_known_stage_is_told_by_its_own_names():
    told = answers.lines("pace", "s01", {"moves": 3, "pace_s": 1.23456, "names": ["a", "b"], "deep": {"x": 1}})
    assert told == ["moves   3", "names   a, b", "pace_s  1.235"]
    assert answers.lines("pace", "s01", {}) == []


def test_where_nothing_was_decoded_it_says_so():
    assert answers.lines("decode", "s01", {"warnings": ["no problems"]}) == ["nothing was decoded"]


def test_events_are_not_called_conditions():
    summary, _ = SUMMARIES["epoch", "s01"]
    events = {**summary, "counts": {"all": {"target": 16}}, "total": {"target": 16}, "counted": "events"}
    assert "trials by event:" in answers.lines("epoch", "demo", events)
    assert "trials by event: target 16.0 ± 0.0" in answers.together("epoch", {"a": events, "b": events})


@pytest.mark.parametrize(("hits", "n"), [(0, 12), (7, 12), (251, 410), (410, 410)])
def test_the_interval_is_wilsons(hits, n):
    reference = binomtest(hits, n).proportion_ci(method="wilson")
    assert words.interval(hits / n, n) == pytest.approx((reference.low, reference.high), abs=1e-6)


def test_what_a_notebook_shows_is_escaped():
    for text in (html.table("<a>", ["<b>"], [["<c>"]]), html.preformatted("<a>", ["<b>"])):
        assert "&lt;a&gt;" in text
        assert "&lt;b&gt;" in text
        assert "<b>" not in text.replace("<b>&lt;a&gt;</b>", "")


OWN = {"tnr": 77.5, "tpr": 67.5, "acc": 75.0, "chance": 58.8, "p": 0.05, "n1": 64, "n2": 16}


def test_the_classes_of_a_study_of_ones_own_have_their_conditions_names():
    problem = OWN | {"decoder": "rlda", "classes": ["standard", "target"]}
    text = "\n".join(answers.lines("decode", "demo", {"all": {"standardVStarget": problem}}))
    assert "target 67.5 %, standard 77.5 %" in text
    assert "takeover" not in text
    assert "rlda" not in text  # the only one


def test_every_decoder_has_its_number():
    other = {"tnr": 80.0, "tpr": 90.0, "acc": 82.5, "p": None}
    problem = OWN | {"decoder": "svm", "classes": ["standard", "target"], "others": {"rlda": other}}
    summary = {"all": {"standardVStarget": problem}}
    first, second = answers.lines("decode", "demo", summary)[1:]
    assert first.split()[:4] == ["all", "standardVStarget", "svm", "75.0"]
    assert second.split()[:4] == ["all", "standardVStarget", "rlda", "82.5"]
    assert second.endswith("of 80 trials; chance 58.8 %, p not computed; target 90.0 %, standard 80.0 %")
    told = answers.together("decode", {"a": summary, "b": summary})
    assert [line.split()[2:4] for line in told[1:]] == [["svm", "75.0"], ["rlda", "82.5"]]
