"""The results that the paper prints, beside those of this run.

Published: Ehrlich et al. 2023, PLoS ONE 18(7) e0287958, doi:10.1371/journal.pone.0287958. What is printed of setup and
parameters is in ``paper.py``.
"""

from __future__ import annotations

import string
from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from hrcneuro.decoding.group import PUBLISHED
from hrcneuro.report import facts, measured_brain, measured_learning, measured_moves
from hrcneuro.report.paper import PARAMETERS, SETUP, Printed
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import grounds

_RH_RR = "ERSP, RH against RR before"
_FOREST, _FIG_4 = "decode-group-decoding", "simulate-group-fig4"
_GROUP = ("erp", "ersp", "simulate")  # measured on the group's item, the others on the subjects'
NAMES = {"tnr": "TNR", "tpr": "TPR", "acc": "ACC"}


@dataclass(frozen=True)
class Result:
    """A printed result: the key of what measures it here, place, quantity, figure; the chapter and picture to see.

    ``stage`` measures it; empty where that is the chapter's.
    """

    key: str
    place: str
    what: str
    printed: str
    chapter: str
    figure: str = ""
    stage: str = ""


@dataclass(frozen=True)
class Row:
    """One line of a table: where the paper prints it, what, the two figures, the verdict, why, and what kind it is."""

    place: str
    what: str
    published: str
    ours: str
    kind: str
    verdict: str = ""
    why: str = ""
    chapter: str = ""
    figure: str = ""


def _table_2() -> Iterator[Result]:
    for (scenario, problem), measures in PUBLISHED.items():
        for name, (mean, sd) in measures.items():
            star = (scenario, problem) == ("iC", "RRvsRH")
            place = "Table 2, 2.6.2, 5" if star and name == "acc" else "Table 2, 2.6.2" if star else "Table 2"
            what = f"{NAMES[name]}, {problem}, {scenario}"
            yield Result(f"{scenario} {problem} {name}", place, what, f"{mean} ± {sd} %", "decode", _FOREST)
        word = "above" if (scenario, problem) == ("iC", "RRvsRH") else "not above"
        yield Result(
            f"{scenario} {problem} above", "Table 2", f"{problem}, {scenario}, ACC", f"{word} chance", "decode", _FOREST
        )


_POTENTIALS = "no significant difference"
RESULTS = (
    Result("replaced", "2.3.3", "channels replaced a subject", "3 to 6", "preprocess", "quality_group"),
    Result("outlier", "2.5.1", "subjects with implausible amplitudes", "1 (s07)", "preprocess", stage="epoch"),
    Result("rejected", "2.5.1", "epochs of the others excluded for their amplitude", "0", "preprocess", stage="epoch"),
    Result("steps", "2.2", "steps from start to goal", "7.19 ± 0.39", "epoch", stage="acquire"),
    Result("soa sC", "2.3.1", "duration of a trial, sC", "875.88 ± 133.91 ms", "epoch", "moves", "acquire"),
    Result("soa iC", "2.3.1", "duration of a trial, iC", "872.34 ± 131.35 ms", "epoch", "moves", "acquire"),
    Result(
        "soa 2 s",
        "3.3",
        "duration of a trial in the experiment",
        "approximately 2 seconds",
        "epoch",
        "moves",
        "acquire",
    ),
    *(
        Result(f"trials {c}", "2.5.1", f"trials {c}, tr-1 and tr, a subject", f"{m} ± {s} each", "epoch")
        for c, (m, s) in measured_moves.COUNTS.items()
    ),
    Result("half", "2.5.1", "share of the trials in sC", "about half", "epoch"),
    Result("erp A", "2.6.1, Fig 2A", "ERP, HR against HH before", _POTENTIALS, "erp", "fig2"),
    Result("erp B", "2.6.1, Fig 2B", "ERP, HR against HH after", _POTENTIALS, "erp", "fig2"),
    Result("erp C", "2.6.1, 4.1, Fig 2C", "ERP, RH against RR before", "prefrontal, 500 ms, p < 0.05", "erp", "fig2"),
    Result("erp D", "2.6.1, Fig 2D", "ERP, RH against RR after", _POTENTIALS, "erp", "fig2"),
    Result("erp sC", "2.6.1, Fig 3A", "ERP, RH against RR before, sC", _POTENTIALS, "erp", "fig3"),
    Result("erp iC", "2.6.1, Fig 3B", "ERP, RH against RR before, iC", "significant, p < 0.05", "erp", "fig3"),
    Result("ersp A", "Fig 2A", "ERSP, HR against HH before", _POTENTIALS, "ersp", "fig2"),
    Result("ersp B", "2.6.1, Fig 2B", "ERSP, HR against HH after", "alpha, motor areas, p < 0.05", "ersp", "fig2"),
    Result("ersp C alpha", "2.6.1, Fig 2C", _RH_RR, "alpha, motor areas, from 700 ms, p < 0.05", "ersp", "fig2"),
    Result("ersp C theta", "2.6.1, Fig 2C", _RH_RR, "theta, prefrontal, 500 ms, p < 0.05", "ersp", "fig2"),
    Result(
        "ersp D", "2.6.1, Fig 2D", "ERSP, RH against RR after", "beta, left temporal, 600 ms, p < 0.05", "ersp", "fig2"
    ),
    Result("ersp 3 alpha", "2.6.1, Fig 3", _RH_RR, "alpha, motor areas, in sC and iC", "ersp", "fig3"),
    Result("ersp 3 theta", "2.6.1, Fig 3", _RH_RR, "theta, prefrontal, in sC and iC", "ersp", "fig3"),
    Result("ersp 3 early", "2.6.1, Fig 3", "ERSP, motor areas", "stronger and earlier in sC", "ersp", "fig3"),
    Result("ersp 3 more", "2.6.1, Fig 3", "ERSP, prefrontal theta", "more pronounced in iC", "ersp", "fig3"),
    *_table_2(),
    Result("chance", "2.6.2, Table 2", "chance level", "54.3 %", "decode", _FOREST),
    Result("sim 35", "3.3, Fig 4A", "SIM1, choice accuracy at episode 35", "about 70 %", "simulate", _FIG_4),
    Result(
        "sim 100", "Abstract, 3.3, Fig 4A", "SIM1, choice accuracy at episode 100", "about 80 %", "simulate", _FIG_4
    ),
    Result("minutes 35", "3.3", "SIM1, 35 episodes, at 2 s a trial", "about 6 min", "simulate"),
    Result("minutes 100", "Abstract, 3.3", "SIM1, 100 episodes, at 2 s a trial", "about 17 min", "simulate"),
    Result(
        "sim2", "3.3, Fig 4B", "SIM2: better decoders learn faster", "50 < emp. < 60 < 70 < 80 %", "simulate", _FIG_4
    ),
    Result("sim2 50", "3.3, Fig 4B", "SIM2: a decoder of 50 %", "learns nothing", "simulate", _FIG_4),
    Result("minutes 40", "3.3", "SIM3: 40 episodes, at 2 s a trial", "6 to 7 min", "simulate"),
    Result("sim3", "3.3, Fig 4C", "SIM3: relearning", "no notable loss in the long run", "simulate", _FIG_4),
    Result("sim4", "3.3, 4.3, Fig 4D", "SIM4: 4, 6, 10 subtasks", "the more, the slower", "simulate", _FIG_4),
    Result("sim4 2", "3.3, Fig 4D", "SIM4: human takes 2 of 10", "steeper than 5 of 10", "simulate", _FIG_4),
    Result("sim4 8", "3.3", "SIM4: robot has fewer subtasks", "shallower than 5 of 10", "simulate", _FIG_4),
    Result(
        "sim4 balance",
        "3.3, 4.3, 5, Fig 4D",
        "SIM4: imbalanced assignment",
        "comparable performance, does not affect the learning",
        "simulate",
        _FIG_4,
    ),
)


def is_study(results: Results) -> bool:
    """Return whether this is a study of takeovers, so that the paper has something to say on it."""
    return "RRvsRH" in results.settings.shared.problems and results.settings.study.split == "scenario"


def rows(results: Results) -> list[Row]:
    """Return every number that the paper prints, with this run's; nothing for a study of something else."""
    if not is_study(results):
        return []
    found = measured_moves.measure(results) | measured_brain.measure(results) | measured_learning.measure(results)
    basis = grounds(results)
    lines = []
    for r in RESULTS:
        one = found.get(r.key)
        verdict, why = basis.verdict(one, ran=_ran(results, r.stage or r.chapter))
        ours = one.text if one else "-"
        lines.append(Row(r.place, r.what, r.printed, ours, "result", verdict, why, r.chapter, r.figure))
    about = facts.gather(results)
    for kind, printed in (("setup", SETUP), ("parameter", PARAMETERS)):
        lines += [Row(p.place, p.what, p.printed, fill(p, results, about), kind) for p in printed]
    return lines


def _ran(results: Results, stage: str) -> bool:
    """Return whether a stage has left what its results are measured on."""
    return (stage, "group") in results.done if stage in _GROUP else bool(results.included(stage))


def fill(printed: Printed, results: Results, about: SimpleNamespace) -> str:
    """Return this run's value of a parameter, or a dash."""
    if not printed.ours:
        return "-"
    return _Plain().format(printed.ours, found=about, **results.settings.sections)


class _Plain(string.Formatter):
    """Formats lists and missing values as people write them."""

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, tuple | list):
            return ", ".join(f"{v:g}" if isinstance(v, float) else str(v) for v in value)
        return "-" if value is None else str(super().format_field(value, format_spec))
