"""The stages that need no options of their own: preprocess, epoch, erp, ersp, decode."""

from __future__ import annotations

from hrcneuro.cli.declare import Subjects, command
from hrcneuro.cli.options import Options


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
_plain_stage("epoch", "Cut epochs around movement onsets and count conditions.", "epoch s01", "epoch s01 s02 --json")
_plain_stage("erp", "Average, contrast and test event-related potentials.", "erp s01", "erp -j 2")
_plain_stage("ersp", "Time-frequency maps, their contrasts and tests.", "ersp s01", "ersp -j 2")
_plain_stage(
    "decode", "Decode single trials and compare with chance.", "decode s01", "decode --set decode.repeats=1 --dry-run"
)
