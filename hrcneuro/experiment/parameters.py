"""What can be configured of an experiment."""

from __future__ import annotations

from dataclasses import dataclass

from hrcneuro.contract import option
from hrcneuro.paradigm.params import ClosedParams

TURNS_DEG = (0, 90, 180, 270)
"""How the picture can lie on the screen."""


@dataclass(frozen=True)
class WindowOptions:
    """Where and how large the person sees the grid (paper § 2.3.1: face up, full screen, 49 × 49 cm)."""

    display: int = option(0, "number of the screen; 0: the first one", low=0, high=15, keyed=False)
    windowed: bool = option(False, "a window among others in place of the full screen", keyed=False)
    scale: float = option(
        1.0,
        "size of the grid as a share of its true size; 0: as large as fits. Under an arm it must be 1",
        low=0.0,
        high=1.0,
        keyed=False,
    )
    pixels_per_cm: float = option(
        0.0,
        "pixels of the screen in a centimetre; 0: from what the screen says of itself, else by a bank card held to it",
        low=0.0,
        high=400.0,
        keyed=False,
    )
    rotate: int = option(
        0,
        "which edge of the screen lies at the robot; 0: the top, 90: the right, 180: the bottom, 270: the left one",
        unit="°",
        low=0,
        high=270,
        keyed=False,
    )
    show_turn: bool = option(False, "say whose turn it is", keyed=False)
    font: str = option(
        "", "font file for the words, for scripts other than Latin, Greek, Cyrillic", path=True, keyed=False
    )


def window_mistakes(options: WindowOptions, name: str) -> list[str]:
    """Return what is wrong in the values; ``name`` is the options' in the configuration."""
    if options.rotate not in TURNS_DEG:
        return [f"{name}.rotate = {options.rotate}: 0, 90, 180 or 270 is needed"]
    return []


@dataclass(frozen=True)
class ExperimentOptions:
    """How the study is run with a person (paper § 2.2 to 2.4); protocol and timing are acquire.session and .timing."""

    human: str = option(
        "person", "who presses the keys: a person at the window, or a simulated one with the habits of the logs",
        choices=("person", "simulated"), keyed=False,
    )  # fmt: skip
    pace: str = option(
        "real", "real: the machine's clock; virtual: as fast as it computes, with the arm sim, without window and LSL",
        choices=("real", "virtual"), keyed=False,
    )  # fmt: skip
    drawn_tool: bool = option(
        False, "no arm: the tool is drawn on the grid, and moves as the arm sim does", keyed=False
    )
    markers: str = option(
        "lsl", "lsl: motion onsets, blocks, episodes, keys and errors go out on the lab streaming layer",
        choices=("none", "lsl"), keyed=False,
    )  # fmt: skip
    truth: bool = option(
        False, "beside a simulated person and hrcneuro amp: tell it what the person expects", keyed=False
    )
    path_after_s: float = option(
        0.3, "from the arm's arrival at the start tile until the path appears", unit="s", low=0.0, high=10.0,
        keyed=False,
    )  # fmt: skip
    pause_s: float = option(
        1.5, "from then until the first move, each up to a half longer", unit="s", low=0.0, high=60.0, keyed=False
    )
    break_s: float = option(
        8.0, "a simulated person's break between blocks, each up to a half longer", unit="s", low=0.0, high=600.0,
        keyed=False,
    )  # fmt: skip
    watch_recorder: bool = option(
        True, "pause when 'hrcneuro record' of this subject, on this machine, loses a declared stream", keyed=False
    )
    screen: bool = option(True, "open the person's window; without one only for a simulated person", keyed=False)
    loop: str = option(
        "open", "open: the study, in which it is decided beforehand who does what; closed: the robot draws from what "
        "'hrcneuro online' has learned", choices=("open", "closed"), keyed=False,
    )  # fmt: skip
    loop_wait_s: float = option(
        10.0, "so long 'hrcneuro online' is looked for before closed blocks", unit="s", low=0.0, high=600.0, keyed=False
    )
    closed: ClosedParams = option(ClosedParams(), "closed blocks")
    window: WindowOptions = option(WindowOptions(), "the person's screen")


def check_experiment(options: ExperimentOptions) -> list[str]:
    """Return the contradictions between values."""
    mistakes = window_mistakes(options.window, "window")
    if options.pace == "virtual" and options.human != "simulated":
        mistakes.append(
            f"pace = 'virtual' with human = {options.human!r}: no person keeps up with a virtual clock; allowed: "
            "human = 'simulated' (--human simulated)"
        )
    if not options.screen and options.human != "simulated":
        mistakes.append(
            f"screen = false with human = {options.human!r}: a person sees and presses in a window; allowed with "
            "human = 'simulated'"
        )
    if options.truth and options.human != "simulated":
        mistakes.append(
            f"truth = true with human = {options.human!r}: what a person will do is not known ahead; allowed with "
            "human = 'simulated'"
        )
    return mistakes
