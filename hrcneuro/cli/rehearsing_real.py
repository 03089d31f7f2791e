"""A rehearsal in real time: ``amp`` and ``record`` as processes beside the experiment, over LSL."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import uuid
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from hrcneuro.cli import bring, experimenting
from hrcneuro.cli.experiment_desk import Desk
from hrcneuro.cli.options import Options
from hrcneuro.config.settings import Settings
from hrcneuro.errors import HardwareError
from hrcneuro.experiment.ahead import Ahead
from hrcneuro.experiment.ports import Seen
from hrcneuro.live.liblsl import apart

_ENDS_S = 60.0


def real(
    options: Options,
    study: Settings,
    subject: str,
    folder: Path,
    given: Mapping[str, Sequence[str]],
    ahead: Ahead,
    *,
    decoder: Path | None = None,
) -> Seen:
    """Run one block beside ``amp`` and ``record``, and beside ``online`` with a decoder; return what was seen of it.

    The arm is one for which was looked ahead.

    Raises:
        HrcError: The session cannot be begun.
        HardwareError: Amplifier, recorder or loop ended by themselves.
    """
    from hrcneuro.experiment.real import RealTime

    # A rehearsal hears no stream of the laboratory, and the laboratory none of its own.
    lsl = folder / "lsl.cfg"
    lsl.write_text(apart(str(uuid.uuid4())), encoding="utf-8")
    os.environ["LSLAPICFG"] = str(lsl)
    setup = experimenting.setup_of(study, subject, folder)
    common = ["--workdir", str(folder), *(["--config", str(options.config)] if options.config else [])]
    for one in [*(options.set or ()), *(text for texts in given.values() for text in texts)]:
        common += ["--set", one]
    # Another sitting than the one that was calibrated on.
    sitting = ["--sitting", "1"] if decoder is not None else []
    with (
        _beside("amp", [subject, *sitting, *common], folder) as amp,
        _beside("record", [subject, *common], folder) as recorder,
        _deciding(subject, decoder, common, folder) as loop,
        Desk(bring.console(options), setup.n_blocks) as desk,
    ):
        try:
            return RealTime(setup, desk, streams=["eeg"], ahead=ahead).run()
        finally:
            for name, process, ended in (
                ("amp", amp, (None,)),
                ("record", recorder, (None,)),
                ("online", loop, (None, 0)),
            ):
                # The loop ends by itself where the session does.
                if process is not None and process.poll() not in ended:
                    raise HardwareError(
                        f"'hrcneuro {name}' ended by itself: {_last_words(folder / f'{name}.txt')}",
                        cure=f"see {folder / f'{name}.txt'}",
                    )


def _deciding(
    subject: str, decoder: Path | None, common: Sequence[str], folder: Path
) -> contextlib.AbstractContextManager[subprocess.Popen[bytes] | None]:
    if decoder is None:
        return contextlib.nullcontext()
    return _beside("online", [subject, "--decoder", str(decoder), *common], folder)


@contextlib.contextmanager
def _beside(name: str, words: Sequence[str], folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command beside this one; leaving ends it as Ctrl-C does, and waits until all is written."""
    with (folder / f"{name}.txt").open("wb") as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "hrcneuro", name, *words],
            stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            try:
                process.wait(_ENDS_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _last_words(path: Path) -> str:
    """Return what a command said last; of an error the problem, behind which its cure stands."""
    lines = path.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    errors = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
    return (errors or lines or ["without a word"])[-1]
