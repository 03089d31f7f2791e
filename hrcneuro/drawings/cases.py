"""The paper's Figs 2 and 3, which join the group's erp and ersp: a takeover against the continuation of its owner."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Of, Read
from hrcneuro.paradigm.design import FIG_2, FIG_3

if TYPE_CHECKING:
    from hrcneuro.figures.cases import CasePanel
    from hrcneuro.tables.maps import GroupMaps


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw the figures whose contrasts have all been tested."""
    import numpy as np

    from hrcneuro.figures import notes
    from hrcneuro.figures.cases import compose
    from hrcneuro.figures.style import save
    from hrcneuro.tables.maps import read_positions, read_tested

    potentials = read_tested(files.path("erp", "erp_stats.parquet"))
    rhythms = read_tested(files.path("ersp", "ersp_stats.parquet")) if files.has("ersp", "ersp_stats.parquet") else None
    for name, printed in (("fig2.png", FIG_2), ("fig3.png", FIG_3)):
        if not all(_key(one) in potentials.maps for one in printed):
            continue
        names = potentials.maps[_key(printed[0])].channels
        channel, missing = notes.shown_channel(config.erp.channel, names)
        panels = _panels(printed, files, potentials, rhythms, channel)
        positions = read_positions(files.path("erp", "channels.parquet"), names)
        banded = any(np.isfinite(panel.waves.plus_error).any() for panel in panels)
        bands = notes.bands("", 0, waves=banded, difference=False)
        note = "; ".join([*bands, _tests(config, panels), *missing])
        save(compose(panels, positions, channel=channel, gap_s=potentials.gap_s, note=note), out / name)


def _key(printed: tuple[str, ...]) -> tuple[str, str]:
    """Return the scenario and the name of a printed contrast."""
    _, scenario, case, continuation, position = printed
    return scenario, f"{case}-{continuation}_{position}"


def _panels(
    printed: tuple[tuple[str, str, str, str, str], ...],
    files: Inputs,
    potentials: GroupMaps,
    rhythms: GroupMaps | None,
    channel: str,
) -> list[CasePanel]:
    from hrcneuro.figures.cases import CasePanel
    from hrcneuro.tables.maps import read_contrast_waves

    waves = read_contrast_waves(files.path("erp", "erp_stats.parquet"), channel)
    return [
        CasePanel(*one, potentials.maps[key], waves[key], rhythms.maps.get(key) if rhythms else None)
        for one, key in ((one, _key(one)) for one in printed)
    ]


def _tests(config: Any, panels: list[CasePanel]) -> str:
    """Return what the tests of potentials and rhythms are: apart where they, or whether they found anything, differ."""
    from hrcneuro.figures.notes import named_test

    kinds = (
        ("potentials", [panel.potentials for panel in panels], config.erp),
        ("rhythms", [panel.rhythms for panel in panels if panel.rhythms is not None], config.ersp),
    )
    named = {
        what: named_test(options.correction, options.alpha, subjects=tested[0].n, found=any(one.any for one in tested))
        for what, tested, options in kinds
        if tested
    }
    if len(set(named.values())) == 1:
        return named["potentials"]
    return "; ".join(f"{what}: {test}" for what, test in named.items())


_SIGNIFICANT = (
    "Above: maps of the difference at the dotted times, the one with a channel's name at the largest of all channels "
    "and times; white: significant electrodes. Middle: one channel, mean ± standard error over "
    "subjects, takeover in colour, continuation in grey, grey spans significant. Below: the significant difference of "
    "wavelet magnitudes that is largest over the channels. Hatched: the next onset may fall here, so that its response "
    "may be mixed in. The figure's foot names the tests; the paper's own (its S2) is not at hand"
)

DRAWINGS = Drawings(
    name="cases",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    group=Drawing(
        captions={
            "fig2.png": Caption(f"Both scenarios together. {_SIGNIFICANT}", "Fig 2"),
            "fig3.png": Caption(f"Each scenario alone. {_SIGNIFICANT}", "Fig 3"),
        },
        reads=(
            Read("erp", ("erp_stats.parquet", "channels.parquet"), Of.GROUP),
            Read("ersp", ("ersp_stats.parquet",), Of.GROUP, required=False),
        ),
        options=("erp.channel", "erp.correction", "erp.alpha", "ersp.correction", "ersp.alpha"),
        draw=draw,
    ),
    chapter="erp",
)
