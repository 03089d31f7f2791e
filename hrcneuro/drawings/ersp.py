"""The pictures of ersp: time-frequency maps of differences, of a subject and of the group."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Read

if TYPE_CHECKING:
    from hrcneuro.tables.maps import GroupMaps


def draw_subject(config: Any, files: Inputs, out: Path) -> dict[str, Any]:
    """Draw one subject's differences over all scenarios, or its conditions, from ersp.parquet."""
    from hrcneuro.figures import ersp as figures
    from hrcneuro.figures import notes
    from hrcneuro.tables.maps import read_magnitudes

    subject = read_magnitudes(files.path("ersp", "ersp.parquet"))
    channels, missing = notes.shown_channels(config.ersp.channels, subject.axes["channel"])
    shown = figures.MapSettings(subject.axes["frequency_hz"], subject.axes["times"], subject.gap_s)
    rows, unit = figures.of_subject(subject.maps, config.ersp.contrasts, subject.axes["channel"], channels)
    what = "differences of mean magnitudes" if unit == "µV" else "mean magnitude over its mean in time"
    note = "; ".join([files.unit, what, *missing])
    figures.draw(rows, shown, out / "ersp_subject.png", unit=unit, note=note)
    return {"warnings": missing}


def draw_group(config: Any, files: Inputs, out: Path) -> dict[str, Any]:
    """Draw the group's tested contrasts: of all trials, of each scenario, and within strata."""
    from hrcneuro.tables.maps import read_tested

    tested, within = (read_tested(files.path("ersp", name)) for name in ("ersp_stats.parquet", "ersp_strata.parquet"))
    notes = _draw(config, tested, tested.whole, out / "ersp.png")
    notes += _draw(config, tested, tested.by_scenario, out / "ersp_scenarios.png")
    notes += _draw(config, within, within.of_half_the_group, out / "ersp_strata.png")
    return {"warnings": list(dict.fromkeys(notes))}


def _draw(config: Any, tested: GroupMaps, keys: Sequence[tuple[str, str]], picture: Path) -> list[str]:
    """Draw these contrasts, nothing where there is none; return what a person should know."""
    from hrcneuro.figures import ersp as figures
    from hrcneuro.figures import notes

    if not keys:
        return []
    first, options = tested.maps[keys[0]], config.ersp
    channels, missing = notes.shown_channels(options.channels, first.channels)
    shown = figures.MapSettings(first.frequencies, first.times, tested.gap_s)
    rows = figures.of_group({key: tested.maps[key] for key in keys}, channels)
    found = any(row.significant is not None and row.significant.any() for row in rows)
    test = notes.named_test(options.correction, options.alpha, subjects=tested.subjects, found=found)
    if found:
        test = f"outlined, in full colour: {test}"
    figures.draw(rows, shown, picture, unit="µV", note="; ".join([test, *missing]))
    return missing


DRAWINGS = Drawings(
    name="ersp",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    subject=Drawing(
        captions={
            "ersp_subject.png": Caption(
                "One subject's difference of mean magnitudes at some channels, and at the one of the largest "
                "difference, which a cross marks; it may lie before the onset, or in the hatched span, where "
                "responses to the next onset are mixed in (without a contrast: the magnitude itself, over its mean "
                "in time)"
            )
        },
        reads=(Read("ersp", ("ersp.parquet",)),),
        options=("ersp.channels", "ersp.contrasts"),
        draw=draw_subject,
    ),
    group=Drawing(
        captions={
            "ersp.png": Caption(
                "Differences of mean magnitudes over subjects; full colour where significant (as in the paper's Fig "
                "2). A cross marks the largest of all channels; it may lie before the onset, or in the hatched span, "
                "where responses to the next onset are mixed in",
                "ERSP of all contrasts",
            ),
            "ersp_scenarios.png": Caption(
                "The same contrasts in each scenario alone (the paper's Fig 3)", "ERSP by scenario"
            ),
            "ersp_strata.png": Caption(
                "The contrasts among trials that are alike in what went before (previous error) and in "
                "what is coming (turn)",
                "ERSP within strata",
            ),
        },
        reads=(Read("ersp", ("ersp_stats.parquet", "ersp_strata.parquet")),),
        options=("ersp.channels", "ersp.correction", "ersp.alpha"),
        draw=draw_group,
    ),
)
