"""The options of live streams: what must be there when a session is recorded, and when a person is told of it."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro import published
from hrcneuro.contract import option


@dataclass(frozen=True)
class Declared:
    """A stream that must be there."""

    name: str = option("", "its name on LSL; any, where empty; * and ? stand for anything")
    type: str = option("", "its type on LSL, such as EEG or Markers; any, where empty")
    source_id: str = option("", "its source id; any, where empty")
    sfreq: float | None = option(None, "its nominal sampling rate; 0 for markers; none: any", unit="Hz", low=0)
    channels: tuple[str, ...] = option((), "labels of its channels, in their order; none named: any")
    n_channels: int = option(0, "how many channels it has; 0: any", low=0)
    unit: str = option("", "the unit that its EEG channels state, such as microvolts; any, where empty")
    flat: tuple[str, ...] = option((), "channels that may be flat: a trigger line, or an input nobody uses")

    @property
    def in_words(self) -> str:
        """What is asked for, for a message."""
        asked = {"name": self.name, "type": self.type, "source id": self.source_id}
        return " and ".join(f"{key} {value!r}" for key, value in asked.items() if value) or "any name and type"


@dataclass(frozen=True)
class RecordOptions:
    """How a session is recorded."""

    folder: str = option(
        "recordings",
        "where recordings are kept, by subject and start; unnamed, in the working folder; nothing deletes them",
        path=True,
        keyed=False,
        recordings=True,
    )
    streams: dict[str, Declared] = option(
        {
            "eeg": Declared(type="EEG", sfreq=published.RECORDED_HZ.value),
            "markers": Declared(name="hrcneuro-moves", type="Markers", sfreq=0.0),
        },
        "streams that must be there, [record.streams.NAME]",
    )
    others: bool = option(True, "also record every other stream that is there at the start")
    host_name: bool = option(False, "keep in the file the names and addresses of the machines that sent")
    wait_s: float = option(5.0, "so long a declared stream is looked for at the start", unit="s", low=1.0, high=600.0)
    look_s: float = option(2.0, "so long each stream is looked at before the start", unit="s", low=0.5, high=60.0)
    stall_s: float = option(0.5, "a regular stream that is silent for longer is told", unit="s", low=0.1, high=60.0)
    rate_tolerance: float = option(
        0.01, "share by which the measured rate may differ from the stated one", low=0.0001, high=1.0, share=True
    )
    flat_uv: float = option(0.05, "an EEG channel whose SD is smaller is flat", unit="µV", low=0.0)
    rail_uv: float = option(
        0.0, "an EEG channel beyond this is railed (actiCHamp: 409600 µV); 0: not told", unit="µV", low=0.0
    )
    line_hz: float = option(50.0, "frequency of the mains, whose noise is shown", unit="Hz", low=40.0, high=70.0)


def check_record(options: RecordOptions) -> list[str]:
    """Return the contradictions between values."""
    mistakes = []
    if not options.folder:
        mistakes.append("folder is empty; allowed: the name of a folder, such as recordings")
    if not options.streams and not options.others:
        mistakes.append("streams = {} with others = false records nothing; allowed: at least one stream, or others")
    for key, one in options.streams.items():
        if not (one.name or one.type or one.source_id):
            mistakes.append(f"streams.{key} has neither name nor type nor source_id; allowed: at least one of them")
        if one.channels and one.n_channels and len(one.channels) != one.n_channels:
            mistakes.append(
                f"streams.{key}.n_channels = {one.n_channels}, {len(one.channels)} channels are named; allowed: as many"
            )
        if twice := sorted({label for label in one.channels if one.channels.count(label) > 1}):
            mistakes.append(f"streams.{key}.channels names {twice[0]!r} twice; allowed: each once")
    return mistakes
