"""Who is told of a session's onsets, as the robot stage's options have it."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from hrcneuro.errors import HardwareError
from hrcneuro.live import onsets
from hrcneuro.live.onsets import OnOnset
from hrcneuro.robot.plan import evoking

if TYPE_CHECKING:
    import pandas as pd

    from hrcneuro.analyses.driven import Driven


def on_onset_of(config: Any, driven: Driven, trials: pd.DataFrame, stack: contextlib.ExitStack) -> OnOnset | None:
    """Return what is done at each onset, the trigger first: it times the recording; none where nobody is told.

    Args:
        config: The robot stage's options.
        driven: The session, which takes the stamps of the markers.
        trials: The subject's trial table.
        stack: Closes port and streams.

    Raises:
        HardwareError: A port or stream cannot be opened, or nobody listens in time.
    """
    senders: list[OnOnset] = []
    texts = [move.marker(driven.subject) for move in driven.moves]
    source = f"hrcneuro robot {driven.subject}"
    if config.trigger.port != "none":

        def failed(error: HardwareError) -> None:
            driven.words.say(error.problem, cure=error.cure)

        senders.append(onsets.trigger(config.trigger, stack, failed=failed))
    if config.markers == "lsl":
        senders.append(onsets.Markers(source, config.recorder_wait_s, stack).at_onsets(texts, driven.stamps))
    if config.truth:
        rows = [{"marker": text, **row} for text, row in zip(texts, evoking(driven.moves, trials), strict=True)]
        gaps = [move.gap if not after.first else float("nan") for move, after in itertools.pairwise(driven.moves)]
        senders.append(onsets.truth(f"{source} truth", rows, [*gaps, float("nan")], stack))
    if not senders:
        return None

    def tell(age: Callable[[], float], move: int) -> None:
        for send in senders:
            send(age, move)

    return tell
