"""The stages that need no options of their own: preprocess, epoch, erp, ersp, rerp, decode, transfer, calibrate."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hrcneuro.cli.declare import Subjects, command
from hrcneuro.cli.options import Options

if TYPE_CHECKING:
    from hrcneuro.config.settings import Settings
    from hrcneuro.pipeline.item import Item


def _plain_stage(name: str, help: str, *examples: str) -> None:
    @command(help, *examples, name=name)
    def run(options: Options, subjects: Subjects = None) -> int:
        from hrcneuro.cli import bring

        return bring.stage(name, options, subjects)


_plain_stage(
    "preprocess",
    "Filter, remove eye movements, repair channels, re-reference, down-sample.",
    "preprocess s01",
    "preprocess --set preprocess.l_freq=0.5 --dry-run",
)


@command("Cut epochs around movement onsets and count conditions.", "epoch s01", "epoch s01 s02 --json", name="epoch")
def _epoch(options: Options, subjects: Subjects = None) -> int:
    from hrcneuro.cli import bring

    return bring.stage("epoch", options, subjects, notes=_without_trials)


def _without_trials(settings: Settings, items: Sequence[Item]) -> list[str]:
    """Return which conditions occur in no trial: a slip in a query is better told now than after the next stages.

    The items of the subjects have it among their warnings, too.
    """
    from hrcneuro.config import recordings

    cut = {item.unit for item in items if item.stage == "epoch" and item.state.done}
    tables = {i.unit: Path(i.artifacts["trials.parquet"]) for i in items if i.stage == "acquire" and i.unit in cut}
    notes = recordings.without_trials(settings, tables)
    for item in items:
        own = [note for note in notes if item.unit in note.partition(":")[0].split(", ")]
        if item.stage == "epoch" and own:
            item.summary = {**item.summary, "warnings": [*item.summary.get("warnings", ()), *own]}
    return notes


_plain_stage("erp", "Average, contrast and test event-related potentials.", "erp s01", "erp -j 2")
_plain_stage("ersp", "Time-frequency maps, their contrasts and tests.", "ersp s01", "ersp -j 2")
_plain_stage(
    "rerp",
    "Potentials by regression on what is known of every trial; takes overlapping responses apart.",
    "rerp s01",
    "rerp --set 'rerp.formula=\"actor * takeover + turn\"' --dry-run",
)
_plain_stage(
    "decode", "Decode single trials and compare with chance.", "decode s01", "decode --set decode.repeats=1 --dry-run"
)
_plain_stage(
    "transfer",
    "Decode people whom no decoder has seen, and tell what calibration adds.",
    "transfer",
    'transfer --set \'transfer.ways=["own", "pooled"]\' --dry-run',
)
_plain_stage(
    "calibrate",
    "Make a decoder that can work live, and say how it does on held-out blocks.",
    "calibrate s01",
    "calibrate s01 --set 'calibrate.matched=[\"turn\"]' --dry-run",
)
