"""The table beside the ERP image, made when it is drawn: single trials of every channel would be too much to keep."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hrcneuro.eeg.trial_image import TrialImage
from hrcneuro.io.tables import Column, Table, write_table

ERP_IMAGE = Table(
    1,
    "one row a contrast, condition and line of the ERP image, all scenarios together",
    {
        "contrast": Column("category", "", "name of the contrast; null in a study without one"),
        "condition": Column("category", "", "name of the condition"),
        "channel": Column("category", "", "EEG channel"),
        "line": Column("int", "", "line of the image, from 0"),
        "rank": Column("float", "", "place of its middle among the condition's trials, from 0"),
        "n": Column("int", "", "trials that the line is the mean of; neighbouring lines share some"),
        "gap_s": Column("float", "s", "their mean time to the next onset, which orders the trials; null where unknown"),
        "start_s": Column("float", "s", "time of the first value of the lists, from the onset"),
        "step_s": Column("float", "s", "time from one value of the lists to the next"),
        "mean_uv": Column("float32[]", "uV", "mean of the line's trials, less the baseline"),
    },
)


def write_erp_image(
    images: Mapping[tuple[str, str], TrialImage], channel: str, times: NDArray[np.float64], path: Path
) -> None:
    """Write erp_image.parquet.

    Args:
        images: (contrast or an empty string, condition) -> the condition's trials as lines; one at least.
        channel: Whose trials they are.
        times: ndarray, shape (n_times,), s.
        path: The file.
    """
    start_s, step_s = float(times[0]), float(np.diff(times).mean())
    frames = [
        pd.DataFrame(
            {"line": np.arange(len(one.lines)), "rank": one.ranks, "n": one.trials, "gap_s": one.gaps_s}
        ).assign(contrast=contrast or None, condition=condition, channel=channel, start_s=start_s, step_s=step_s)
        for (contrast, condition), one in images.items()
    ]
    keys = pd.concat(frames, ignore_index=True)
    columns: dict[str, Any] = {str(name): keys[name] for name in keys}
    lines = np.concatenate([one.lines for one in images.values()])
    write_table(columns | {"mean_uv": lines}, path, ERP_IMAGE)
