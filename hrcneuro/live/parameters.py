"""The options of live streams: what must be there when a session is recorded, and when a person is told of it."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro import published
from hrcneuro.contract import option
from hrcneuro.learning.params import LEARNERS
from hrcneuro.live.transport import MARKER_TYPES, MOVES


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
            "markers": Declared(name=MOVES, type="Markers", sfreq=0.0),
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


def undeclared(options: RecordOptions) -> str:
    """Return a sentence where no stream of markers must be there; naming the EEG alone leaves the markers out."""
    if any(one.sfreq == 0 or one.type.lower() in MARKER_TYPES or one.name == MOVES for one in options.streams.values()):
        return ""
    return (
        f"no stream of markers is declared (record.streams names {', '.join(options.streams) or 'none'}): a recording "
        "begins without them; [record.streams.markers] asks for one"
    )


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


MODES = ("shadow", "semi", "closed")


@dataclass(frozen=True)
class OnlineOptions:
    """How the closed loop decides and learns."""

    mode: str = option(
        "shadow",
        "shadow: decide, learn and log, the robot hears nothing; semi: its policy changes at a block's end; closed: "
        "with every decision",
        choices=MODES,
    )
    learner: str = option("paper", "who learns, one of those that simulate compares", choices=LEARNERS)
    alpha: float = option(published.LEARNING_RATE.value, "learning rate of Eq 3", low=0, high=100, open_low=True)
    tau: float = option(published.TEMPERATURE.value, "temperature of Eq 5", low=0, high=100, open_low=True)
    horizon: float = option(40.0, "episodes between reassignments that the learner 'forgetting' expects", low=1)
    floor: float = option(
        0.0, "least probability of each action, so that the robot explores; 0: the softmax alone", low=0, high=0.5
    )
    afresh: bool = option(False, "forget all at a block's beginning: where owners are drawn anew in each block")
    scenarios: tuple[str, ...] = option(("iC",), "scenarios whose moves teach; in others it is decided and logged only")
    deadline_s: float = option(
        0.75, "a move that is decided later after its onset makes no update", unit="s", low=0.6, high=5.0
    )
    snap_s: float = option(
        0.1, "so far a trigger's edge may be from the marker that it times", unit="s", low=0, high=0.5
    )
    amp_delay_ms: float = option(
        0.0, "how much later the amplifier's stamps show what happens", unit="ms", low=-500, high=500
    )
    trigger: str = option("auto", "the trigger channel; auto: by its type; none: markers alone time the moves")
    eeg: str = option("", "name of the EEG's stream; any of type EEG, where empty; * and ? stand for anything")
    markers: str = option(MOVES, "name of the markers' stream")
    wait_s: float = option(10.0, "so long the EEG is looked for at the start", unit="s", low=1.0, high=600.0)
    lost_s: float = option(10.0, "EEG that is silent for so long ends the loop", unit="s", low=1.0, high=600.0)


def check_online(options: OnlineOptions) -> list[str]:
    """Return the contradictions between values."""
    mistakes = []
    if not options.markers:
        mistakes.append("markers is empty; allowed: the name of a stream, such as hrcneuro-moves")
    if options.mode == "semi" and options.afresh:
        mistakes.append(
            "mode = 'semi' with afresh = true: what is learned in a block is forgotten as the policy changes, so that "
            "the robot tosses coins; allowed: one of them, such as mode = 'closed' with afresh"
        )
    if not options.scenarios:
        mistakes.append("scenarios = [] teaches nothing; allowed: at least one, such as iC")
    return mistakes
