"""The pictures of erp: waveforms with maps above them, of a subject and of the group; a subject's single trials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Read

if TYPE_CHECKING:
    from hrcneuro.tables.maps import GroupMaps


def draw_subject(config: Any, files: Inputs, out: Path) -> dict[str, Any]:
    """Draw one subject's contrasts over all scenarios, or its conditions, from waveforms.parquet."""
    from hrcneuro.figures import erp as figures
    from hrcneuro.figures import erp_panels, notes
    from hrcneuro.tables.maps import read_positions, read_waveforms

    waves, options = read_waveforms(files.path("erp", "waveforms.parquet")), config.erp
    channel, missing = notes.shown_channel(options.channel, waves.channels)
    row = waves.channels.index(channel)
    shown = erp_panels.PanelSettings(
        waves.channels, waves.times, row, waves.gap_s, options.map_times_s, options.confidence
    )
    panels = erp_panels.of_subject(waves.counts, waves.means, waves.errors, options.contrasts, shown)
    bands = notes.bands(" over trials", options.confidence, **figures.bands(panels))
    if options.overlap == "regress":
        bands = ["overlap of responses regressed out, which leaves no standard error"]
    figures.draw(
        panels,
        waves.times,
        read_positions(files.path("erp", "channels.parquet"), waves.channels),
        out / "erp_subject.png",
        channel=channel,
        gap_s=waves.gap_s,
        note="; ".join([files.unit, *missing, *bands]),
    )
    # The tables hold no single trials; without the epochs the rest is drawn.
    if files.has("epoch", "{unit}_epo.fif"):
        _draw_image(options, files, channel, out)
    return {"warnings": missing}


def _draw_image(options: Any, files: Inputs, channel: str, out: Path) -> None:
    """Draw the trials of the first contrasts that have any, of the conditions without one; write them beside it."""
    import numpy as np
    import pandas as pd

    from hrcneuro.analyses.conditions import matching
    from hrcneuro.eeg.evoked import subtract_baseline
    from hrcneuro.eeg.trial_image import trial_image
    from hrcneuro.figures import erp_image
    from hrcneuro.io.trials import read_trials
    from hrcneuro.tables.erp_image import write_erp_image

    trials = read_trials(files, np.float32)
    start, stop = options.baseline_s
    waves = subtract_baseline(trials.data[:, trials.info["ch_names"].index(channel)], trials.times, (start, stop))
    members = {name: mask for name, mask in matching(trials.table, options.conditions).items() if mask.any()}
    unknown = pd.Series([float("nan")] * len(waves))
    gaps = pd.to_numeric(trials.table.get("soa_s", unknown), errors="coerce").to_numpy(float)
    pairs = {name: pair for name, pair in options.contrasts.items() if set(pair) <= set(members)}
    groups = dict(list(pairs.items())[:_IMAGES]) or {name: (name,) for name in list(members)[:_IMAGES]}
    panels = {
        title: [(name, trial_image(waves[members[name]], gaps[members[name]])) for name in names]
        for title, names in groups.items()
    }
    images = {(title if pairs else "", name): one for title, panel in panels.items() for name, one in panel}
    by_gap = any(one.by_gap for one in images.values())
    # The line is in the picture where somebody goes on before the epoch ends.
    line_seen = any((gaps[members[name]] <= trials.times[-1]).any() for _, name in images)
    order = (
        f"trials by the time to the next onset{' (black line)' if line_seen else ''}"
        if by_gap
        else "trials as recorded"
    )
    single = all(one.trials == 1 for one in images.values())
    line = "a line a trial" if single else "a line is the mean of a twentieth of the trials, or one of few trials"
    note = f"{files.unit}; {order};\n{line}"
    erp_image.draw(panels, trials.times, out / "erp_image.png", channel=channel, note=note)
    write_erp_image(images, channel, trials.times, out / "erp_image.parquet")


def draw_group(config: Any, files: Inputs, out: Path) -> dict[str, Any]:
    """Draw the group's tested contrasts: of all trials, of each scenario, and within strata."""
    from hrcneuro.tables.maps import read_tested

    stats, strata = (files.path("erp", name) for name in ("erp_stats.parquet", "erp_strata.parquet"))
    tested, within = read_tested(stats), read_tested(strata)
    notes = _draw(config, files, stats, tested, tested.whole, out / "erp.png")
    notes += _draw(config, files, stats, tested, tested.by_scenario, out / "erp_scenarios.png")
    notes += _draw(config, files, strata, within, within.of_half_the_group, out / "erp_strata.png")
    return {"warnings": list(dict.fromkeys(notes))}


def _draw(
    config: Any, files: Inputs, table: Path, tested: GroupMaps, keys: Sequence[tuple[str, str]], picture: Path
) -> list[str]:
    """Draw these contrasts of a table, nothing where there is none; return what a person should know."""
    from hrcneuro.figures import erp as figures
    from hrcneuro.figures import erp_panels, notes
    from hrcneuro.tables.maps import read_contrast_waves, read_positions

    if not keys:
        return []
    first, options = tested.maps[keys[0]], config.erp
    channel, missing = notes.shown_channel(options.channel, first.channels)
    waves = read_contrast_waves(table, channel)
    contrasts = [erp_panels.GroupPanel(*key, *tested.conditions[key], tested.maps[key], waves[key]) for key in keys]
    row = first.channels.index(channel)
    shown = erp_panels.PanelSettings(
        first.channels, first.times, row, tested.gap_s, options.map_times_s, options.confidence
    )
    found = any(tested.maps[key].any for key in keys)
    test = notes.named_test(options.correction, options.alpha, subjects=tested.subjects, found=found)
    panels = erp_panels.of_group(contrasts, shown)
    figures.draw(
        panels,
        first.times,
        read_positions(files.path("erp", "channels.parquet"), first.channels),
        picture,
        channel=channel,
        gap_s=tested.gap_s,
        note="; ".join([*missing, *notes.bands("", options.confidence, **figures.bands(panels)), test]),
    )
    return missing


_IMAGES = 4  # panels of the ERP image
_SHOWN = ("erp.channel", "erp.map_times_s", "erp.confidence")

_MAPS_AT = (
    "Dotted: the times of the maps. The map with a channel's name is at the largest value of all channels and times; "
    "it may lie before the onset, or in the hatched span, where responses to the next onset are mixed in"
)

DRAWINGS = Drawings(
    name="erp",
    libraries=("matplotlib", "numpy", "scipy", "pandas", "pyarrow"),
    subject=Drawing(
        captions={
            "erp_subject.png": Caption(
                "One subject's potentials with standard errors over trials; their difference with its confidence "
                "interval, and maps of it (of the potential itself where a panel shows one condition, thin grey lines: "
                f"all channels). {_MAPS_AT}"
            ),
            "erp_image.png": Caption(
                "Single trials of both conditions of a contrast at one channel, in the order of the time to the next "
                "onset, where that is known; a black line is the next onset: what follows is the response to that"
            ),
        },
        reads=(
            Read("erp", ("waveforms.parquet", "channels.parquet")),
            Read("epoch", ("*_epo*.fif",), required=False),
        ),
        options=(*_SHOWN, "erp.contrasts", "erp.overlap", "erp.conditions", "erp.baseline_s"),
        draw=draw_subject,
    ),
    group=Drawing(
        captions={
            "erp.png": Caption(
                "Grand averages of each contrast, its first condition in colour, its second in grey, with standard "
                "errors over subjects; below them the mean difference with its confidence interval, above them maps "
                f"of it; grey spans and white electrodes: significant (as in the paper's Fig 2). {_MAPS_AT}",
                "ERP of all contrasts",
            ),
            "erp_scenarios.png": Caption(
                "The same contrasts in each scenario alone (the paper's Fig 3)", "ERP by scenario"
            ),
            "erp_strata.png": Caption(
                "The contrasts among trials that are alike in what went before (previous error) and in "
                "what is coming (turn): what remains of the difference does not stem from that",
                "ERP within strata",
            ),
        },
        reads=(Read("erp", ("erp_stats.parquet", "erp_strata.parquet", "channels.parquet")),),
        options=(*_SHOWN, "erp.correction", "erp.alpha"),
        draw=draw_group,
    ),
)
