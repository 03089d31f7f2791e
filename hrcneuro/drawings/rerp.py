"""The pictures of rerp: coefficients with maps above them, and what plain differences are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Read

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hrcneuro.eeg.significance import SignificanceMap

    Key = tuple[str, str]

_INTERCEPT = "Intercept"


def draw_subject(config: Any, files: Inputs, out: Path) -> dict[str, Any]:
    """Draw one subject's coefficients."""
    import numpy as np

    from hrcneuro.eeg.significance import SignificanceMap
    from hrcneuro.tables.rerp import read_coefficients

    own = read_coefficients(files.path("rerp", "rerp.parquet"))
    maps = {
        key: SignificanceMap(1, own.channels, own.times, one, np.zeros(one.shape, bool), np.zeros(0))
        for key, one in own.maps.items()
    }
    sd = {key: np.full(one.shape, np.nan) for key, one in own.maps.items()}
    return {"warnings": _draw(config, files, maps, sd, own.gap_s, out / "rerp_subject.png", files.unit)}


def draw_group(config: Any, files: Inputs, out: Path) -> dict[str, Any]:
    """Draw the group's tested coefficients, and what plain differences are made of."""
    from hrcneuro.figures import notes
    from hrcneuro.tables.rerp import read_tested

    tested, options = read_tested(files.path("rerp", "rerp_stats.parquet")), config.rerp
    found = any(one.any for (_, name), one in tested.maps.items() if name != _INTERCEPT)
    test = notes.named_test(options.correction, options.alpha, subjects=tested.subjects, found=found)
    missing = _draw(config, files, tested.maps, tested.sd, tested.gap_s, out / "rerp.png", test)
    first = next(iter(tested.maps.values()))
    _draw_parts(config, files, first.channels, first.times, tested.gap_s, out / "rerp_parts.png")
    return {"warnings": missing}


def _draw(
    config: Any,
    files: Inputs,
    maps: Mapping[Key, SignificanceMap],
    sd: Mapping[Key, NDArray[np.float64]],
    gap_s: float,
    picture: Path,
    note: str,
) -> list[str]:
    """Draw all coefficients but the intercept, scenarios side by side; return what a person should know."""
    from hrcneuro.figures import erp as figures
    from hrcneuro.figures import erp_panels, notes
    from hrcneuro.tables.maps import read_positions

    options, first = config.rerp, next(iter(maps.values()))
    keys = _side_by_side(maps)
    if not keys:
        return []
    channel, missing = notes.shown_channel(options.channel, first.channels)
    row = first.channels.index(channel)
    shown = erp_panels.PanelSettings(first.channels, first.times, row, gap_s, (), options.confidence)
    panels = erp_panels.of_coefficients(
        [erp_panels.CoefficientPanel(f"{key[0]}: {key[1]}", maps[key], sd[key]) for key in keys], shown
    )
    band = [f"bands: {100 * options.confidence:g}% intervals"] if first.n > 1 else []
    figures.draw(
        panels,
        first.times,
        read_positions(files.path("rerp", "channels.parquet"), first.channels),
        picture,
        channel=channel,
        gap_s=gap_s,
        note="; ".join([*missing, *band, note]),
    )
    return missing


def _side_by_side(maps: Mapping[Key, Any]) -> list[Key]:
    """Return the keys to draw: a coefficient's scenarios one after another."""
    names = dict.fromkeys(name for _, name in maps if name != _INTERCEPT)
    return [key for name in names for key in maps if key[1] == name]


def _draw_parts(
    config: Any, files: Inputs, channels: Sequence[str], times: NDArray[np.float64], gap_s: float, picture: Path
) -> None:
    """Draw what the group's plain differences are made of; nothing where no contrast was taken apart."""
    from hrcneuro.figures import notes
    from hrcneuro.figures import rerp as figures
    from hrcneuro.tables.rerp import PLAIN, REST, read_parts

    channel, missing = notes.shown_channel(config.rerp.channel, channels)
    waves: dict[Key, dict[str, Any]] = {}
    for part in read_parts(files.path("rerp", "rerp_parts.parquet"), [channel]):
        waves.setdefault((part.contrast, part.scenario), {})[part.name] = part.map[0]
    panels = [
        figures.PartsPanel(f"{scenario}: {contrast}", own.pop(PLAIN), own, own.pop(REST))
        for (contrast, scenario), own in sorted(waves.items(), key=lambda item: item[0])
    ]
    if panels:
        figures.draw(panels, times, picture, channel=channel, gap_s=gap_s, note="; ".join(missing))


DRAWINGS = Drawings(
    name="rerp",
    libraries=("matplotlib", "numpy", "scipy", "pandas", "pyarrow"),
    subject=Drawing(
        captions={
            "rerp_subject.png": Caption(
                "One subject's coefficients at one channel, each with the others held equal, and maps of them; that of "
                "a predictor of 0 and 1 is what it adds to the response, in µV. A description: nothing is tested"
            )
        },
        reads=(Read("rerp", ("rerp.parquet", "channels.parquet")),),
        options=("rerp.channel", "rerp.confidence"),
        draw=draw_subject,
    ),
    group=Drawing(
        captions={
            "rerp_parts.png": Caption(
                "What the plain difference of two conditions (black) is made of: each predictor's part is its "
                "coefficient times how much its mean differs between the two; dashed is what no predictor explains, "
                "such as responses to neighbouring onsets. The parts add up to the difference; all of it is of one "
                "model with all trials",
                "What plain differences are made of",
            ),
            "rerp.png": Caption(
                "Mean coefficients over subjects at one channel with their confidence interval, and maps of them; grey "
                "spans and white electrodes: significant. Each is what remains with the other predictors held equal",
                "Coefficients of the regression",
            ),
        },
        reads=(Read("rerp", ("rerp_stats.parquet", "rerp_parts.parquet", "channels.parquet")),),
        options=("rerp.channel", "rerp.confidence", "rerp.correction", "rerp.alpha"),
        draw=draw_group,
    ),
)
