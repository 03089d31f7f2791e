"""The pictures of transfer: what minutes of cap time buy, and every subject by way."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hrcneuro.contract import Caption, Drawing, Drawings, Inputs, Of, Read

_SHUFFLED = "labels were shuffled: a control, no result"


def draw(config: Any, files: Inputs, out: Path) -> None:
    """Draw learning curves and subjects; nothing where nothing was decoded."""
    from hrcneuro.figures import transfer as figure
    from hrcneuro.io.tables import read_table

    curves, scores, tests = (read_table(files.path("transfer", f"{n}.parquet")) for n in ("curves", "scores", "tests"))
    if curves.empty:
        return
    note = _SHUFFLED if config.transfer.shuffled else ""
    figure.curves(curves, out / "transfer.png", note=note)
    for signal in dict.fromkeys(scores["signal"]):
        figure.subjects(scores, tests, out / f"transfer_{signal}.png", signal=signal, note=note)


_SUBJECTS = (
    "Every subject decoded in each way{}, and the means with their 95 % interval; *: above chance, Holm's p < 0.05"
)

DRAWINGS = Drawings(
    name="transfer",
    libraries=("matplotlib", "numpy", "pandas", "pyarrow"),
    group=Drawing(
        captions={
            "transfer.png": Caption(
                "Mean balanced accuracy with its 95 % interval over subjects, by how many minutes of cap time a "
                "subject has given before: decoders of its own trials alone, of the others' trials, and of both. At 0 "
                "minutes nothing is known of the subject",
                "Learning curves",
            ),
            "transfer_offline.png": Caption(_SUBJECTS.format(" from the epochs"), "Subjects by way"),
            "transfer_causal.png": Caption(_SUBJECTS.format(" as from a stream")),
        },
        reads=(Read("transfer", ("curves.parquet", "scores.parquet", "tests.parquet"), Of.GROUP),),
        options=("transfer.shuffled",),
        draw=draw,
    ),
)
