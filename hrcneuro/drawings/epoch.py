"""The picture of epoch: which trials were kept, and why the others were not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Read


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw one subject's trials from drop_log.parquet and conditions.parquet."""
    from hrcneuro.figures import drop_log
    from hrcneuro.io.tables import read_table

    log, conditions = (read_table(files.path("epoch", f"{name}.parquet")) for name in ("drop_log", "conditions"))
    drop_log.draw(log, conditions, config.epoch.reject_uv, out / "drop_log.png")


DRAWINGS = Drawings(
    name="epoch",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    subject=Drawing(
        captions={
            "drop_log.png": Caption(
                "Above: the largest amplitude of every trial over the recording, crosses: rejected. Below: kept and "
                "rejected epochs by condition; a trial that is before one and after another counts in both"
            )
        },
        reads=(Read("epoch", ("drop_log.parquet", "conditions.parquet")),),
        options=("epoch.reject_uv",),
        draw=draw,
    ),
)
