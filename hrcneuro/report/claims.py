"""The findings that the paper prints, beside those of this run; then its setup and its parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from hrcneuro import published
from hrcneuro.contract import GROUP
from hrcneuro.published import Printed
from hrcneuro.report import facts, measured_arm, measured_brain, measured_decoding, measured_learning, measured_moves
from hrcneuro.report.parameters import PARAMETERS, SETUP, fill
from hrcneuro.report.results import Results
from hrcneuro.report.verdicts import Grounds, Measured, grounds
from hrcneuro.sources.origin import Origin

_FOREST, _FIG_4 = "decode-group-decoding", "simulate-group-fig4"
_GROUP = ("erp", "ersp", "simulate")  # measured on the group's item, the others on the subjects'
_MEASURES = (measured_moves, measured_brain, measured_decoding, measured_learning, measured_arm)


@dataclass(frozen=True)
class Claim:
    """A printed finding that a run can bear out or not.

    Attributes:
        key: Of what ``measure`` of the ``measured_`` modules has on it.
        printed: The finding.
        chapter: Where the page speaks of it.
        figure: Anchor of the picture to see; empty without one.
        stage: What measures it; empty where that is the chapter's stage.
        of_group: Whether the stage's group measures it, where subjects measure the rest.
        beside: Another stage whose group it is measured on, too; empty for none.
    """

    key: str
    printed: Printed[Any]
    chapter: str
    figure: str = ""
    stage: str = ""
    of_group: bool = False
    beside: str = ""

    @property
    def stages(self) -> tuple[str, ...]:
        """The stages whose results decide it."""
        return tuple(filter(None, (self.stage or self.chapter, self.beside)))


@dataclass(frozen=True)
class PublishedRow:
    """One line of the page's tables of the published.

    Attributes:
        place, quantity, published: Where the paper prints it, what it is, and what it prints.
        ours: What this run has; a dash where it has nothing.
        kind: ``result``, ``parameter`` or ``setup``; results alone have the rest.
        verdict, why: What the comparison comes to, and its criterion or reason.
        chapter, figure: As in :class:`Claim`.
        simulated: The ground (``eeg``, ``arm``, …) on which it rests, where that is simulated; else empty.
    """

    place: str
    quantity: str
    published: str
    ours: str
    kind: str
    verdict: str = ""
    why: str = ""
    chapter: str = ""
    figure: str = ""
    simulated: str = ""


def _table_2() -> list[Claim]:
    claims = []
    for (scenario, problem), rates in published.TABLE_2.items():
        cell = f"{scenario} {problem}"
        claims += [Claim(f"{cell} {name}", printed, "decode", _FOREST) for name, printed in rates.items()]
        claims += [
            Claim(f"{cell} {name} above", printed, "decode", _FOREST, of_group=True)
            for name, printed in published.ABOVE_CHANCE[scenario, problem].items()
        ]
    return claims


CLAIMS = (
    Claim("replaced", published.REPLACED_CHANNELS, "preprocess", "quality_group"),
    Claim("outlier", published.OUTLIERS, "preprocess", stage="epoch"),
    Claim("rejected", published.REJECTED_EPOCHS, "preprocess", stage="epoch"),
    Claim("steps", published.STEPS, "epoch", stage="acquire"),
    *(Claim(f"soa {scenario}", p, "epoch", "moves", "acquire") for scenario, p in published.SOA_MS.items()),
    Claim("soa 2 s", published.TRIAL_S, "epoch", "moves", "acquire"),
    *(Claim(f"trials {case}", printed, "epoch") for case, printed in published.TRIALS.items()),
    Claim("half", published.SEQUENTIAL_SHARE, "epoch"),
    Claim("mistakes", published.MISTAKES, "epoch", stage="acquire"),
    Claim("erp A", published.ERP_HR_HH_BEFORE, "erp", "fig2"),
    Claim("erp B", published.ERP_HR_HH_AFTER, "erp", "fig2"),
    Claim("erp C", published.ERP_RH_RR_BEFORE, "erp", "fig2"),
    Claim("erp D", published.ERP_RH_RR_AFTER, "erp", "fig2"),
    Claim("erp sC", published.ERP_RH_RR_BEFORE_SC, "erp", "fig3"),
    Claim("erp iC", published.ERP_RH_RR_BEFORE_IC, "erp", "fig3"),
    Claim("erp alike", published.ERP_ALIKE, "erp", "fig3"),
    Claim("ersp A", published.ERSP_HR_HH_BEFORE, "ersp", "fig2"),
    Claim("ersp B", published.ERSP_HR_HH_AFTER, "ersp", "fig2"),
    Claim("ersp C alpha", published.ERSP_RH_RR_BEFORE_ALPHA, "ersp", "fig2"),
    Claim("ersp C theta", published.ERSP_RH_RR_BEFORE_THETA, "ersp", "fig2"),
    Claim("ersp D", published.ERSP_RH_RR_AFTER, "ersp", "fig2"),
    Claim("ersp 3 alpha", published.ERSP_SCENARIOS_ALPHA, "ersp", "fig3"),
    Claim("ersp 3 theta", published.ERSP_SCENARIOS_THETA, "ersp", "fig3"),
    Claim("ersp 3 early", published.ERSP_SCENARIOS_MOTOR, "ersp", "fig3"),
    Claim("ersp 3 more", published.ERSP_SCENARIOS_PREFRONTAL, "ersp", "fig3"),
    Claim("locked", published.TIME_AND_PHASE, "ersp", "fig2", beside="erp"),
    *_table_2(),
    Claim("chance", published.CHANCE, "decode", _FOREST),
    *(Claim(f"sim {episode}", p, "simulate", _FIG_4) for episode, p in published.SIM1_ACCURACY.items()),
    Claim("minutes 35", published.SIM1_MINUTES[35], "simulate"),
    Claim("minutes 100", published.SIM1_MINUTES[100], "simulate"),
    Claim("sim2", published.SIM2_ORDER, "simulate", _FIG_4),
    Claim("sim2 50", published.SIM2_50, "simulate", _FIG_4),
    Claim("minutes 40", published.SIM3_MINUTES[40], "simulate"),
    Claim("sim3", published.SIM3_LOSS, "simulate", _FIG_4),
    Claim("sim4", published.SIM4_SUBTASKS, "simulate", _FIG_4),
    Claim("sim4 2", published.SIM4_TWO, "simulate", _FIG_4),
    Claim("sim4 8", published.SIM4_EIGHT, "simulate", _FIG_4),
    Claim("sim4 balance", published.SIM4_BALANCE, "simulate", _FIG_4),
    Claim("timing", published.TRIGGER_TIMING, "robot"),
)


def is_study(results: Results) -> bool:
    """Return whether this is a study of takeovers, so that the paper has something to say on it."""
    return "RRvsRH" in results.settings.shared.problems and results.settings.study.split == "scenario"


def measure(results: Results) -> dict[str, Measured]:
    """Return a claim's key -> what this run has on it; a key is absent where nothing has been measured."""
    return {key: one for module in _MEASURES for key, one in module.measure(results).items()}


def judged(results: Results, basis: Grounds) -> Iterator[tuple[Claim, Measured | None, str, str]]:
    """Yield each finding, what this run has on it, the verdict and its reason."""
    measured = measure(results)
    for claim in CLAIMS:
        ours = measured.get(claim.key)
        yield claim, ours, *basis.verdict(ours, ran=_ran(results, claim))


def rows(results: Results) -> list[PublishedRow]:
    """Return every number that the paper prints, with this run's; nothing for a study of something else."""
    if not is_study(results):
        return []
    basis, lines = grounds(results), []
    for claim, ours, verdict, why in judged(results, basis):
        about = claim.printed
        text = ours.text if ours else "-"
        ground = ours.rests_on if ours and basis.origin[ours.rests_on] is Origin.SYNTHETIC else ""
        words = (about.place, about.quantity, about.text, text)
        lines.append(PublishedRow(*words, "result", verdict, why, claim.chapter, claim.figure, ground))
    run = facts.gather(results)
    for kind, given in (("setup", SETUP), ("parameter", PARAMETERS)):
        lines += [PublishedRow(p.place, p.quantity, p.text, fill(ours, results, run), kind) for p, ours in given]
    return lines


def _ran(results: Results, claim: Claim) -> bool:
    """Return whether a claim's stage has left what it is measured on."""
    stage = claim.stage or claim.chapter
    return (stage, GROUP) in results.done if claim.of_group or stage in _GROUP else bool(results.included(stage))
