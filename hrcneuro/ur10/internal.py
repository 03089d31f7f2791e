"""Lines on the script ports that are no URScript: what PolyScope itself sends, and drivers after it.

UR's manuals do not describe them; these are what UR's own client library and laboratories' programs send.
"""

from __future__ import annotations

from collections.abc import Callable

from hrcneuro.ur10.controller import Controller

_COMMANDS: dict[str, Callable[[Controller], object]] = {
    "power on": Controller.power_on,
    "power off": Controller.power_off,
    "set robotmode run": Controller.release_brakes,
    "set robotmode freedrive": Controller.begin_freedrive,
    "run program": Controller.resume,
    "continue program": Controller.resume,
    "resume program": Controller.resume,
    "pause program": Controller.pause,
    "stop program": Controller.stop_program,
    "set unlock protective stop": lambda c: c.unlock_protective_stop(wait=True),
    # Which of a real and a simulated arm a program moves: here there is one.
    "set real": lambda c: None,
    "set sim": lambda c: None,
}
_SPEED = "set speed "


def obey(controller: Controller, line: str) -> bool:
    """Do what a line asks for; return False where it is none of these, as a program is."""
    words = " ".join(line.split())
    if words.startswith(_SPEED):
        return _set_speed(controller, words.removeprefix(_SPEED))
    command = _COMMANDS.get(words)
    if command is None:
        return False
    command(controller)
    return True


def _set_speed(controller: Controller, share: str) -> bool:
    try:
        slider = float(share)
    except ValueError:
        return False
    if not 0.0 <= slider <= 1.0:
        return False
    controller.slider = slider
    return True
